/* Strongest fragments occlude exactly, wherever they lie; all others are held as moments in half
 * floats of the pixel's own extent, between whose bounds a network decides. */
#include "core/techniques/options.h"
#include "core/techniques/table.h"
enum { MOMENTS = 6 };

/* What holds all others. */
static moit_technique rest_of(const moit_technique *technique, moit_precision precision) {
    moit_technique rest = {
        .kind = MOIT_BOUNDED_NEURAL,
        .count = MOMENTS,
        .range_per_pixel = true,
        .warp = technique->warp,
        .max_alpha = technique->max_alpha,
        .bounded = {.moments = {.bits = 32, .halves = true}, .network = technique->strong.network}};
    rest.bounded.moments.bias = moit_default_bias(&rest, precision);
    return rest;
}

static int strong_weights(const moit_technique *technique) {
    moit_technique rest = rest_of(technique, MOIT_FLOAT64);
    return moit_bounded_weights(&rest);
}

static int strong_columns(const moit_technique *technique) {
    moit_technique rest = rest_of(technique, MOIT_FLOAT64);
    return moit_bounded_columns(&rest);
}

static int numbers_of(const moit_technique *technique) {
    return MOIT_ANCHOR_NUMBERS(technique->count, 0);
}

/* Features, words of fragments, numbers of pixels, keys. */
static size_t strong_scratch(const moit_job *job, int fragments, int pixels) {
    size_t rows = (size_t)strong_columns(job->technique) + 1;
    size_t numbers = (size_t)pixels * (size_t)numbers_of(job->technique);
    return (rows * (size_t)fragments + numbers) * job->scalar + 16
           + moit_bytes_of_keys(job->technique->strong.large_keys, fragments);
}

typedef struct {
    char *word, *numbers;
    void *keys;
    const double *extents, *outlines;
    moit_technique rest;
} held;

/* Behind what the network sees of fragments, which those who ask for it find first. */
static held held_of(const moit_job *job, const moit_tile *tile) {
    const moit_technique *technique = job->technique;
    size_t row = ((size_t)tile->fragments + MOIT_PADDING) * job->scalar;
    held to = {.word = tile->own + (size_t)strong_columns(technique) * row};
    to.numbers = to.word + row;
    size_t bytes = (size_t)tile->pixels * (size_t)numbers_of(technique) * job->scalar;
    size_t before = (size_t)(to.numbers - (char *)tile->own) + bytes;
    to.keys = tile->own + (before + 7) / 8 * 8;
    to.extents = tile->sums; /* which blending fills later */
    to.outlines = tile->rules + (int64_t)tile->pixels * MOIT_RULE_SIZE(MOMENTS);
    to.rest = rest_of(technique, job->fragments->precision);
    return to;
}

/* z in [-1, 1] as part of the image's range. */
static void places_of(const moit_job *job, int n, const void *z, void *place) {
    const float *z32 = z;
    const double *z64 = z;
    float *place32 = place;
    double *place64 = place;
    if (job->fragments->precision == MOIT_FLOAT64)
        for (int i = 0; i < n; ++i) place64[i] = 0.5 + 0.5 * z64[i];
    else
        for (int i = 0; i < n; ++i) place32[i] = 0.5f + 0.5f * z32[i];
}

/* Words and absorbances of what pixel p keeps. */
static void read_kept(const moit_job *job, const held *by, int p, double *word, double *absorbed) {
    moit_precision precision = job->fragments->precision;
    int kept = job->technique->count;
    int64_t first = (int64_t)p * numbers_of(job->technique) + 2;
    for (int k = 0; k < kept; ++k) {
        word[k] = moit_number(precision, by->numbers, first + k);
        absorbed[k] = moit_number(precision, by->numbers, first + kept + k);
    }
}

/* The absorbance of those that are kept in front of a word. */
static inline double kept_in_front(int kept, const double *at, const double *absorbed,
                                   double word) {
    double sum = 0.0;
    for (int k = 0; k < kept; ++k) sum += at[k] < word ? absorbed[k] : 0.0;
    return sum;
}

/* Those that are kept, which are told by -1, add nothing to moments. */
static void let_kept_be(moit_precision precision, int n, void *own) {
    float *own32 = own;
    double *own64 = own;
    if (precision == MOIT_FLOAT64)
        for (int i = 0; i < n; ++i) own64[i] = own64[i] > 0.0 ? own64[i] : 0.0;
    else
        for (int i = 0; i < n; ++i) own32[i] = own32[i] > 0.0f ? own32[i] : 0.0f;
}

