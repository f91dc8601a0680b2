/* Compiled once per table of moments.h, as core/stages/body.h is. */
#include "core/adjoints/moments.h"

#include "core/stages/lanes.h"
#include "core/stages/quads.h"
#include "core/stages/rays.h"
#include "core/stages/columns.h"

/* Which lanes are among the first n. */
FN truth among_first(int n) {
    truth lane = {0};
    for (int i = 0; i < LANES; ++i) lane[i] = i;
    return lane < (truth){0} + (bits)n;
}

FN void add_where(truth there, double *to, real x) {
    real before = load(to);
    store(to, select(there, before + x, before));
}

/* Adds up as four sums of every fourth: the same bits whatever lanes there are. */
FN void add_by_fours(quad *sum, int i, real x) {
#if LANES < 4
    for (int lane = 0; lane < LANES; ++lane) (*sum)[(i + lane) % 4] += x[lane];
#else
    (void)i;
    for (int k = 0; k < LANES; k += 4) {
        quad part;
        memcpy(&part, (const double *)&x + k, sizeof part);
        *sum += part;
    }
#endif
}

#define NAMED(name) JOIN(name, NODES)
#define TEXT "core/adjoints/dual_of_count.h"
#include "core/stages/each_power_count.h"
#define TEXT "core/adjoints/dual_sums_of_count.h"
#include "core/stages/each_power_count.h"
#define TEXT "core/adjoints/power_of_count.h"
#include "core/stages/each_power_count.h"
#define TEXT "core/adjoints/power_loops_of_count.h"
#include "core/stages/each_power_count.h"
#include "core/adjoints/rays_body.h"

/* Floats from `p` on as doubles, of which `n` are there; and back. */
typedef float narrow_real __attribute__((vector_size(LANES * sizeof(float))));

FN real widened(const float *p, int n) {
    narrow_real x = {0.0f};
    if (n >= LANES) memcpy(&x, p, sizeof x);
    else
        for (int i = 0; i < n; ++i) x[i] = p[i];
    return __builtin_convertvector(x, real);
}

FN void narrow(float *p, real x, int n) {
    narrow_real y = __builtin_convertvector(x, narrow_real);
    if (n >= LANES) memcpy(p, &y, sizeof y);
    else
        for (int i = 0; i < n; ++i) p[i] = y[i];
}

#include "kernels/pairs.h"
#define TEXT "core/adjoints/exact_rules_of_count.h"
#include "core/stages/each_power_count.h"
#define NODES 1
#include "core/adjoints/rows_of_count.h"
#undef NODES
#define NODES 2
#include "core/adjoints/rows_of_count.h"
#undef NODES
#define TEXT "kernels/trigonometric_moments.h"
#include "core/stages/each_count.h"
#define TEXT "core/adjoints/circle_of_count.h"
#include "core/stages/each_count.h"

static double sum_pulled(int count, const moit_wrapping_zone *zone, const moit_readings *at,
                         const double *rule, double b0, double beta, double *S) {
    (void)zone;
    memset(S, 0, MOIT_MOST_TERMS * sizeof *S);
    switch (count) {
    case 2: return sum_pulled1(at, rule, b0, beta, S);
    case 4: return sum_pulled2(at, rule, b0, beta, S);
    case 6: return sum_pulled3(at, rule, b0, beta, S);
    default: return sum_pulled4(at, rule, b0, beta, S);
    }
}

static void read_polynomial(int count, const moit_wrapping_zone *zone, int n, const double *rule,
                            const double *S, const double *z, double *value, double *slope) {
    (void)zone;
    switch (count) {
    case 2: read_polynomial1(n, rule, S, z, value, slope); break;
    case 4: read_polynomial2(n, rule, S, z, value, slope); break;
    case 6: read_polynomial3(n, rule, S, z, value, slope); break;
    default: read_polynomial4(n, rule, S, z, value, slope);
    }
}

