/* Stages of trigonometric moments: as power.h, which comes first. */

#include "kernels/circle_sums.h"

#define TEXT "kernels/trigonometric_moments.h"
#include "core/stages/each_count.h"

FN wrapping_zone zone_of(const moit_wrapping_zone *zone) {
    return (wrapping_zone){K(zone->turns), K(zone->edge), K(zone->scale)};
}

/* The means of x^j, j = 1 .. count, real and imaginary parts in turn. */
FN void circle_sums_of(const int count, const moit_wrapping_zone *zone, int pixels,
                       const int32_t *offsets, const SCALAR *a, const SCALAR *z, SCALAR *b0,
                       SCALAR *b) {
    const double *start = zone->middle;
    for (int p = 0; p < pixels; ++p) {
        quad total = {0};
        quad_point sum[4] = {{{0}, {0}}};
        int end = offsets[p + 1];
        for (int i = offsets[p]; i < end; i += 4) {
            quad weight = load_quad(a + i), depth = load_quad(z + i);
            if (end - i < 4) { /* as in power_sums_of */
                quad_truth there = (quad_truth){0, 1, 2, 3} < end - i;
                weight = (quad)((quad_truth)weight & there);
                depth = (quad)((quad_truth)depth & there);
            }
            total += weight;
            quad_point x = quad_point_of(depth, zone->turns * 3.1415926535897932385),
                       power = {weight * x.re, weight * x.im};
            for (int k = 0; k < count; ++k) {
                if (k > 0) power = quad_turned(power, x);
                sum[k].re += power.re;
                sum[k].im += power.im;
            }
        }
        double all = (total[0] + total[1]) + (total[2] + total[3]);
        double inverse = all > 0.0 ? 1.0 / all : 0.0;
        b0[p] = (SCALAR)all;
        for (int k = 0; k < count; ++k) {
            quad r = sum[k].re, s = sum[k].im;
            double re = ((r[0] + r[1]) + (r[2] + r[3])) * inverse;
            double im = ((s[0] + s[1]) + (s[2] + s[3])) * inverse;
            b[2 * (p * count + k)] = (SCALAR)(re * start[2 * k] - im * start[2 * k + 1]);
            b[2 * (p * count + k) + 1] = (SCALAR)(re * start[2 * k + 1] + im * start[2 * k]);
        }
    }
}

static void circle_sums_stage(int count, const moit_wrapping_zone *zone, int pixels,
                              const int32_t *offsets, const void *a, const void *z, void *b0,
                              void *b) {
    switch (count) {
    case 2: circle_sums_of(2, zone, pixels, offsets, a, z, b0, b); break;
    case 3: circle_sums_of(3, zone, pixels, offsets, a, z, b0, b); break;
    case 4: circle_sums_of(4, zone, pixels, offsets, a, z, b0, b); break;
    }
}

/* Lanes as in power.h. */
#define CIRCLE_TRANSMITTANCE_OF(n) \
    static void circle_transmittance_of##n( \
        const moit_wrapping_zone *zone_, int pixels, const int32_t *offsets, const SCALAR *z, \
        const SCALAR *own, const double *rules, const SCALAR *b0, double beta, SCALAR *T) { \
        wrapping_zone zone = zone_of(zone_); \
        ray_block block; \
        SCALAR row[5 * n + 4][BLOCK_ROW] = {{0}}; \
        for (int p = 0; p < pixels;) { \
            p = next_block(&block, p, pixels, offsets); \
            for (int r = 0; r < block.rays; ++r) { \
                const double *rule = rules + block.pixel[r] * MOIT_CIRCLE_RULE_SIZE(n); \
                for (int i = 0; i < 2 * n; ++i) { /* z and g */ \
                    row[i][r] = (SCALAR)rule[i]; \
                    row[2 * n + i][r] = (SCALAR)(rule[i] - (double)row[i][r]); \
                } \
                for (int i = 0; i < n + 3; ++i) row[4 * n + i][r] = (SCALAR)rule[2 * n + i]; \
                row[5 * n + 3][r] = b0[block.pixel[r]]; \
            } \
            for (int i = block.first; i < block.end; i += LANES) { \
                truth lane; \
                int ray = first_ray(&block, i, &lane); \
                circle_rule##n r; \
                for (int k = 0; k < n; ++k) { \
                    r.z[k] = lanes_of_row(row[k] + ray, lane); \
                    r.g[k] = lanes_of_row(row[n + k] + ray, lane); \
                    r.z_low[k] = lanes_of_row(row[2 * n + k] + ray, lane); \
                    r.g_low[k] = lanes_of_row(row[3 * n + k] + ray, lane); \
                    r.e[k] = lanes_of_row(row[4 * n + k] + ray, lane); \
                } \
                r.d = lanes_of_row(row[5 * n] + ray, lane); \
                r.f_front = lanes_of_row(row[5 * n + 1] + ray, lane); \
                r.f_back = lanes_of_row(row[5 * n + 2] + ray, lane); \
                real total = lanes_of_row(row[5 * n + 3] + ray, lane); \
                store(T + i, circle_absorbance_before##n(r, zone, total, load(z + i), \
                                                         own ? load(own + i) : K(0.0), K(beta))); \
            } \
            decay_of_block(&block, T); \
        } \
    }
