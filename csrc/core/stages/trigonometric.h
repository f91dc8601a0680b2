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
        quad total = {0}, total_lost = {0};
        quad_point sum[4] = {{{0}, {0}}}, lost[4] = {{{0}, {0}}};
        int end = offsets[p + 1];
        for (int i = offsets[p]; i < end; i += 4) {
            quad weight = load_quad(a + i), depth = load_quad(z + i);
            if (end - i < 4) { /* as in power_sums_of */
                quad_truth there = (quad_truth){0, 1, 2, 3} < end - i;
                weight = (quad)((quad_truth)weight & there);
                depth = (quad)((quad_truth)depth & there);
            }
            add_quad(&total, &total_lost, weight);
            quad_point x = quad_point_of(depth, zone->turns * 3.1415926535897932385),
                       power = {weight * x.re, weight * x.im};
            for (int k = 0; k < count; ++k) {
                if (k > 0) power = quad_turned(power, x);
                add_quad(&sum[k].re, &lost[k].re, power.re);
                add_quad(&sum[k].im, &lost[k].im, power.im);
            }
        }
        double all = total_of(total, &total_lost), inverse = inverse_of_sum(all);
        b0[p] = (SCALAR)all;
        quad re[4], im[4], re_lost[4], im_lost[4];
        for (int k = 0; k < 4; ++k) {
            re[k] = sum[k].re;
            im[k] = sum[k].im;
            re_lost[k] = lost[k].re;
            im_lost[k] = lost[k].im;
        }
        quad mean_re = totals_of_four(re, re_lost) * inverse,
             mean_im = totals_of_four(im, im_lost) * inverse,
             cosine = {start[0], start[2], start[4], start[6]},
             sine = {start[1], start[3], start[5], start[7]};
        quad turned_re = mean_re * cosine - mean_im * sine,
             turned_im = mean_re * sine + mean_im * cosine;
        for (int k = 0; k < count; ++k) {
            b[2 * (p * count + k)] = (SCALAR)turned_re[k];
            b[2 * (p * count + k) + 1] = (SCALAR)turned_im[k];
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

#define TEXT "core/stages/trigonometric_of_count.h"
#include "core/stages/each_count.h"

static void circle_transmittance_stage(int count, const moit_wrapping_zone *zone, int pixels,
                                       const int32_t *offsets, const void *z, const void *own,
                                       const double *rules, const void *b0, double beta,
                                       bool absorbed, void *T) {
    switch (count) {
    case 2:
        circle_transmittance_of2(zone, pixels, offsets, z, own, rules, b0, beta, absorbed, T);
        break;
    case 3:
        circle_transmittance_of3(zone, pixels, offsets, z, own, rules, b0, beta, absorbed, T);
        break;
    case 4:
        circle_transmittance_of4(zone, pixels, offsets, z, own, rules, b0, beta, absorbed, T);
        break;
    }
}

#ifdef RULES /* double tables only */

#define TEXT "core/stages/trigonometric_rules_of_count.h"
#include "core/stages/each_count.h"

static void circle_rules_stage(int count, const moit_wrapping_zone *zone, bool floats, int pixels,
                               const double *b, double bias, const double *safe, double least,
                               double *rules) {
    (void)floats; /* single numbers do for all */
    (void)safe;   /* an even spread, whose moments are 0 */
    switch (count) {
    case 2: circle_rules_of2(zone, pixels, b, bias, least, rules); break;
    case 3: circle_rules_of3(zone, pixels, b, bias, least, rules); break;
    case 4: circle_rules_of4(zone, pixels, b, bias, least, rules); break;
    }
}

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