static void pull_each(int count, int n, const double *rules, const double *b0, const double *z,
                      const double *own, double beta, const double *by, double *by_b0, double *by_b,
                      double *by_z, double *by_own) {
    switch (count) {
    case 2: pull_each1(n, rules, b0, z, own, beta, by, by_b0, by_b, by_z, by_own); break;
    case 4: pull_each2(n, rules, b0, z, own, beta, by, by_b0, by_b, by_z, by_own); break;
    case 6: pull_each3(n, rules, b0, z, own, beta, by, by_b0, by_b, by_z, by_own); break;
    default: pull_each4(n, rules, b0, z, own, beta, by, by_b0, by_b, by_z, by_own);
    }
}

static bool exact_rules(int count, const moit_exact_rays *rays) {
    switch (count) {
    case 2: return exact_rules1(rays);
    case 4: return exact_rules2(rays);
    case 6: return exact_rules3(rays);
    default: return exact_rules4(rays);
    }
}

static void bound_rows(int count, const moit_rows *rows, int64_t first, int n) {
    if (count == 2) bound_rows1(rows, first, n);
    else bound_rows2(rows, first, n);
}

static void nodes_through(int count, int n, const double *rule, const double *z, int stride,
                          double *y, double *ahead) {
    switch (count) {
    case 2: find_nodes1(n, rule, z, stride, y, ahead); break;
    case 4: find_nodes2(n, rule, z, stride, y, ahead); break;
    case 6: find_nodes3(n, rule, z, stride, y, ahead); break;
    default: find_nodes4(n, rule, z, stride, y, ahead);
    }
}

static void spread(int n, const moit_spread *from, const double *value, const double *slope,
                   double *by_z, double *by_a) {
    const double *a = from->a;
    /* as sums make means: of next to no absorbance, too, 1 / b0 is finite */
    const real inverse = K(1.0 / (from->b0 > 0x1p-1022 ? from->b0 : 0x1p-1022));
    const real keeps = K(from->keeps) * inverse, by_b0 = K(from->by_b0);
    quad sum = {0.0};
    for (int i = 0; i < n; i += LANES)
        add_by_fours(&sum, i,
                     select(among_first(n - i), load(a + i) * inverse * load(value + i), K(0.0)));
    const real mean = K((sum[0] + sum[1]) + (sum[2] + sum[3]));
    for (int i = 0; i < n; i += LANES) {
        truth there = among_first(n - i);
        add_where(there, by_a + i, by_b0 + keeps * (load(value + i) - mean));
        add_where(there, by_z + i, keeps * load(a + i) * load(slope + i));
    }
}

FN wrapping_zone zone_of(const moit_wrapping_zone *zone) {
    return (wrapping_zone){K(zone->turns), K(zone->edge), K(zone->scale)};
}

static double circle_sum_pulled(int count, const moit_wrapping_zone *zone, const moit_readings *at,
                                const double *rule, double b0, double beta, double *S) {
    memset(S, 0, MOIT_MOST_TERMS * sizeof *S);
    wrapping_zone lanes = zone_of(zone);
    switch (count) {
    case 2: return circle_sum_pulled2(lanes, at, rule, b0, beta, S);
    case 3: return circle_sum_pulled3(lanes, at, rule, b0, beta, S);
    default: return circle_sum_pulled4(lanes, at, rule, b0, beta, S);
    }
}

static void read_circle(int count, const moit_wrapping_zone *zone, int n, const double *rule,
                        const double *S, const double *z, double *value, double *slope) {
    wrapping_zone lanes = zone_of(zone);
    switch (count) {
    case 2: read_circle2(lanes, n, rule, S, z, value, slope); break;
    case 3: read_circle3(lanes, n, rule, S, z, value, slope); break;
    default: read_circle4(lanes, n, rule, S, z, value, slope);
    }
}

const moit_moment_adjoints TABLE[2] = {[MOIT_POWER] = {sum_pulled,
                                                       read_polynomial,
                                                       spread,
                                                       pull_each,
                                                       nodes_through,
                                                       bound_rows,
                                                       exact_rules,
                                                       {ray_absorbance, pull_rays}},
                                       [MOIT_TRIGONOMETRIC] = {.sum_pulled = circle_sum_pulled,
                                                               .read_polynomial = read_circle,
                                                               .spread = spread}};

#include "core/adjoints/tiles_body.h"
#include "core/stages/lanes_end.h"
