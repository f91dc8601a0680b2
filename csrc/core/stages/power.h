/* Stages of power moments: sums per pixel, Gauss rules with lanes over pixels, transmittance with
 * lanes over the fragments of one pixel. */

#include "kernels/kept_sums.h"

#define NAMED(name) JOIN(name, NODES)

/* Without `lost`, and of floats, a plain sum. */
FN void add_quad(quad *sum, quad *lost, quad x) {
    if (!DOUBLE || !lost) {
        *sum += x;
        return;
    }
    kept_sum s = kept_with((kept_sum){*sum, *lost}, x);
    *sum = s.high;
    *lost = s.low;
}

FN quad lane_of_four(const quad *x, const int lane) {
    return (quad){x[0][lane], x[1][lane], x[2][lane], x[3][lane]};
}

/* sums_of_four with what they lost. */
FN quad totals_of_four(const quad *sum, const quad *lost) {
    if (!DOUBLE || !lost) return sums_of_four(sum);
    kept_sum of[4];
    for (int k = 0; k < 4; ++k) of[k] = (kept_sum){lane_of_four(sum, k), lane_of_four(lost, k)};
    return total_kept(of[0], of[1], of[2], of[3]);
}

FN double total_of(quad sum, const quad *lost) {
    if (!DOUBLE || !lost) return (sum[0] + sum[1]) + (sum[2] + sum[3]);
    kept_sum of[4];
    for (int k = 0; k < 4; ++k) of[k] = (kept_sum){QUAD(sum[k]), QUAD((*lost)[k])};
    return total_kept(of[0], of[1], of[2], of[3])[0];
}

/* What makes means of sums; of no absorbance 0. So little that its inverse is infinite counts as
 * the least that has one: means that are too small by that are still some distribution's. */
FN double inverse_of_sum(double total) { return 1.0 / (total > 0x1p-1022 ? total : 0x1p-1022); }

/* Four fragments more, of which `left` are there; `full`: at least four. */
FN void add_powers(const int count, const SCALAR *a, const SCALAR *z, int left, bool full,
                   quad *sum, quad *lost) {
    quad power = load_quad(a), x = load_quad(z);
    if (!full) { /* what memory held beyond the end may be NaN, times 0 too */
        quad_truth there = (quad_truth){0, 1, 2, 3} < left;
        power = (quad)((quad_truth)power & there);
        x = (quad)((quad_truth)x & there);
    }
    add_quad(sum, lost, power);
    for (int k = 1; k <= count; ++k) add_quad(sum + k, lost ? lost + k : NULL, power = power * x);
}

FN void power_sums_of(const int count, const bool keeps, int pixels, const int32_t *offsets,
                      const SCALAR *a, const SCALAR *z, SCALAR *b0, SCALAR *b) {
    const bool few = offsets[pixels] < 8 * pixels;
    for (int p = 0; p < pixels; ++p) {
        quad sum[9] = {{0}}, rest[9] = {{0}}, *lost = keeps ? rest : NULL;
        int i = offsets[p], end = offsets[p + 1];
        if (few) { /* with no branch that depends on how many: processors guess it wrong */
            for (int last = i + 8; i < last; i += 4)
                add_powers(count, a + i, z + i, end - i, false, sum, lost);
        }
        for (; i < end; i += 4) add_powers(count, a + i, z + i, end - i, end - i >= 4, sum, lost);
        double total = total_of(sum[0], lost), inverse = inverse_of_sum(total);
        b0[p] = (SCALAR)total;
        for (int k = 0; k < count; k += 4) {
            four_numbers mean = __builtin_convertvector(
                totals_of_four(sum + 1 + k, lost ? lost + 1 + k : NULL) * inverse, four_numbers);
            if (count - k >= 4) memcpy(b + p * count + k, &mean, sizeof mean);
            else /* a part of a vector that is copied goes by memory, and waits for it */
                for (int j = 0; j < count - k; ++j) b[p * count + k + j] = mean[j];
        }
    }
}

