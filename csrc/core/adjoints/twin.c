/* A tile in double, and the derivatives of its fragments to where these came from. */
#include "core/adjoints/twin.h"

#include <stdlib.h>
#include <string.h>

static const moit_technique_row *row_of(const moit_technique *technique) {
    return moit_technique_rows[technique->kind];
}

static moit_job wide_job(const moit_job *job, moit_fragments *wide) {
    *wide = *job->fragments;
    wide->precision = MOIT_FLOAT64;
    moit_job twin = *job;
    twin.fragments = wide;
    twin.stages = job->precise;
    twin.scalar = sizeof(double);
    twin.scratch = row_of(job->technique)->scratch;
    return twin;
}

/* Hands out aligned doubles; with no memory it only counts. */
static double *doubles(char *memory, size_t *used, size_t count) {
    double *start = memory ? (double *)(void *)(memory + *used) : NULL;
    *used += (count * sizeof(double) + 63) / 64 * 64;
    return start;
}

enum { MOST_ARRAYS = 32, MOST_NODES = 4 };

/* Room for `n` padded fragments; how many bytes of `memory` that is. */
static size_t lay_out(const moit_job *wide, size_t n, size_t pixels, char *memory, moit_twin *t,
                      double *room[MOST_ARRAYS]) {
    size_t used = 0;
    moit_tile *tile = &t->tile;
    size_t points = wide->depths ? pixels * (size_t)wide->depths + MOIT_PADDING : 0;
    size_t own = wide->scratch ? wide->scratch(wide, (int)n, (int)pixels) : 0;
    tile->own = (char *)doubles(memory, &used, own / sizeof(double) + 1);
    tile->T = doubles(memory, &used, n);
    tile->absorbance = doubles(memory, &used, n);
    tile->z = doubles(memory, &used, n);
    tile->b0 = doubles(memory, &used, pixels);
    tile->b = doubles(memory, &used, pixels * MOIT_MOST_NUMBERS);
    for (int i = 0; i < 4; ++i) room[i] = doubles(memory, &used, n); /* of what is widened */
    room[4] = doubles(memory, &used, 3 * n);
    for (int c = 0; c < 3; ++c) room[5 + c] = doubles(memory, &used, n);
    t->by.T = doubles(memory, &used, points > n ? points : n);
    t->by.alpha = doubles(memory, &used, n);
    t->by.depth = doubles(memory, &used, n);
    t->by.emission = doubles(memory, &used, n);
    t->by.color = doubles(memory, &used, 3 * n);
    for (int c = 0; c < 3; ++c) {
        t->by.work[c] = doubles(memory, &used, n);
        t->by_opacity[c] = doubles(memory, &used, n);
        t->by_total[c] = doubles(memory, &used, pixels);
    }
    tile->curve = doubles(memory, &used, points);
    tile->curve_z = doubles(memory, &used, points);
    t->by.curve_z = doubles(memory, &used, points);
    t->total = doubles(memory, &used, pixels);
    t->color_by = doubles(memory, &used, 3 * pixels);
    bool keeps = row_of(wide->technique)->weigh_again && !wide->depths;
    t->by.apart = (int64_t)n;
    t->by.kept = doubles(memory, &used, keeps ? MOIT_KEPT * n : 0);
    if (!keeps) t->by.kept = NULL;
    t->by.low = doubles(memory, &used, keeps ? (MOST_NODES + 1) * pixels : 0);
    t->sums = doubles(memory, &used, 4 * pixels);
    t->by_sums = doubles(memory, &used, 4 * pixels);
    return used;
}

size_t moit_twin_scratch(const moit_job *job, int fragments, int pixels) {
    moit_fragments wide;
    moit_job of = wide_job(job, &wide);
    moit_twin t;
    double *room[MOST_ARRAYS];
    return lay_out(&of, (size_t)fragments, (size_t)pixels, NULL, &t, room);
}

static const void *widened(const moit_job *job, const void *numbers, int64_t count, double *to) {
    if (!numbers || job->fragments->precision == MOIT_FLOAT64) return numbers;
    for (int64_t i = 0; i < count; ++i) to[i] = (double)((const float *)numbers)[i];
    return to;
}

void moit_twin_begin(const moit_job *job, const moit_tile *tile, moit_twin *t) {
    double *room[MOST_ARRAYS];
    int n = tile->fragments;
    size_t padded = (size_t)tile->given + MOIT_PADDING; /* as techniques count their own room */
    t->by.network = NULL;
    t->by.blocks = NULL;
    t->job = wide_job(job, &t->fragments);
    t->job.fragments = &t->fragments;
    t->tile = *tile;
    lay_out(&t->job, padded, (size_t)tile->cut, tile->own, t, room);
    t->tile.depth = widened(job, tile->depth, n, room[0]);
    t->by.depth_given = t->tile.depth;
    t->tile.emission = widened(job, tile->emission, n, room[1]);
    t->tile.alpha =
        tile->alpha == tile->emission ? t->tile.emission : widened(job, tile->alpha, n, room[2]);
    t->tile.weights = widened(job, tile->weights, n, room[3]);
    t->tile.color = widened(job, tile->color, 3 * (int64_t)n, room[4]);
    for (int c = 0; c < 3 && tile->opacity[c]; ++c)
        t->tile.opacity[c] = widened(job, tile->opacity[c], n, room[5 + c]);
    t->tile.absorbed =
        row_of(job->technique)->absorbs && row_of(job->technique)->absorbs(job->technique);
    memset(t->by.alpha, 0, padded * sizeof(double));
    memset(t->by.depth, 0, padded * sizeof(double));
    memset(t->by.emission, 0, padded * sizeof(double));
    memset(t->by.color, 0, 3 * padded * sizeof(double));
    for (int c = 0; tile->opacity[0] && c < 3; ++c)
        memset(t->by_opacity[c], 0, padded * sizeof(double));
}

