/* Wavelet transparency on a tile: coefficients of each pixel, what its cells end with, light. */
#include "core/techniques/moments.h"
#include "core/techniques/table.h"

enum { WORD_BITS = 16 };

static int levels_of(const moit_job *job) {
    int levels = 0;
    while (1 << levels < job->technique->count) ++levels;
    return levels;
}

size_t moit_haar_scratch(const moit_job *job, int fragments, int pixels) {
    (void)fragments;
    return ((size_t)pixels << levels_of(job)) * job->scalar;
}

/* What each pixel's cells end with, into tile->own, and its total. */
static void read_tile(const moit_job *job, moit_tile *tile) {
    const moit_technique *technique = job->technique;
    int levels = levels_of(job), cells = 1 << levels;
    job->stages->absorbance(tile->fragments, tile->alpha, job->max_alpha, tile->absorbance);
    moit_warp_tile(job, tile);
    job->stages->haar_sums(levels, technique->series.density, technique->series.bits == WORD_BITS,
                           tile->pixels, tile->offsets, tile->absorbance, tile->z, tile->own);
    job->stages->haar_cells(levels, technique->series.density, tile->pixels, tile->own);
    for (int p = 0; p < tile->pixels; ++p)
        tile->double_b0[p] = moit_number(job->fragments->precision, tile->own, (p + 1) * cells - 1);
    job->precise->decay(tile->pixels, tile->double_b0, tile->total);
}

void moit_haar_weigh(const moit_job *job, moit_tile *tile) {
    read_tile(job, tile);
    job->stages->haar_transmittance(levels_of(job), job->technique->series.density, tile->pixels,
                                    tile->offsets, tile->z,
                                    job->technique->series.exclude_self ? tile->absorbance : NULL,
                                    tile->own, tile->absorbed, tile->T);
}

void moit_haar_curve(const moit_job *job, moit_tile *tile) {
    read_tile(job, tile);
    moit_moments_warp_curve(job, tile);
    job->stages->haar_transmittance(levels_of(job), job->technique->series.density, tile->pixels,
                                    tile->curve_offsets, tile->curve_z, NULL, tile->own, false,
                                    tile->curve);
}
