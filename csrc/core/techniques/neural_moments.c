/* Neural moment transparency: four power moments, the count and the extent of a pixel's fragments,
 * and a network that reads transmittance off them (kernels/neural_moments.h). */
#include "core/techniques/options.h"
#include "core/techniques/table.h"

enum { MOMENTS = 4, FEATURES = 7, FIRST = 32, SECOND = 16 };

static int neural_weights(const moit_technique *technique) {
    (void)technique;
    return FIRST * (FEATURES + 1) + SECOND * (FIRST + 1) + SECOND + 1;
}

static int neural_columns(const moit_technique *technique) {
    (void)technique;
    return FEATURES;
}

/* Rays of pixels, depths as moments have them, and what the network sees of fragments. */
static size_t neural_scratch(const moit_job *job, int fragments, int pixels) {
    size_t rays = (size_t)pixels * MOIT_NEURAL_RAY;
    return (rays + (size_t)fragments * (1 + FEATURES)) * job->scalar;
}

typedef struct {
    char *rays, *z;
} held;

/* Behind what the network sees of fragments, which those who ask for it find first. */
static held held_of(const moit_job *job, const moit_tile *tile) {
    size_t row = ((size_t)tile->fragments + MOIT_PADDING) * job->scalar;
    char *z = tile->own + FEATURES * row;
    return (held){.z = z, .rays = z + row};
}

const char *moit_neural_rays(const moit_job *job, const moit_tile *tile) {
    return held_of(job, tile).rays;
}

static void gather(const moit_job *job, moit_tile *tile) {
    moit_precision precision = job->fragments->precision;
    moit_wrapping_zone none = {0};
    held to = held_of(job, tile);
    job->stages->absorbance(tile->fragments, tile->alpha, job->max_alpha, tile->absorbance);
    moit_warp_tile(job, tile);
    job->stages->neural_extents(job->technique->neural.range_in_words, tile->pixels, tile->offsets,
                                tile->z, to.rays, to.z);
    job->stages->moments[MOIT_POWER].sums(MOMENTS, &none, tile->pixels, tile->offsets,
                                          tile->absorbance, to.z, tile->b0, tile->b);
    for (int p = 0; p < tile->pixels; ++p) {
        int64_t ray = (int64_t)p * MOIT_NEURAL_RAY;
        tile->double_b0[p] = moit_number(precision, tile->b0, p);
        moit_set_number(precision, to.rays, ray + 2, tile->offsets[p + 1] - tile->offsets[p]);
        moit_set_number(precision, to.rays, ray + 3, tile->double_b0[p]);
    }
    job->precise->decay(tile->pixels, tile->double_b0, tile->total);
}

static void neural_weigh(const moit_job *job, moit_tile *tile) {
    gather(job, tile);
    job->stages->neural_transmittance(job->technique->neural.range_in_words,
                                      job->technique->neural.network, tile->pixels, tile->offsets,
                                      tile->z, held_of(job, tile).rays, tile->b, tile->T);
}

static void neural_curve(const moit_job *job, moit_tile *tile) {
    gather(job, tile);
    moit_moments_warp_curve(job, tile);
    job->stages->neural_transmittance(
        job->technique->neural.range_in_words, job->technique->neural.network, tile->pixels,
        tile->curve_offsets, tile->curve_z, held_of(job, tile).rays, tile->b, tile->curve);
}

static void fill_features(const moit_job *job, moit_tile *tile, int64_t stride, void *features) {
    gather(job, tile);
    job->stages->neural_features(job->technique->neural.range_in_words, tile->pixels, tile->offsets,
                                 tile->z, held_of(job, tile).rays, tile->b, stride, features);
}

const moit_technique_row moit_neural_row = {.name = "neural",
                                            OPTIONS(WARP, MAX_ALPHA, NORMALIZE,
                                                    TRUTH("range_in_words", neural.range_in_words),
                                                    NETWORK(neural.network)),
                                            .weigh = neural_weigh,
                                            .pull_back = moit_neural_pull_back,
                                            .curve = neural_curve,
                                            .scratch = neural_scratch,
                                            .weights = neural_weights,
                                            .columns = neural_columns,
                                            .features = fill_features,
                                            .unit_range = {-1.0, 1.0},
                                            .uses_warp = true,
                                            .reconstructs = true,
                                            .geometry_passes = 2};