/* From opacities of channels and their mean to what fragments were given. */
static void pull_opacities(const moit_job *job, const moit_tile *tile, moit_twin *t) {
    if (!tile->opacity[0]) return;
    const double *emission = t->tile.emission;
    for (int i = 0; i < tile->fragments; ++i) {
        int64_t at = tile->first_fragment + (tile->source ? tile->source[i] : i);
        double net = t->by.alpha[i] / 3.0;
        t->by.alpha[i] = 0.0;
        for (int c = 0; c < 3; ++c) {
            double clear =
                moit_number(job->fragments->precision, job->fragments->transmission, 3 * at + c);
            double by = t->by_opacity[c][i] + net;
            t->by.alpha[i] += by * (1.0 - clear);
            t->by_opacity[c][i] = -by * emission[i];
        }
    }
}

/* Numbers of a tile's fragments to where these came from; the others get 0. */
static void give(const moit_job *job, const moit_tile *tile, void *out_, int width,
                 const double *numbers) {
    if (!out_) return;
    char *out = (char *)out_ + (size_t)(tile->first_fragment * width) * job->scalar;
    if (tile->source) memset(out, 0, (size_t)(tile->given * width) * job->scalar);
    for (int i = 0; i < tile->fragments; ++i)
        for (int k = 0; k < width; ++k)
            moit_put_number(job->fragments->precision, out,
                            (int64_t)(tile->source ? tile->source[i] : i) * width + k,
                            numbers[i * width + k]);
}

void moit_twin_give(const moit_job *job, const moit_tile *tile, moit_twin *t,
                    const moit_gradients *out) {
    pull_opacities(job, tile, t);
    for (int i = 0; i < tile->fragments; ++i) t->by.alpha[i] += t->by.emission[i];
    give(job, tile, out->depth, 1, t->by.depth);
    give(job, tile, out->alpha, 1, t->by.alpha);
    give(job, tile, out->color, 3, t->by.color);
    for (int i = 0; out->transmission && i < tile->fragments; ++i)
        for (int c = 0; c < 3; ++c) t->by.color[3 * i + c] = t->by_opacity[c][i];
    give(job, tile, out->transmission, 3, t->by.color);
}

void moit_behind_give(const moit_behind *behind, const moit_tile *tile, const double *by_pixel) {
    double *sum = behind->by ? behind->by + 3 * (tile->first_pixel / behind->run) : NULL;
    for (int p = 0; behind->by && p < tile->pixels; ++p)
        for (int c = 0; c < 3; ++c) {
            double by = (tile->opaque && tile->opaque[p] >= 0) ? 0.0 : by_pixel[3 * p + c];
            if (behind->per_pixel) behind->by[3 * (tile->first_pixel + p) + c] = by;
            else sum[c] += by;
        }
}

/* ---- Techniques that prepare the image ------------------------------------------------------- */

/* An array of floats in double, or NULL where there is none; *failed: there is no memory. */
static double *wide_copy(const void *numbers, int64_t count, bool *failed) {
    if (!numbers) return NULL;
    double *wide = malloc((size_t)(count > 0 ? count : 1) * sizeof *wide);
    if (!wide) *failed = true;
    for (int64_t i = 0; wide && i < count; ++i) wide[i] = (double)((const float *)numbers)[i];
    return wide;
}

static moit_status prepare(moit_job *job) {
    moit_status (*own)(moit_job *) = row_of(job->technique)->prepare;
    moit_status status = own ? own(job) : MOIT_OK;
    return status == MOIT_OK ? moit_blocks_prepare(job) : status;
}

/* What double makes of depths of float need not be where floats put it. */
moit_status moit_twin_prepare(moit_job *job) {
    if (job->fragments->precision == MOIT_FLOAT64) return prepare(job);
    if (!row_of(job->technique)->prepare && job->technique->resolution < 2) return MOIT_OK;
    moit_fragments wide = *job->fragments;
    int64_t n = wide.offsets[wide.pixels];
    bool failed = false;
    double *depth = wide_copy(wide.depth, n, &failed), *alpha = wide_copy(wide.alpha, n, &failed);
    double *transmission = wide_copy(wide.transmission, 3 * n, &failed);
    wide.precision = MOIT_FLOAT64;
    wide.depth = depth;
    wide.alpha = alpha;
    wide.transmission = transmission;
    wide.color = NULL;
    moit_job twin = moit_job_of(&wide, job->technique, job->cull_opaque, job->run);
    moit_status status = failed ? MOIT_NO_MEMORY : prepare(&twin);
    job->prepared = twin.prepared;
    job->blocks = twin.blocks;
    free(depth);
    free(alpha);
    free(transmission);
    return status;
}
