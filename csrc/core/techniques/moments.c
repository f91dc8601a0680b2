/* The two passes of moment techniques on a tile, for any family of moments. */
#include "core/techniques/moments.h"
#include "core/techniques/options.h"
#include "core/techniques/table.h"

#include <math.h>
#include <string.h>

void moit_warp_tile(const moit_job *job, moit_tile *tile) {
    if (!job->technique->range_per_pixel || moit_extents_are_words(job->technique)) {
        job->stages->warp(tile->fragments, tile->depth, &job->warp, tile->z);
        return;
    }
    for (int p = 0; p < tile->pixels; ++p) {
        size_t start = (size_t)tile->offsets[p] * job->scalar;
        moit_warp_map map = moit_pixel_warp(job, tile, p);
        job->stages->warp(tile->offsets[p + 1] - tile->offsets[p],
                          (const char *)tile->depth + start, &map, (char *)tile->z + start);
    }
}

void moit_moments_gather(const moit_job *job, moit_tile *tile) {
    bool scaled = moit_technique_rows[job->technique->kind]->scales_alpha;
    (scaled ? job->stages->scaled_absorbance : job->stages->absorbance)(
        tile->fragments, tile->alpha, job->max_alpha, tile->absorbance);
    moit_warp_tile(job, tile);
    if (moit_extents_are_words(job->technique))
        job->stages->own_extents(tile->pixels, tile->offsets, tile->z, tile->sums);
    if (moit_stores_words(job->technique)) moit_moments_gather_words(job, tile);
    else if (moit_stores_halves(job->technique)) moit_moments_gather_halves(job, tile);
    else
        job->stages->moments[moit_family_of(job->technique)->stages].sums(
            job->technique->count, &job->zone, tile->pixels, tile->offsets, tile->absorbance,
            tile->z, tile->b0, tile->b);
    moit_blocks_read(job, tile, 0);
}

/* ---- Blocks of pixels ------------------------------------------------------------------------ */

static void gather_own(const moit_job *job, moit_tile *tile, int set) {
    (void)set;
    moit_moments_gather(job, tile);
}

static moit_state own_state(const moit_job *job, const moit_tile *tile, int set) {
    (void)job;
    (void)set;
    return (moit_state){tile->b0, tile->b};
}

static int own_numbers(const moit_technique *technique) {
    return moit_family_of(technique)->numbers(technique->count);
}

const moit_block_family moit_moment_blocks = {
    .gather = gather_own, .state = own_state, .numbers = own_numbers};

/* ---- Reading --------------------------------------------------------------------------------- */

/* What rounding of the stored moments may do to a pivot and the bias does not outweigh. */
double moit_least_pivot(const moit_technique *technique, moit_precision precision, double bias) {
    const moit_moment_constants *known = moit_family_of(technique)->constants(technique);
    double unit = moit_stores_words(technique)    ? 0x1p-15
                  : moit_stores_halves(technique) ? 0x1p-11
                  : precision == MOIT_FLOAT64     ? 0x1p-50
                                                  : 0x1p-23;
    return fmax(unit * (1.0 - bias / known->covering_bias[precision]), 1e-15);
}

moit_moment_steps moit_technique_moments(const moit_technique *technique,
                                         moit_precision precision) {
    moit_wrapping_zone zone = moit_wrapping_zone_of(technique);
    moit_moment_steps steps = {.least =
                                   moit_least_pivot(technique, precision, technique->moments.bias),
                               .turns = zone.turns,
                               .edge = zone.edge,
                               .scale = zone.scale};
    memcpy(steps.safe, moit_family_of(technique)->constants(technique)->safe, sizeof steps.safe);
    memcpy(steps.middle, zone.middle, sizeof steps.middle);
    return steps;
}

/* Rows of `numbers` moments, as they are stored and in double. Inlined, with constants: rows are
 * short. */
typedef struct {
    moit_precision precision;
    int pixels;
    const void *b;
    double *double_b, *rules;
} moment_rows;

#define INLINED static inline __attribute__((always_inline))

/* The bits of numbers, the sign's aside 0 of zeros alone. */
typedef uint32_t __attribute__((may_alias)) bits32;
typedef uint64_t __attribute__((may_alias)) bits64;

/* Row p into `own`; whether all of it is zero. */
INLINED bool widened(const moment_rows *rows, const int numbers, int p, double *own) {
    if (rows->precision == MOIT_FLOAT64) {
        const double *b = (const double *)rows->b + p * numbers;
        bits64 any = 0;
        for (int k = 0; k < numbers; ++k) any |= ((const bits64 *)(const void *)b)[k];
        for (int k = 0; k < numbers; ++k) own[k] = b[k];
        return !(any << 1);
    }
    const float *b = (const float *)rows->b + p * numbers;
    bits32 any = 0;
    for (int k = 0; k < numbers; ++k) any |= ((const bits32 *)(const void *)b)[k];
    for (int k = 0; k < numbers; ++k) own[k] = (double)b[k];
    return !(any << 1);
}

