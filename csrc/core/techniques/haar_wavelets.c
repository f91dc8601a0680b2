/* Wavelet transparency on a tile: coefficients of each pixel, what its cells end with, light. */
#include "core/techniques/moments.h"
#include "core/techniques/options.h"
#include "core/techniques/table.h"

enum { WORD_BITS = 16 };

static int levels_of(const moit_job *job) {
    int levels = 0;
    while (1 << levels < job->technique->count) ++levels;
    return levels;
}

static size_t haar_scratch(const moit_job *job, int fragments, int pixels) {
    (void)fragments;
    return ((size_t)pixels << levels_of(job)) * job->scalar;
}

/* Each pixel's coefficients, into tile->own. */
static void gather(const moit_job *job, moit_tile *tile, int set) {
    const moit_technique *technique = job->technique;
    (void)set;
    job->stages->absorbance(tile->fragments, tile->alpha, job->max_alpha, tile->absorbance);
    moit_warp_tile(job, tile);
    job->stages->haar_sums(levels_of(job), technique->series.density,
                           technique->series.bits == WORD_BITS, tile->pixels, tile->offsets,
                           tile->absorbance, tile->z, tile->own);
}

static moit_state state_of(const moit_job *job, const moit_tile *tile, int set) {
    (void)job;
    (void)set;
    return (moit_state){NULL, tile->own};
}

static int numbers_of(const moit_technique *technique) { return technique->count; }

/* The last cell's mean, as kernels/haar_wavelet.h has it; of densities the scaling coefficient is
 * the total. */
static void total_weights(const moit_technique *technique, double *weights) {
    for (int k = 0; k < technique->count; ++k) weights[k] = k == 0;
    double height = 1.0;
    for (int wavelets = 1; !technique->series.density && wavelets < technique->count;
         wavelets *= 2, height *= 1.4142135623730951)
        weights[2 * wavelets - 1] = height;
}

const moit_block_family moit_haar_blocks = {.gather = gather,
                                            .state = state_of,
                                            .numbers = numbers_of,
                                            .total = total_weights,
                                            .hold = moit_hold_halves};

/* What each pixel's cells end with, into tile->own, and its total. */
static void read_tile(const moit_job *job, moit_tile *tile) {
    const moit_technique *technique = job->technique;
    int levels = levels_of(job), cells = 1 << levels;
    gather(job, tile, 0);
    moit_blocks_read(job, tile, 0);
    job->stages->haar_cells(levels, technique->series.density, tile->pixels, tile->own);
    for (int p = 0; p < tile->pixels; ++p)
        tile->double_b0[p] = moit_number(job->fragments->precision, tile->own, (p + 1) * cells - 1);
    job->precise->decay(tile->pixels, tile->double_b0, tile->total);
    moit_blocks_total(job, tile);
}

static void haar_weigh(const moit_job *job, moit_tile *tile) {
    read_tile(job, tile);
    job->stages->haar_transmittance(levels_of(job), job->technique->series.density, tile->pixels,
                                    tile->offsets, tile->z,
                                    job->technique->series.exclude_self ? tile->absorbance : NULL,
                                    tile->own, tile->absorbed, tile->T);
}

static void haar_curve(const moit_job *job, moit_tile *tile) {
    read_tile(job, tile);
    moit_moments_warp_curve(job, tile);
    job->stages->haar_transmittance(levels_of(job), job->technique->series.density, tile->pixels,
                                    tile->curve_offsets, tile->curve_z, NULL, tile->own, false,
                                    tile->curve);
}

const moit_technique_row moit_wavelet_row = {.name = "wavelet",
                                             OPTIONS(SERIES, TRUTH("density", series.density)),
                                             .usual_counts = (const int[]){4, 8, 16, 32, 0},
                                             .least_count = 4,
                                             .most_count = 32,
                                             .weigh = haar_weigh,
                                             .pull_back = moit_haar_pull_back,
                                             .curve = haar_curve,
                                             .blocks = &moit_haar_blocks,
                                             .scratch = haar_scratch,
                                             .unit_range = {0.0, 1.0},
                                             .uses_warp = true,
                                             .reconstructs = true,
                                             .absorbs = moit_absorbs,
                                             .takes_points = true,
                                             .geometry_passes = 2};
