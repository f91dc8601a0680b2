/* Bounded neural transmittance: power moments, between whose bounds a network decides. */
#include "core/techniques/options.h"
#include "core/techniques/table.h"

/* Networks of two layers of 8: 4 inputs of a fragment, then count of its pixel. */
enum { HIDDEN = 8, OF_FRAGMENT = 4 };

static int inputs_of(const moit_technique *technique) { return OF_FRAGMENT + technique->count; }

int moit_bounded_weights(const moit_technique *technique) {
    return HIDDEN * (inputs_of(technique) + 1) + HIDDEN * (HIDDEN + 1) + HIDDEN + 1;
}

/* What the network sees, and the bounds between which it decides. */
int moit_bounded_columns(const moit_technique *technique) { return inputs_of(technique) + 2; }

static size_t bounded_scratch(const moit_job *job, int fragments, int pixels) {
    (void)pixels;
    return (size_t)fragments * (size_t)moit_bounded_columns(job->technique) * job->scalar;
}

/* A pixel's outline comes behind the rules of all. */
static double *outlines_behind(double *rules, int count, int pixels) {
    return rules + (int64_t)pixels * MOIT_RULE_SIZE(count);
}

/* For moments by themselves: a block's totals in double come behind its outlines. */
void moit_bounded_transmittance(const moit_stages *stages, const moit_stages *precise,
                                moit_precision precision, const moit_technique *technique,
                                double bias, int pixels, const int32_t *offsets, const void *b0,
                                const void *b, const void *z, double *double_b, double *rules,
                                void *T) {
    int count = technique->count;
    double *outlines = outlines_behind(rules, count, pixels);
    double *totals = outlines + (int64_t)pixels * MOIT_OUTLINE_SIZE;
    moit_moments_read(precise, precision, technique, NULL, bias, pixels, b, double_b, rules);
    for (int p = 0; p < pixels; ++p) totals[p] = moit_number(precision, b0, p);
    precise->bounded_outlines(count, pixels, rules, totals, NULL, technique->bounded.network,
                              outlines);
    stages->bounded_transmittance(count, pixels, offsets, z, NULL, rules, outlines, b0,
                                  technique->bounded.network, false, T);
}

const double *moit_bounded_outlines(const moit_job *job, const moit_tile *tile) {
    return outlines_behind(tile->rules, job->technique->count, tile->pixels);
}

/* Where in the image's range pixels have theirs, which depth is in: deviations are known to the
 * network in the image's. NULL: depth is in the image's range, or in extents that are kept. */
static const double *ends_of_pixels(const moit_job *job, moit_tile *tile) {
    if (!job->technique->range_per_pixel || job->technique->warp == MOIT_WARP_NONE) return NULL;
    double *ends = tile->sums, *given = ends + 2 * tile->pixels; /* which blending fills later */
    for (int p = 0; p < tile->pixels; ++p) {
        bool any = tile->offsets[p] < tile->offsets[p + 1];
        moit_warp_map own = any ? moit_pixel_warp(job, tile, p) : job->warp;
        given[2 * p] = own.near;
        given[2 * p + 1] = own.far;
    }
    job->precise->warp(2 * tile->pixels, given, &job->warp, ends);
    return ends;
}

static const double *extents_of(const moit_job *job, moit_tile *tile) {
    const double *extents = moit_extents(job->technique, tile);
    return extents ? extents : ends_of_pixels(job, tile);
}

double *moit_bounded_read(const moit_job *job, moit_tile *tile) {
    const moit_technique *technique = job->technique;
    double *outlines = outlines_behind(tile->rules, technique->count, tile->pixels);
    job->precise->bounded_outlines(technique->count, tile->pixels, tile->rules, tile->double_b0,
                                   extents_of(job, tile), technique->bounded.network, outlines);
    return outlines;
}

static double *read_outlines(const moit_job *job, moit_tile *tile) {
    moit_moments_gather(job, tile);
    moit_moments_read_tile(job, tile);
    return moit_bounded_read(job, tile);
}