/* Finds what is kept, whose absorbance becomes 0, and gathers and reads the moments of the rest. */
static held gather(const moit_job *job, moit_tile *tile) {
    const moit_technique *technique = job->technique;
    moit_precision precision = job->fragments->precision;
    int n = tile->fragments;
    held to = held_of(job, tile);
    job->stages->absorbance(n, tile->alpha, job->max_alpha, tile->absorbance);
    moit_warp_tile(job, tile);
    places_of(job, n, tile->z, to.word);
    bool large = technique->strong.large_keys;
    job->stages->anchor_keys(large, technique->strong.gamma, n, tile->alpha, to.word, to.keys);
    job->stages->anchors(large, technique->count, 0, 1.0 - job->max_alpha, tile->pixels,
                         tile->offsets, tile->alpha, to.word, to.keys, tile->absorbance,
                         to.numbers);
    let_kept_be(precision, n, tile->absorbance);
    job->stages->own_extents(tile->pixels, tile->offsets, tile->z, tile->sums);
    job->stages->half_moments(MOMENTS, true, tile->pixels, tile->offsets, tile->absorbance, tile->z,
                              tile->b0, tile->b);
    moit_moments_read(job->precise, precision, &to.rest, NULL, to.rest.bounded.moments.bias,
                      tile->pixels, tile->b, tile->double_b, tile->rules);
    for (int p = 0; p < tile->pixels; ++p) tile->double_b0[p] = moit_number(precision, tile->b0, p);
    job->precise->bounded_outlines(MOMENTS, tile->pixels, tile->rules, tile->double_b0, to.extents,
                                   technique->strong.network, (double *)to.outlines);
    for (int p = 0; p < tile->pixels; ++p) {
        double at[MOST_KEPT], absorbed[MOST_KEPT];
        read_kept(job, &to, p, at, absorbed);
        tile->double_b0[p] += kept_in_front(technique->count, at, absorbed, 65536.0);
    }
    job->precise->decay(tile->pixels, tile->double_b0, tile->total);
    return to;
}

/* What all others absorb in front, in `out`, and what is kept. */
static void add_kept(const moit_job *job, const moit_tile *tile, const held *by,
                     const int32_t *offsets, const void *word, void *out) {
    job->stages->anchors_in_front(job->technique->count, tile->pixels, offsets, word, by->numbers,
                                  out);
}

static void strong_weigh(const moit_job *job, moit_tile *tile) {
    held by = gather(job, tile);
    job->stages->bounded_transmittance(MOMENTS, tile->pixels, tile->offsets, tile->z,
                                       tile->absorbance, tile->rules, by.outlines, tile->b0,
                                       job->technique->strong.network, true, tile->T);
    add_kept(job, tile, &by, tile->offsets, by.word, tile->T);
    if (!tile->absorbed) job->stages->decay(tile->fragments, tile->T, tile->T);
}

static void strong_curve(const moit_job *job, moit_tile *tile) {
    held by = gather(job, tile);
    int points = tile->curve_offsets[tile->pixels];
    void *word = tile->points[0];
    moit_moments_warp_curve(job, tile);
    places_of(job, points, tile->curve_z, word);
    moit_words_of_keys(job, job->technique->strong.large_keys, points, word);
    for (int p = 0; p < tile->pixels; ++p)
        job->stages->within_extent((int)job->depths, by.extents + 2 * p,
                                   (char *)tile->curve_z
                                       + (size_t)tile->curve_offsets[p] * job->scalar);
    job->stages->bounded_transmittance(MOMENTS, tile->pixels, tile->curve_offsets, tile->curve_z,
                                       NULL, tile->rules, by.outlines, tile->b0,
                                       job->technique->strong.network, true, tile->curve);
    add_kept(job, tile, &by, tile->curve_offsets, word, tile->curve);
    job->stages->decay(points, tile->curve, tile->curve);
}

/* As the rest's, with what is kept in what must be in front. */
static void strong_features(const moit_job *job, moit_tile *tile, int64_t stride, void *features) {
    held by = gather(job, tile);
    int columns = strong_columns(job->technique);
    job->stages->bounded_features(MOMENTS, tile->pixels, tile->offsets, tile->z, tile->absorbance,
                                  tile->rules, by.outlines, tile->b0,
                                  job->technique->strong.network, stride, features);
    char *least = (char *)features + (size_t)(columns - 2) * (size_t)stride * job->scalar;
    add_kept(job, tile, &by, tile->offsets, by.word, least);
}

const moit_technique_row moit_strong_row = {.name = "strong",
                                            OPTIONS(COUNT, WARPED, NUMBER("gamma", strong.gamma),
                                                    TRUTH("large_keys", strong.large_keys),
                                                    NETWORK(strong.network)),
                                            .usual_counts = (const int[]){5, 0},
                                            .least_count = 1,
                                            .most_count = MOST_KEPT,
                                            .weigh = strong_weigh,
                                            .curve = strong_curve,
                                            .scratch = strong_scratch,
                                            .weights = strong_weights,
                                            .columns = strong_columns,
                                            .features = strong_features,
                                            .unit_range = {-1.0, 1.0},
                                            .uses_warp = true,
                                            .reconstructs = true,
                                            .absorbs = moit_absorbs,
                                            .geometry_passes = 3};