/* Writes the rows that are not zero one after the other, and gives how many there are. */
INLINED int move_together(const moment_rows *rows, const int numbers) {
    int filled = 0;
    for (int p = 0; p < rows->pixels; ++p)
        filled += !widened(rows, numbers, p, rows->double_b + filled * numbers);
    return filled;
}

/* The other way, from the last to the first, with the rules of `size` numbers that they have now.
 */
INLINED void move_apart(const moment_rows *rows, const int numbers, const int size, int filled,
                        const double *of_zero) {
    for (int p = rows->pixels; filled < p;) { /* until all that are left are in their place */
        --p;
        bool zero = widened(rows, numbers, p, rows->double_b + p * numbers);
        const double *rule = zero ? of_zero : rows->rules + --filled * size;
        memcpy(rows->rules + p * size, rule, (size_t)size * sizeof *rule);
    }
}

#define EACH_NUMBERS(calls) \
    switch (numbers) { \
    case 4: calls(4); break; \
    case 6: calls(6); break; \
    case 8: calls(8); break; \
    default: calls(numbers); \
    }

static int rows_together(const moment_rows *rows, int numbers) {
    int filled = 0;
#define CALLS(n) filled = move_together(rows, n)
    EACH_NUMBERS(CALLS)
#undef CALLS
    return filled;
}

static void rows_apart(const moment_rows *rows, int numbers, int size, int filled,
                       const double *of_zero) {
#define CALLS(n) \
    if (size == n + 1) move_apart(rows, n, n + 1, filled, of_zero); /* power moments */ \
    else move_apart(rows, n, size, filled, of_zero)
    EACH_NUMBERS(CALLS)
#undef CALLS
}

/* Images have many empty pixels, and those share one rule: that of zero moments. So the others are
 * moved together first, their rules computed, and moved apart. */
void moit_moments_read(const moit_stages *precise, moit_precision precision,
                       const moit_technique *technique, const moit_wrapping_zone *zone, double bias,
                       int pixels, const void *b, double *double_b, double *rules) {
    const moit_moment_family *family = moit_family_of(technique);
    const moit_moment_stages *stages = &precise->moments[family->stages];
    const moit_moment_constants *known = family->constants(technique);
    int count = technique->count, numbers = family->numbers(count);
    double least = moit_least_pivot(technique, precision, bias);
    bool floats = precision == MOIT_FLOAT32;
    moment_rows rows = {precision, pixels, b, double_b, rules};
    int filled = rows_together(&rows, numbers);
    stages->rules(count, zone, floats, filled, double_b, bias, known->safe, least, rules);
    if (filled == pixels) return;

    double zero[MOIT_MOST_NUMBERS] = {0}, of_zero[MOIT_MOST_RULE];
    stages->rules(count, zone, floats, 1, zero, bias, known->safe, least, of_zero);
    rows_apart(&rows, numbers, family->rule_size(count), filled, of_zero);
}

void moit_moments_find_totals(const moit_job *job, moit_tile *tile) {
    moit_precision precision = job->fragments->precision;
    for (int p = 0; p < tile->pixels; ++p) tile->double_b0[p] = moit_number(precision, tile->b0, p);
    job->precise->decay(tile->pixels, tile->double_b0, tile->total);
    moit_blocks_total(job, tile);
}

/* The same for a tile, with its totals. */
void moit_moments_read_tile(const moit_job *job, moit_tile *tile) {
    moit_moments_read(job->precise, job->fragments->precision, job->technique, &job->zone,
                      job->bias, tile->pixels, tile->b, tile->double_b, tile->rules);
    moit_moments_find_totals(job, tile);
}

bool moit_moments_by_rows(const moit_stages *stages, const moit_stages *precise,
                          moit_precision precision, const moit_technique *technique, double bias,
                          bool absorbed, const moit_rays_asked *asked, float *rows, void *T) {
    const moit_moment_family *family = moit_family_of(technique);
    const moit_moment_stages *rules = &precise->moments[family->stages];
    if (precision != MOIT_FLOAT32 || !rules->rule_rows) return false;
    rules->rule_rows(technique->count, asked->pixels, asked->b, bias,
                     family->constants(technique)->safe,
                     moit_least_pivot(technique, precision, bias), rows);
    stages->moments[family->stages].transmittance_by_rows(
        technique->count, asked->pixels, asked->offsets, asked->z, asked->own, rows, asked->b0,
        technique->moments.overestimation, absorbed, T);
    return true;
}

