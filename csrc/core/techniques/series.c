/* Techniques that hold a function of depth as a short series: Fourier opacity maps and
 * transmittance function maps (kernels/fourier_opacity.h, kernels/transmittance_function.h). A
 * pixel's coefficients lie in the tile's own room. */
#include "core/techniques/options.h"
#include "core/techniques/table.h"

#include <math.h>

enum { HALF_BITS = 16 };

static size_t series_scratch(const moit_job *job, int fragments, int pixels) {
    (void)fragments;
    return (size_t)pixels * (size_t)job->technique->count * job->scalar;
}

/* ---- Fourier opacity maps -------------------------------------------------------------------- */

void moit_fourier_gather(const moit_job *job, moit_tile *tile) {
    moit_precision precision = job->fragments->precision;
    int count = job->technique->count;
    job->stages->absorbance(tile->fragments, tile->alpha, job->max_alpha, tile->absorbance);
    moit_warp_tile(job, tile);
    job->stages->fourier_sums(count, job->technique->series.bits == HALF_BITS, tile->pixels,
                              tile->offsets, tile->absorbance, tile->z, tile->own);
    moit_blocks_read(job, tile, 0);
    for (int p = 0; p < tile->pixels; ++p)
        tile->double_b0[p] = moit_number(precision, tile->own, (int64_t)p * count);
    job->precise->decay(tile->pixels, tile->double_b0, tile->total);
    moit_blocks_total(job, tile);
}

void moit_hold_halves(const moit_job *job, int blocks, const moit_state *state) {
    int numbers = moit_technique_rows[job->technique->kind]->blocks->numbers(job->technique);
    if (job->technique->series.bits == HALF_BITS)
        job->stages->half_absorbance(blocks * numbers, state->numbers, state->numbers);
}

static void gather_own(const moit_job *job, moit_tile *tile, int set) {
    (void)set;
    moit_fourier_gather(job, tile);
}

static moit_state own_state(const moit_job *job, const moit_tile *tile, int set) {
    (void)job;
    (void)set;
    return (moit_state){NULL, tile->own};
}

static int numbers_of(const moit_technique *technique) { return technique->count; }

static void total_weights(const moit_technique *technique, double *weights) {
    for (int k = 0; k < technique->count; ++k) weights[k] = k == 0;
}

const moit_block_family moit_fourier_blocks = {.gather = gather_own,
                                               .state = own_state,
                                               .numbers = numbers_of,
                                               .total = total_weights,
                                               .hold = moit_hold_halves};

static void fourier_weigh(const moit_job *job, moit_tile *tile) {
    moit_fourier_gather(job, tile);
    job->stages->fourier_transmittance(job->technique->count, tile->pixels, tile->offsets, tile->z,
                                       job->technique->series.exclude_self ? tile->absorbance
                                                                           : NULL,
                                       tile->own, tile->absorbed, tile->T);
}

static void fourier_curve(const moit_job *job, moit_tile *tile) {
    moit_fourier_gather(job, tile);
    moit_moments_warp_curve(job, tile);
    job->stages->fourier_transmittance(job->technique->count, tile->pixels, tile->curve_offsets,
                                       tile->curve_z, NULL, tile->own, false, tile->curve);
}

/* ---- Transmittance function maps ------------------------------------------------------------- */

/* The exact transmittance of each fragment is in tile->T meanwhile. */
static void gather_function(const moit_job *job, moit_tile *tile) {
    moit_sorted_weigh(job, tile);
    moit_warp_tile(job, tile);
    job->stages->function_sums(job->technique->count, job->technique->series.bits == HALF_BITS,
                               tile->pixels, tile->offsets, tile->alpha, tile->T, tile->z,
                               tile->own, tile->total);
}

/* What blocks have is what a map takes of 1, which adds up and is 0 for an empty ray: coefficients,
 * and last all of it. Behind the coefficients in the tile's own room. */
static int taken_of(const moit_technique *technique) { return technique->count + 1; }

static size_t function_map_scratch(const moit_job *job, int fragments, int pixels) {
    size_t coefficients = series_scratch(job, fragments, pixels);
    if (job->technique->resolution < 2) return coefficients;
    return coefficients + (size_t)pixels * (size_t)taken_of(job->technique) * job->scalar;
}

