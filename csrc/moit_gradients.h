/* Derivatives of answers, backwards: from how a loss changes with what a question of moit.h gives
 * to how it changes with the numbers of fragments. */
#ifndef MOIT_GRADIENTS_H
#define MOIT_GRADIENTS_H

#include "moit.h"
#include "moit_geometry.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Where derivatives go, of the fragments' precision; those that are not asked for are NULL. All of
 * an array is written: 0 where an answer does not hang on a number. */
typedef struct moit_gradients {
    void *depth, *alpha; /* (N) */
    void *color;         /* (N, 3) */
    void *transmission;  /* (N, 3); needs the fragments' */
    double *background;  /* (pixels, 3), or (3) by one that all pixels have */
    double *network;     /* (moit_network_weights) by the technique's network */
} moit_gradients;

/* Whether a kind has derivatives; and why a technique of such a kind has none, NULL: it has. */
bool moit_has_gradient(moit_kind kind);
const char *moit_gradient_refusal(const moit_technique *technique);

/* The derivatives of sum(seed answer) for the answers of moit_composite (pixels, 4),
 * moit_transmittance (N) and moit_total_transmittance (pixels, or with transmission (pixels, 3)).
 * Seeds have the fragments' precision, all between is double. The technique has derivatives. What
 * is opaque stays so, so its alpha gets 0 where it is culled. Bits are the same for any number of
 * threads and any instruction set. */
moit_status moit_composite_pullback(const moit_fragments *fragments,
                                    const moit_technique *technique, bool cull_opaque,
                                    const double *background, bool background_per_pixel,
                                    const void *seed, const moit_gradients *out,
                                    const moit_run *run);
moit_status moit_transmittance_pullback(const moit_fragments *fragments,
                                        const moit_technique *technique, bool cull_opaque,
                                        const void *seed, const moit_gradients *out,
                                        const moit_run *run);
/* Of moit_curve (pixels, depths), of a technique that has a curve, at one depth at least. */
moit_status moit_curve_pullback(const moit_fragments *fragments, const moit_technique *technique,
                                bool cull_opaque, int64_t depths, const double *depth,
                                const void *seed, const moit_gradients *out, const moit_run *run);
moit_status moit_total_transmittance_pullback(const moit_fragments *fragments,
                                              const moit_technique *technique, bool cull_opaque,
                                              const void *seed, const moit_gradients *out,
                                              const moit_run *run);

/* Moments by themselves, as moit_moments_transmittance and moit_moments_bounds are asked; alpha is
 * of the latter, or NULL. */
typedef struct moit_moment_arrays {
    moit_precision precision;
    int64_t pixels, depths;
    const void *b0, *b, *z, *alpha; /* (P), (P, numbers), (P, K), (P, K) */
} moit_moment_arrays;

/* Of these shapes and that precision; NULL: not asked for. */
typedef struct moit_moment_gradients {
    void *b0, *b, *z, *alpha;
} moit_moment_gradients;

/* Why moments by themselves have none, NULL: they have. */
const char *moit_moments_gradient_refusal(const moit_technique *technique);

/* Of sum(seed T), or with `absorbance` of sum(seed -ln T); and of sum(by_lower lower + by_upper
 * upper) of power moments, whose allowance for rounding stays as it is. */
moit_status moit_moments_pullback(const moit_technique *technique, const moit_moment_arrays *given,
                                  bool absorbance, const void *seed,
                                  const moit_moment_gradients *out, const moit_run *run);
moit_status moit_moments_bounds_pullback(const moit_technique *technique,
                                         const moit_moment_arrays *given, const void *by_lower,
                                         const void *by_upper, const moit_moment_gradients *out,
                                         const moit_run *run);

/* Sums of mass times powers 0 to `count` of where it lies, a row a power, and a place for each ray:
 * what they bound of the mass in front of that, as moit_moments_absorbance, and unless NULL its
 * slopes by these rows and by z. */
typedef struct moit_power_rows {
    moit_precision precision;
    int64_t rays;
    const void *rows, *z; /* (1 + count, rays), (rays) */
    void *bound, *slopes, *by_z;
    double most; /* 1, and what rounding may add to the sizes of means and of z */
} moit_power_rows;

/* Of power moments of floats, all of a pixel's by themselves. all_fit: whether all numbers are
 * finite, no mass is negative and no mean and no z is larger than `most`: what is answered of
 * others is nothing. */
moit_status moit_bound_of_rows(const moit_technique *technique, const moit_power_rows *rows,
                               bool *all_fit, const moit_run *run);

/* ---- Splats ---------------------------------------------------------------------------------- */

/* Derivatives by what a moit_screen_splat has of the same names; along[0] and what is not here stay
 * as they are. */
typedef struct moit_splat_sums {
    double x, y, square[3], along[6], depth[3], opacity, color[3];
} moit_splat_sums;

/* Of the splats' numbers, as moit_splats has them; rotation along the sphere of quaternions of
 * length 1. All is written: 0 of what is not seen. */
typedef struct moit_splat_gradients {
    float *mean, *scale, *rotation, *opacity, *harmonics;
} moit_splat_gradients;

/* The derivatives of sum(depth depth' + alpha alpha' + color color') for the fragments of
 * moit_draw_splats, with given ones: adds those of rows [top, bottom) to sums (count). Which
 * fragments there are stays. Where alpha is at its most it stays there. The bits are the same for
 * any number of threads, and if rows are split where tiles are, for any split. */
moit_status moit_pull_splat_fragments(const moit_splat_raster *raster, int top, int bottom,
                                      const float *depth, const float *alpha, const float *color,
                                      moit_splat_sums *sums, const moit_run *run);

/* From these to the splats that the raster was begun with. At a limit (a slope beyond 1.3 halves of
 * the picture, a colour that is not below 0, an axis that is as thin as it may be) what is held
 * there stays. No number is infinite or none. */
moit_status moit_pull_splat_projection(const moit_splat_raster *raster, const moit_splats *splats,
                                       const moit_splat_sums *sums, const moit_splat_gradients *out,
                                       const moit_run *run);

#ifdef __cplusplus
}
#endif

#endif