static void power_sums_stage(int count, const moit_wrapping_zone *zone, int pixels,
                             const int32_t *offsets, const void *a, const void *z, void *b0,
                             void *b) {
    (void)zone;
    switch (count) {
    case 2: power_sums_of(2, DOUBLE, pixels, offsets, a, z, b0, b); break;
    case 4: power_sums_of(4, DOUBLE, pixels, offsets, a, z, b0, b); break;
    case 6: power_sums_of(6, DOUBLE, pixels, offsets, a, z, b0, b); break;
    case 8: power_sums_of(8, DOUBLE, pixels, offsets, a, z, b0, b); break;
    }
}

#define TEXT "core/stages/power_of_count.h"
#include "core/stages/each_power_count.h"

static void power_transmittance_stage(int count, const moit_wrapping_zone *zone, int pixels,
                                      const int32_t *offsets, const void *z, const void *own,
                                      const double *rules, const void *b0, double beta,
                                      bool absorbed, void *T) {
    (void)zone;
    switch (count) {
    case 2: transmittance_of1(pixels, offsets, z, own, rules, b0, beta, absorbed, T); break;
    case 4: transmittance_of2(pixels, offsets, z, own, rules, b0, beta, absorbed, T); break;
    case 6: transmittance_of3(pixels, offsets, z, own, rules, b0, beta, absorbed, T); break;
    case 8: transmittance_of4(pixels, offsets, z, own, rules, b0, beta, absorbed, T); break;
    }
}

#ifndef RULES /* float tables only */
static void power_transmittance_by_rows_stage(int count, int pixels, const int32_t *offsets,
                                              const float *z, const float *own, const float *rows,
                                              const float *b0, double beta, bool absorbed,
                                              float *T) {
    switch (count) {
    case 2: transmittance_by_rows_of1(pixels, offsets, z, own, rows, b0, beta, absorbed, T); break;
    case 4: transmittance_by_rows_of2(pixels, offsets, z, own, rows, b0, beta, absorbed, T); break;
    case 6: transmittance_by_rows_of3(pixels, offsets, z, own, rows, b0, beta, absorbed, T); break;
    case 8: transmittance_by_rows_of4(pixels, offsets, z, own, rows, b0, beta, absorbed, T); break;
    }
}
#define POWER_TRANSMITTANCE_BY_ROWS_STAGE power_transmittance_by_rows_stage
#endif

#ifdef RULES /* double tables only */
#include "kernels/pairs.h"

static void power_plain_sums_stage(int pixels, const int32_t *offsets, const void *a, const void *z,
                                   void *b0, void *b) {
    power_sums_of(4, false, pixels, offsets, a, z, b0, b);
}

/* Number k of `pixels` rows of `count` side by side in columns[k]; lanes beyond repeat the first
 * row. */
FN void columns_of(const int count, int pixels, const double *rows, SCALAR (*columns)[LANES]) {
    if (pixels >= LANES) { /* no lane depends on how many there are: vectors are shuffled */
        for (int k = 0; k < count; ++k)
            for (int lane = 0; lane < LANES; ++lane)
                columns[k][lane] = (SCALAR)rows[lane * count + k];
        return;
    }
    for (int k = 0; k < count; ++k)
        for (int lane = 0; lane < LANES; ++lane)
            columns[k][lane] = (SCALAR)rows[(lane < pixels ? lane : 0) * count + k];
}

/* The same of floats, in `columns` of lanes. Rows of four are turned as wide as vectors are. */
FN void columns_of_floats(const int count, int pixels, const float *rows, real *columns) {
#if LANES == 8
    typedef float sixteen __attribute__((vector_size(64)));
    typedef float eight __attribute__((vector_size(32)));
    if (count == 4 && pixels >= LANES) {
        sixteen a, b;
        memcpy(&a, rows, sizeof a);
        memcpy(&b, rows + 16, sizeof b);
        sixteen front = __builtin_shufflevector(a, b, 0, 4, 8, 12, 16, 20, 24, 28, 1, 5, 9, 13, 17,
                                                21, 25, 29),
                back = __builtin_shufflevector(a, b, 2, 6, 10, 14, 18, 22, 26, 30, 3, 7, 11, 15, 19,
                                               23, 27, 31);
        eight of[4] = {__builtin_shufflevector(front, front, 0, 1, 2, 3, 4, 5, 6, 7),
                       __builtin_shufflevector(front, front, 8, 9, 10, 11, 12, 13, 14, 15),
                       __builtin_shufflevector(back, back, 0, 1, 2, 3, 4, 5, 6, 7),
                       __builtin_shufflevector(back, back, 8, 9, 10, 11, 12, 13, 14, 15)};
        for (int k = 0; k < 4; ++k) columns[k] = __builtin_convertvector(of[k], real);
        return;
    }
#endif
    SCALAR column[LANES];
    if (count == 1 && pixels >= LANES) {
        float_lanes whole;
        memcpy(&whole, rows, sizeof whole);
        columns[0] = __builtin_convertvector(whole, real);
        return;
    }
    for (int k = 0; k < count; ++k) {
        for (int lane = 0; lane < LANES; ++lane)
            column[lane] = (SCALAR)rows[(lane < pixels ? lane : 0) * count + k];
        columns[k] = load(column);
    }
}

