/* Compiled once per table of moments.h, as core/stages/body.h is. */
#include "core/adjoints/moments.h"

#include "core/stages/lanes.h"

#define NAMED(name) JOIN(name, NODES)
#define TEXT "core/adjoints/dual_of_count.h"
#include "core/stages/each_power_count.h"
#define TEXT "core/adjoints/power_of_count.h"
#include "core/stages/each_power_count.h"
#define TEXT "kernels/trigonometric_moments.h"
#include "core/stages/each_count.h"
#define TEXT "core/adjoints/circle_of_count.h"
#include "core/stages/each_count.h"

static double sum_pulled(int count, const moit_wrapping_zone *zone, int n, const double *rule,
                         double b0, const double *z, const double *own, double beta,
                         const double *by, double *S, double *by_z, double *by_own) {
    (void)zone;
    memset(S, 0, MOIT_MOST_TERMS * sizeof *S);
    switch (count) {
    case 2: return sum_pulled1(n, rule, b0, z, own, beta, by, S, by_z, by_own);
    case 4: return sum_pulled2(n, rule, b0, z, own, beta, by, S, by_z, by_own);
    case 6: return sum_pulled3(n, rule, b0, z, own, beta, by, S, by_z, by_own);
    default: return sum_pulled4(n, rule, b0, z, own, beta, by, S, by_z, by_own);
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

static void nodes_through(int count, int n, const double *rule, const double *z, int stride,
                          double *y, double *ahead) {
    switch (count) {
    case 2: find_nodes1(n, rule, z, stride, y, ahead); break;
    case 4: find_nodes2(n, rule, z, stride, y, ahead); break;
    case 6: find_nodes3(n, rule, z, stride, y, ahead); break;
    default: find_nodes4(n, rule, z, stride, y, ahead);
    }
}

FN wrapping_zone zone_of(const moit_wrapping_zone *zone) {
    return (wrapping_zone){K(zone->turns), K(zone->edge), K(zone->scale)};
}

static double circle_sum_pulled(int count, const moit_wrapping_zone *zone, int n,
                                const double *rule, double b0, const double *z, const double *own,
                                double beta, const double *by, double *S, double *by_z,
                                double *by_own) {
    memset(S, 0, MOIT_MOST_TERMS * sizeof *S);
    wrapping_zone lanes = zone_of(zone);
    switch (count) {
    case 2: return circle_sum_pulled2(lanes, n, rule, b0, z, own, beta, by, S, by_z, by_own);
    case 3: return circle_sum_pulled3(lanes, n, rule, b0, z, own, beta, by, S, by_z, by_own);
    default: return circle_sum_pulled4(lanes, n, rule, b0, z, own, beta, by, S, by_z, by_own);
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

const moit_moment_adjoints TABLE[2] = {
    [MOIT_POWER] = {sum_pulled, read_polynomial, pull_each, nodes_through},
    [MOIT_TRIGONOMETRIC] = {circle_sum_pulled, read_circle, NULL, NULL}};

#include "core/stages/lanes_end.h"