void moit_moments_weigh(const moit_job *job, moit_tile *tile) {
    const moit_technique *technique = job->technique;
    const void *own = technique->moments.exclude_self ? tile->absorbance : NULL;
    moit_moments_gather(job, tile);
    moit_rays_asked asked = {tile->pixels, tile->offsets, tile->b0, tile->b, tile->z, own};
    if (moit_moments_by_rows(job->stages, job->precise, job->fragments->precision, technique,
                             job->bias, tile->absorbed, &asked, (float *)tile->rules, tile->T)) {
        moit_moments_find_totals(job, tile);
        return;
    }
    moit_moments_read_tile(job, tile);
    job->stages->moments[moit_family_of(technique)->stages].transmittance(
        technique->count, &job->zone, tile->pixels, tile->offsets, tile->z, own, tile->rules,
        tile->b0, technique->moments.overestimation, tile->absorbed, tile->T);
}

void moit_moments_warp_curve(const moit_job *job, moit_tile *tile) {
    /* A warp keeps z within its range. Where there is none, depths of any size are asked for, and
     * what is read beyond would be no number: what a curve is there is known (moit_known_range). */
    const double *range = moit_unit_range(job->technique);
    bool unwarped = job->technique->warp == MOIT_WARP_NONE;
    double least = unwarped ? range[0] : -DBL_MAX, most = unwarped ? range[1] : DBL_MAX;
    /* in the fragments' precision, in an array that is free until the curve is drawn */
    for (int64_t k = 0; k < job->depths; ++k)
        moit_set_number(job->fragments->precision, tile->curve, k,
                        fmin(fmax(job->depth[k], least), most));
    bool own = job->technique->range_per_pixel && !moit_extents_are_words(job->technique);
    for (int p = 0; p < tile->pixels; ++p) {
        char *z = (char *)tile->curve_z + (size_t)tile->curve_offsets[p] * job->scalar;
        if (p > 0 && !own) {
            memcpy(z, tile->curve_z, (size_t)job->depths * job->scalar);
            continue;
        }
        moit_warp_map map = own ? moit_pixel_warp(job, tile, p) : job->warp;
        job->stages->warp((int)job->depths, tile->curve, &map, z);
    }
}

void moit_moments_place_curve(const moit_job *job, moit_tile *tile) {
    moit_moments_warp_curve(job, tile);
    const double *extents = moit_extents(job->technique, tile);
    for (int p = 0; extents && p < tile->pixels; ++p)
        job->stages->within_extent((int)job->depths, extents + 2 * p,
                                   (char *)tile->curve_z
                                       + (size_t)tile->curve_offsets[p] * job->scalar);
}

static void moments_curve(const moit_job *job, moit_tile *tile) {
    moit_moments_gather(job, tile);
    moit_moments_read_tile(job, tile);
    moit_moments_place_curve(job, tile);
    job->stages->moments[moit_family_of(job->technique)->stages].transmittance(
        job->technique->count, &job->zone, tile->pixels, tile->curve_offsets, tile->curve_z, NULL,
        tile->rules, tile->b0, job->technique->moments.overestimation, false, tile->curve);
}

const moit_technique_row moit_power_row = {.name = "power",
                                           OPTIONS(STORED_MOMENTS, HALVES),
                                           .thick = MOIT_THICK_MOMENTS,
                                           .usual_counts = (const int[]){2, 4, 6, 8, 0},
                                           .least_count = 2,
                                           .most_count = 8,
                                           .fits = moit_power_fits,
                                           .weigh = moit_moments_weigh,
                                           .pull_back = moit_moments_pull_back,
                                           .weigh_again = moit_moments_weigh_again,
                                           .curve = moments_curve,
                                           .bounds = moit_power_bounds,
                                           .scratch = moit_moments_scratch,
                                           .moments = &moit_power_moments,
                                           .alone_in_few = 2,
                                           .blocks = &moit_moment_blocks,
                                           .unit_range = {-1.0, 1.0},
                                           .uses_warp = true,
                                           .reconstructs = true,
                                           .absorbs = moit_absorbs,
                                           .adds_texels = true,
                                           .geometry_passes = 2};

const moit_technique_row moit_trig_row = {.name = "trig",
                                          OPTIONS(STORED_MOMENTS, WRAPPING_ZONE),
                                          .thick = MOIT_THICK_WAVES,
                                          .usual_counts = (const int[]){2, 3, 4, 0},
                                          .least_count = 2,
                                          .most_count = 4,
                                          .fits = moit_wrapping_zone_fits,
                                          .weigh = moit_moments_weigh,
                                          .pull_back = moit_moments_pull_back,
                                          .curve = moments_curve,
                                          .scratch = moit_moments_scratch,
                                          .moments = &moit_trigonometric_moments,
                                          .blocks = &moit_moment_blocks,
                                          .unit_range = {-1.0, 1.0},
                                          .uses_warp = true,
                                          .reconstructs = true,
                                          .absorbs = moit_absorbs,
                                          .adds_texels = true,
                                          .geometry_passes = 2};