FN void put_floats(float *to, real x) {
    float_lanes floats = __builtin_convertvector(x, float_lanes);
    memcpy(to, &floats, sizeof floats);
}

/* So small that a pivot above it is positive, and one at it leaves finite quotients. */
#define NO_PIVOT 1e-150

#define TEXT "core/stages/power_rules_of_count.h"
#include "core/stages/each_power_count.h"

static void power_rules_stage(int count, const moit_wrapping_zone *zone, bool floats, int pixels,
                              const double *b, double bias, const double *safe, double least,
                              double *rules) {
    (void)zone;
    switch (count) {
    case 2: rules_of1(floats, pixels, b, bias, safe, least, rules); break;
    case 4: rules_of2(floats, pixels, b, bias, safe, least, rules); break;
    case 6: rules_of3(floats, pixels, b, bias, safe, least, rules); break;
    case 8: rules_of4(floats, pixels, b, bias, safe, least, rules); break;
    }
}

static void power_rule_rows_stage(int count, int pixels, const float *b, double bias,
                                  const double *safe, double least, float *rows) {
    switch (count) {
    case 2: rule_rows_of1(pixels, b, bias, safe, least, rows); break;
    case 4: rule_rows_of2(pixels, b, bias, safe, least, rows); break;
    case 6: rule_rows_of3(pixels, b, bias, safe, least, rows); break;
    case 8: rule_rows_of4(pixels, b, bias, safe, least, rows); break;
    }
}

static void power_pivots_stage(int count, const moit_wrapping_zone *zone, int pixels,
                               const double *b, const double *bias, const double *safe,
                               double *pivot) {
    (void)zone;
    switch (count) {
    case 2: pivots_of1(pixels, b, bias, safe, pivot); break;
    case 4: pivots_of2(pixels, b, bias, safe, pivot); break;
    case 6: pivots_of3(pixels, b, bias, safe, pivot); break;
    case 8: pivots_of4(pixels, b, bias, safe, pivot); break;
    }
}

static void power_bounds_stage(int count, int pixels, const int32_t *offsets, const double *z,
                               const double *b, const double *rules, double blur,
                               const double *slack, double *at_least, double *at_most) {
    switch (count) {
    case 2: bounds_of1(pixels, offsets, z, b, rules, blur, slack, at_least, at_most); break;
    case 4: bounds_of2(pixels, offsets, z, b, rules, blur, slack, at_least, at_most); break;
    case 6: bounds_of3(pixels, offsets, z, b, rules, blur, slack, at_least, at_most); break;
    case 8: bounds_of4(pixels, offsets, z, b, rules, blur, slack, at_least, at_most); break;
    }
}
#define POWER_PLAIN_SUMS_STAGE power_plain_sums_stage
#define POWER_RULES_STAGE power_rules_stage
#define POWER_RULE_ROWS_STAGE power_rule_rows_stage
#define POWER_PIVOTS_STAGE power_pivots_stage
#define POWER_TRANSMITTANCE_BY_ROWS_STAGE NULL
#define POWER_BOUNDS_STAGE power_bounds_stage
#else
#define POWER_PLAIN_SUMS_STAGE NULL
#define POWER_RULES_STAGE NULL
#define POWER_RULE_ROWS_STAGE NULL
#define POWER_PIVOTS_STAGE NULL
#define POWER_BOUNDS_STAGE NULL
#endif