CIRCLE_TRANSMITTANCE_OF(2)
CIRCLE_TRANSMITTANCE_OF(3)
CIRCLE_TRANSMITTANCE_OF(4)
#undef CIRCLE_TRANSMITTANCE_OF

static void circle_transmittance_stage(int count, const moit_wrapping_zone *zone, int pixels,
                                       const int32_t *offsets, const void *z, const void *own,
                                       const double *rules, const void *b0, double beta, void *T) {
    switch (count) {
    case 2: circle_transmittance_of2(zone, pixels, offsets, z, own, rules, b0, beta, T); break;
    case 3: circle_transmittance_of3(zone, pixels, offsets, z, own, rules, b0, beta, T); break;
    case 4: circle_transmittance_of4(zone, pixels, offsets, z, own, rules, b0, beta, T); break;
    }
}

#ifdef RULES /* double tables only */
#define TEXT "kernels/trigonometric_rules.h"
#include "core/stages/each_count.h"

#define CIRCLE_RULES_OF(n) \
    static void circle_rules_of##n(const moit_wrapping_zone *zone, int pixels, const double *b, \
                                   double bias, double least, double *rules) { \
        for (int p = 0; p < pixels; p += LANES) { \
            SCALAR own[2 * n][LANES]; \
            columns_of(2 * n, pixels - p, b + p * 2 * n, own); \
            circle_moments##n m; \
            for (int k = 0; k < n; ++k) { \
                m.re[k] = load(own[2 * k]); \
                m.im[k] = load(own[2 * k + 1]); \
            } \
            circle_rule##n r = circle_rule_of##n(m, zone_of(zone), K(bias), K(least)); \
            for (int lane = 0; lane < LANES && p + lane < pixels; ++lane) { \
                double *out = rules + (p + lane) * MOIT_CIRCLE_RULE_SIZE(n); \
                for (int i = 0; i < n; ++i) { \
                    out[i] = r.z[i][lane]; \
                    out[n + i] = r.g[i][lane]; \
                    out[2 * n + i] = r.e[i][lane]; \
                } \
                out[3 * n] = r.d[lane]; \
                out[3 * n + 1] = r.f_front[lane]; \
                out[3 * n + 2] = r.f_back[lane]; \
            } \
        } \
    }
CIRCLE_RULES_OF(2)
CIRCLE_RULES_OF(3)
CIRCLE_RULES_OF(4)
#undef CIRCLE_RULES_OF

static void circle_rules_stage(int count, const moit_wrapping_zone *zone, int pixels,
                               const double *b, double bias, const double *safe, double least,
                               double *rules) {
    (void)safe; /* an even spread, whose moments are 0 */
    switch (count) {
    case 2: circle_rules_of2(zone, pixels, b, bias, least, rules); break;
    case 3: circle_rules_of3(zone, pixels, b, bias, least, rules); break;
    case 4: circle_rules_of4(zone, pixels, b, bias, least, rules); break;
    }
}

#define CIRCLE_PIVOTS_OF(n) \
    static void circle_pivots_of##n(const moit_wrapping_zone *zone, int pixels, const double *b, \
                                    const double *bias, double *pivot) { \
        for (int p = 0; p < pixels; p += LANES) { \
            SCALAR own[2 * n + 1][LANES]; \
            for (int lane = 0; lane < LANES; ++lane) { \
                int from = p + lane < pixels ? p + lane : p; \
                for (int k = 0; k < 2 * n; ++k) own[k][lane] = b[from * 2 * n + k]; \
                own[2 * n][lane] = bias[from]; \
            } \
            circle_moments##n m; \
            for (int k = 0; k < n; ++k) { \
                m.re[k] = load(own[2 * k]); \
                m.im[k] = load(own[2 * k + 1]); \
            } \
            circle_moments##n mixed = circle_biased##n(m, zone_of(zone), load(own[2 * n])); \
            circle_recurrence##n r = circle_recurrence_of##n(mixed, K(NO_PIVOT)); \
            for (int lane = 0; lane < LANES && p + lane < pixels; ++lane) \
                pivot[p + lane] = r.lowest[lane]; \
        } \
    }
CIRCLE_PIVOTS_OF(2)
CIRCLE_PIVOTS_OF(3)
CIRCLE_PIVOTS_OF(4)
#undef CIRCLE_PIVOTS_OF

static void circle_pivots_stage(int count, const moit_wrapping_zone *zone, int pixels,
                                const double *b, const double *bias, const double *safe,
                                double *pivot) {
    (void)safe; /* as in circle_rules_stage */
    switch (count) {
    case 2: circle_pivots_of2(zone, pixels, b, bias, pivot); break;
    case 3: circle_pivots_of3(zone, pixels, b, bias, pivot); break;
    case 4: circle_pivots_of4(zone, pixels, b, bias, pivot); break;
    }
}
#define CIRCLE_RULES_STAGE circle_rules_stage
#define CIRCLE_PIVOTS_STAGE circle_pivots_stage
#else
#define CIRCLE_RULES_STAGE NULL
#define CIRCLE_PIVOTS_STAGE NULL
#endif