/* Floats go by rows, to the same bits. */
static void weigh_by_rows(const moit_job *job, moit_tile *tile) {
    const moit_technique *technique = job->technique;
    const float *network = technique->bounded.network;
    float *rows = (float *)tile->rules;
    moit_moments_gather(job, tile);
    job->precise->bounded_rows(technique->count, tile->pixels, tile->b, tile->b0, job->bias,
                               moit_family_of(technique)->constants(technique)->safe,
                               moit_least_pivot(technique, MOIT_FLOAT32, job->bias),
                               extents_of(job, tile), network, rows);
    moit_moments_find_totals(job, tile);
    job->stages->bounded_by_rows(technique->count, tile->pixels, tile->offsets, tile->z,
                                 tile->absorbance, rows, tile->b0, network, tile->absorbed,
                                 tile->T);
}

void moit_bounded_weigh(const moit_job *job, moit_tile *tile) {
    if (job->fragments->precision == MOIT_FLOAT32) {
        weigh_by_rows(job, tile);
        return;
    }
    const double *outlines = read_outlines(job, tile);
    job->stages->bounded_transmittance(job->technique->count, tile->pixels, tile->offsets, tile->z,
                                       tile->absorbance, tile->rules, outlines, tile->b0,
                                       job->technique->bounded.network, tile->absorbed, tile->T);
}

static void bounded_curve(const moit_job *job, moit_tile *tile) {
    const double *outlines = read_outlines(job, tile);
    moit_moments_place_curve(job, tile);
    job->stages->bounded_transmittance(job->technique->count, tile->pixels, tile->curve_offsets,
                                       tile->curve_z, NULL, tile->rules, outlines, tile->b0,
                                       job->technique->bounded.network, false, tile->curve);
}

/* What power moments prove; where their rounding has moved what is answered out of that, as far as
 * it is. */
static void bounded_bounds(const moit_job *job, moit_tile *tile, double *lower, double *upper) {
    moit_precision precision = job->fragments->precision;
    (job->depths ? bounded_curve : moit_bounded_weigh)(job, tile);
    moit_power_bounds(job, tile, lower, upper);
    const int32_t *offsets = job->depths ? tile->curve_offsets : tile->offsets;
    for (int i = 0; i < offsets[tile->pixels]; ++i) {
        double T = moit_number(precision, job->depths ? tile->curve : tile->T, i);
        lower[i] = T < lower[i] ? T : lower[i];
        upper[i] = T > upper[i] ? T : upper[i];
    }
}

static void fill_features(const moit_job *job, moit_tile *tile, int64_t stride, void *features) {
    const double *outlines = read_outlines(job, tile);
    job->stages->bounded_features(job->technique->count, tile->pixels, tile->offsets, tile->z,
                                  tile->absorbance, tile->rules, outlines, tile->b0,
                                  job->technique->bounded.network, stride, features);
}

const moit_technique_row moit_neural_bounded_row = {
    .name = "neural-bounded",
    OPTIONS(COUNT, WARPED, BLOCKS, BIAS, MOMENT_BITS(32), HALVES, NETWORK(bounded.network)),
    .thick = MOIT_THICK_MOMENTS,
    .usual_counts = (const int[]){4, 6, 0},
    .least_count = 4,
    .most_count = 6,
    .weigh = moit_bounded_weigh,
    .pull_back = moit_bounded_pull_back,
    .refusal = moit_bounded_refusal,
    .curve = bounded_curve,
    .bounds = bounded_bounds,
    .scratch = bounded_scratch,
    .moments = &moit_bounded_moments,
    .alone_in_few = 4,
    .blocks = &moit_moment_blocks,
    .weights = moit_bounded_weights,
    .columns = moit_bounded_columns,
    .features = fill_features,
    .unit_range = {-1.0, 1.0},
    .uses_warp = true,
    .reconstructs = true,
    .absorbs = moit_absorbs,
    .geometry_passes = 2};
