/* Deep fragments: the two nearest fragments of a pixel, and of the others sums, of which a network
 * makes a colour (kernels/deep_fragments.h). */
#include "core/techniques/options.h"
#include "core/techniques/table.h"

#include <math.h>

enum { FEATURES = 5, FIRST = 32, SECOND = 16, COLUMNS = FEATURES + 2 };

static int deep_weights(const moit_technique *technique) {
    (void)technique;
    return FIRST * (FEATURES + 1) + SECOND * (FIRST + 1) + SECOND + 1;
}

/* What the network sees, and what a fragment counts with where it says 0, and how much more
 * where 1. */
static int deep_columns(const moit_technique *technique) {
    (void)technique;
    return COLUMNS;
}

static size_t deep_scratch(const moit_job *job, int fragments, int pixels) {
    return ((size_t)pixels * MOIT_DEEP_RAY + (size_t)fragments * COLUMNS) * job->scalar;
}

/* The pixels' rays, behind what those who ask for columns find first. */
static char *rays_of(const moit_job *job, const moit_tile *tile) {
    return tile->own + COLUMNS * ((size_t)tile->fragments + MOIT_PADDING) * job->scalar;
}

const char *moit_deep_rays(const moit_job *job, const moit_tile *tile) {
    return rays_of(job, tile);
}

static void gather(const moit_job *job, moit_tile *tile, const void *color) {
    moit_precision precision = job->fragments->precision;
    char *rays = rays_of(job, tile);
    job->stages->absorbance(tile->fragments, tile->alpha, job->max_alpha, tile->absorbance);
    moit_warp_tile(job, tile);
    job->stages->deep_capture(tile->pixels, tile->offsets, tile->depth, tile->alpha,
                              tile->absorbance, tile->z, color, tile->rank, rays);
    job->stages->deep_resolve(job->technique->neural.network, tile->pixels, rays);
    for (int p = 0; p < tile->pixels; ++p)
        tile->total[p] = moit_number(precision, rays, (int64_t)p * MOIT_DEEP_RAY + MOIT_DEEP_TOTAL);
}

static void deep_weigh(const moit_job *job, moit_tile *tile) {
    gather(job, tile, NULL);
    job->stages->deep_transmittance(tile->pixels, tile->offsets, tile->alpha, tile->absorbance,
                                    tile->z, tile->rank, rays_of(job, tile), tile->T);
}

/* The most that a pixel's colour can be in channel c: that of the brightest fragment, but for what
 * a half float rounds off. Sums of thousands of thin fragments are rounded by far more. */
static double most_of(const moit_job *job, const moit_tile *tile, int p, int c) {
    moit_precision precision = job->fragments->precision;
    double brightest = -__builtin_inf();
    for (int i = tile->offsets[p]; i < tile->offsets[p + 1]; ++i) {
        double color = moit_number(precision, tile->color, 3 * (int64_t)i + c);
        if (color > brightest) brightest = color; /* fmax would be a call */
    }
    double most = brightest * (1.0 - tile->total[p]);
    return most + fabs(most) * 0x1p-10;
}

static void resolve_pixels(const moit_job *job, moit_tile *tile) {
    moit_precision precision = job->fragments->precision;
    gather(job, tile, tile->color);
    for (int p = 0; p < tile->pixels; ++p) {
        int64_t color = (int64_t)p * MOIT_DEEP_RAY + MOIT_DEEP_COLOR;
        bool summed = tile->offsets[p + 1] - tile->offsets[p] > 2;
        for (int c = 0; c < 3; ++c) {
            double sum = moit_number(precision, rays_of(job, tile), color + c);
            tile->sums[4 * p + c] = summed ? fmin(sum, most_of(job, tile, p, c)) : sum;
        }
        tile->sums[4 * p + 3] = 1.0 - tile->total[p];
    }
}

static void fill_features(const moit_job *job, moit_tile *tile, int64_t stride, void *features) {
    gather(job, tile, NULL);
    job->stages->deep_features(tile->pixels, tile->offsets, tile->alpha, tile->absorbance, tile->z,
                               tile->rank, rays_of(job, tile), stride, features);
}

static bool deep_overflows(const moit_job *job, const moit_tile *tile, int p) {
    moit_precision precision = job->fragments->precision;
    int64_t first = (int64_t)p * MOIT_DEEP_RAY + MOIT_DEEP_NEAR;
    bool over = false;
    for (int k = 0; k < MOIT_DEEP_SUMS; ++k)
        over |= fabs(moit_number(precision, rays_of(job, tile), first + k)) >= MOIT_MOST_HALF;
    return over;
}

const moit_technique_row moit_dfa_row = {.name = "dfa",
                                         OPTIONS(WARP, MAX_ALPHA, NETWORK(neural.network)),
                                         .thick = MOIT_THICK_MIDDLE,
                                         .weigh = deep_weigh,
                                         .pull_back = moit_deep_pull_back,
                                         .overflows = deep_overflows,
                                         .resolve = resolve_pixels,
                                         .scratch = deep_scratch,
                                         .weights = deep_weights,
                                         .columns = deep_columns,
                                         .features = fill_features,
                                         .unit_range = {0.0, 1.0},
                                         .uses_warp = true,
                                         .arrival = MOIT_TIES_IN_ORDER,
                                         .ties = MOIT_TIES_EARLIER,
                                         .geometry_passes = 2};
