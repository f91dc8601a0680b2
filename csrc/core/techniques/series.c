/* Techniques that hold a function of depth as a short series: Fourier opacity maps and
 * transmittance function maps (kernels/fourier_opacity.h, kernels/transmittance_function.h). A
 * pixel's coefficients lie in the tile's own room. */
#include "core/techniques/table.h"

enum { HALF_BITS = 16 };

size_t moit_series_scratch(const moit_job *job, int fragments, int pixels) {
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
    for (int p = 0; p < tile->pixels; ++p)
        tile->double_b0[p] = moit_number(precision, tile->own, (int64_t)p * count);
    job->precise->decay(tile->pixels, tile->double_b0, tile->total);
}

void moit_fourier_weigh(const moit_job *job, moit_tile *tile) {
    moit_fourier_gather(job, tile);
    job->stages->fourier_transmittance(job->technique->count, tile->pixels, tile->offsets, tile->z,
                                       job->technique->series.exclude_self ? tile->absorbance
                                                                           : NULL,
                                       tile->own, tile->absorbed, tile->T);
}

void moit_fourier_curve(const moit_job *job, moit_tile *tile) {
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

void moit_function_map_weigh(const moit_job *job, moit_tile *tile) {
    gather_function(job, tile);
    job->stages->function_transmittance(job->technique->count, tile->pixels, tile->offsets, tile->z,
                                        job->technique->series.exclude_self ? tile->alpha : NULL,
                                        job->max_alpha, tile->own, tile->total, tile->T);
}

void moit_function_map_curve(const moit_job *job, moit_tile *tile) {
    gather_function(job, tile);
    moit_moments_warp_curve(job, tile);
    job->stages->function_transmittance(job->technique->count, tile->pixels, tile->curve_offsets,
                                        tile->curve_z, NULL, job->max_alpha, tile->own, tile->total,
                                        tile->curve);
}