static moit_state taken_state(const moit_job *job, const moit_tile *tile, int set) {
    size_t row = (size_t)job->technique->count * job->scalar;
    (void)set;
    return (moit_state){NULL, tile->own + (size_t)tile->pixels * row};
}

static void gather_taken(const moit_job *job, moit_tile *tile, int set) {
    moit_precision precision = job->fragments->precision;
    int count = job->technique->count;
    gather_function(job, tile);
    void *taken = taken_state(job, tile, set).numbers;
    for (int64_t p = 0; p < tile->pixels; ++p) {
        for (int k = 0; k < count; ++k) {
            double c = moit_number(precision, tile->own, p * count + k);
            moit_set_number(precision, taken, p * (count + 1) + k, k ? c : 1.0 - c);
        }
        moit_set_number(precision, taken, p * (count + 1) + count, 1.0 - tile->total[p]);
    }
}

static void all_of_it(const moit_technique *technique, double *weights) {
    for (int k = 0; k < taken_of(technique); ++k) weights[k] = k == technique->count;
}

const moit_block_family moit_function_map_blocks = {.gather = gather_taken,
                                                    .state = taken_state,
                                                    .numbers = taken_of,
                                                    .total = all_of_it,
                                                    .hold = moit_hold_halves};

/* Each pixel's coefficients, its total, and the total of its map, which is returned. */
static const double *read_function(const moit_job *job, moit_tile *tile) {
    moit_precision precision = job->fragments->precision;
    int count = job->technique->count;
    if (!job->blocks) {
        gather_function(job, tile);
        return tile->total;
    }
    gather_taken(job, tile, 0);
    moit_blocks_read(job, tile, 0);
    const void *taken = taken_state(job, tile, 0).numbers;
    for (int64_t p = 0; p < tile->pixels; ++p) {
        for (int k = 0; k < count; ++k) {
            double c = moit_number(precision, taken, p * (count + 1) + k);
            moit_set_number(precision, tile->own, p * count + k, k ? c : 1.0 - c);
        }
        double all = moit_number(precision, taken, p * (count + 1) + count);
        tile->double_b0[p] = fmin(fmax(1.0 - all, 0.0), 1.0);
    }
    moit_blocks_total(job, tile);
    return tile->double_b0;
}

static void function_map_weigh(const moit_job *job, moit_tile *tile) {
    const double *total = read_function(job, tile);
    job->stages->function_transmittance(job->technique->count, tile->pixels, tile->offsets, tile->z,
                                        job->technique->series.exclude_self ? tile->alpha : NULL,
                                        job->max_alpha, tile->own, total, tile->T);
}

static void function_map_curve(const moit_job *job, moit_tile *tile) {
    const double *total = read_function(job, tile);
    moit_moments_warp_curve(job, tile);
    job->stages->function_transmittance(job->technique->count, tile->pixels, tile->curve_offsets,
                                        tile->curve_z, NULL, job->max_alpha, tile->own, total,
                                        tile->curve);
}

const moit_technique_row moit_fourier_row = {.name = "fourier",
                                             OPTIONS(SERIES),
                                             .thick = MOIT_THICK_WAVES,
                                             .usual_counts = (const int[]){7, 15, 0},
                                             .least_count = 3,
                                             .most_count = 31,
                                             .weigh = fourier_weigh,
                                             .pull_back = moit_fourier_pull_back,
                                             .curve = fourier_curve,
                                             .blocks = &moit_fourier_blocks,
                                             .scratch = series_scratch,
                                             .unit_range = {0.0, 1.0},
                                             .uses_warp = true,
                                             .reconstructs = true,
                                             .absorbs = moit_absorbs,
                                             .adds_texels = true,
                                             .geometry_passes = 2};

const moit_technique_row moit_transmittance_function_map_row = {
    .name = "transmittance-function-map",
    OPTIONS(SERIES),
    .usual_counts = (const int[]){8, 0},
    .least_count = 1,
    .most_count = 32,
    .weigh = function_map_weigh,
    .pull_back = moit_function_map_pull_back,
    .curve = function_map_curve,
    .blocks = &moit_function_map_blocks,
    .scratch = function_map_scratch,
    .unit_range = {0.0, 1.0},
    .uses_warp = true,
    .reconstructs = true,
    .takes_points = true,
    .geometry_passes = 2};
