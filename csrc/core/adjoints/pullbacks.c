/* The questions of moit_gradients.h, tile by tile: a tile in double, the technique's answer, what
 * the loss changes by with it, and back through the technique to what fragments were given as. */
#include "moit_gradients.h"

#include "core/techniques/table.h"

#include <math.h>
#include <string.h>

static const moit_technique_row *row_of(const moit_technique *technique) {
    return &moit_technique_rows[technique->kind];
}

bool moit_has_gradient(moit_kind kind) { return moit_technique_rows[kind].pull_back; }

const char *moit_gradient_refusal(const moit_technique *technique) {
    const moit_technique_row *row = row_of(technique);
    return row->refusal ? row->refusal(technique) : NULL;
}

enum { OF_IMAGE, OF_FRAGMENTS, OF_TOTALS };

typedef struct {
    int question;
    const double *background; /* of an image */
    bool per_pixel;
    const void *seed;
    const moit_gradients *out;
} pulling;

/* A job whose numbers are double, and its tile. */
typedef struct {
    moit_fragments fragments;
    moit_job job;
    moit_tile tile;
    moit_adjoint by;
    double *by_opacity[3], *by_total[3]; /* (fragments), (pixels) of each channel */
    double *total;                       /* (pixels) by that of the net coverage */
    double *color_by;                    /* (pixels, 3) by what is behind */
} twin;

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

enum { MOST_ARRAYS = 32 };

/* Room for `n` padded fragments; how many bytes of `memory` that is. */
static size_t lay_out(const moit_job *wide, size_t n, size_t pixels, char *memory, twin *t,
                      double *room[MOST_ARRAYS]) {
    size_t used = 0;
    moit_tile *tile = &t->tile;
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
    t->by.T = doubles(memory, &used, n);
    t->by.alpha = doubles(memory, &used, n);
    t->by.depth = doubles(memory, &used, n);
    t->by.emission = doubles(memory, &used, n);
    t->by.color = doubles(memory, &used, 3 * n);
    for (int c = 0; c < 3; ++c) {
        t->by.work[c] = doubles(memory, &used, n);
        t->by_opacity[c] = doubles(memory, &used, n);
        t->by_total[c] = doubles(memory, &used, pixels);
    }
    t->total = doubles(memory, &used, pixels);
    t->color_by = doubles(memory, &used, 3 * pixels);
    return used;
}

static size_t scratch(const moit_job *job, int fragments, int pixels) {
    moit_fragments wide;
    moit_job of = wide_job(job, &wide);
    twin t;
    double *room[MOST_ARRAYS];
    return lay_out(&of, (size_t)fragments, (size_t)pixels, NULL, &t, room);
}

static const void *widened(const moit_job *job, const void *numbers, int64_t count, double *to) {
    if (!numbers || job->fragments->precision == MOIT_FLOAT64) return numbers;
    for (int64_t i = 0; i < count; ++i) to[i] = (double)((const float *)numbers)[i];
    return to;
}

static void begin(const moit_job *job, const moit_tile *tile, twin *t) {
    double *room[MOST_ARRAYS];
    int n = tile->fragments;
    size_t padded = (size_t)n + MOIT_PADDING;
    t->job = wide_job(job, &t->fragments);
    t->job.fragments = &t->fragments;
    t->tile = *tile;
    lay_out(&t->job, padded, (size_t)tile->pixels, tile->own, t, room);
    t->tile.depth = widened(job, tile->depth, n, room[0]);
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

static double seed_at(const moit_job *job, const pulling *how, int64_t i) {
    return moit_number(job->fragments->precision, how->seed, i);
}

static bool opaque_at(const moit_tile *tile, int p) { return tile->opaque && tile->opaque[p] >= 0; }

/* 1 - total, to its last digits where little is covered, too. */
static double covered(const twin *t, int p) {
    bool of_sums = row_of(t->job.technique)->absorbs && !row_of(t->job.technique)->total;
    return of_sums ? -expm1(-t->tile.double_b0[p]) : 1.0 - t->tile.total[p];
}

/* Asks the technique of opacities, and pulls back what `by` holds of T and the total. */
static void weigh(twin *t, const double *alpha) {
    t->tile.alpha = alpha;
    row_of(t->job.technique)->weigh(&t->job, &t->tile);
}

static void pull(twin *t, double *total, double *alpha) {
    moit_adjoint by = t->by;
    by.total = total;
    by.alpha = alpha;
    row_of(t->job.technique)->pull_back(&t->job, &t->tile, &by);
}

/* From T, or what is absorbed in front: weights, of which the greatest is 1 where only their ratios
 * count and nothing may underflow. */
static void find_weights(twin *t, bool relative, double *T) {
    const double *x = t->tile.T, *alpha = t->tile.alpha;
    for (int p = 0; p < t->tile.pixels; ++p) {
        int first = t->tile.offsets[p], end = t->tile.offsets[p + 1];
        double least = HUGE_VAL;
        for (int i = first; relative && i < end; ++i)
            if (alpha[i] > 0.0) least = fmin(least, x[i]);
        if (least == HUGE_VAL) least = 0.0;
        for (int i = first; i < end; ++i)
            T[i] = t->tile.absorbed ? fmin(x[i] - least, 700.0) : x[i];
    }
    if (t->tile.absorbed) t->job.stages->decay(t->tile.fragments, T, T);
}

/* What is behind pixel p in channel c: an opaque surface's colour, or the background. */
static double behind_at(const moit_job *job, const moit_tile *tile, const pulling *how, int p,
                        int c) {
    if (opaque_at(tile, p))
        return moit_number(job->fragments->precision, job->fragments->color,
                           3 * (tile->first_fragment + tile->opaque[p]) + c);
    return how->background[how->per_pixel ? 3 * (tile->first_pixel + p) + c : c];
}

/* By sums over fragments of T (emission color, alpha): to by->T, emission and color, and alpha of
 * pixel p. `channels`: bits of those that are summed. */
static inline void pull_sums(twin *t, int p, const double by_sum[4], const int channels,
                             const double *restrict T, double *restrict by_alpha) {
    const double *alpha = t->tile.alpha, *emission = t->tile.emission, *color = t->tile.color;
    double *restrict by_T = t->by.T, *restrict by_color = t->by.color;
    double *restrict by_emission = t->by.emission;
    bool absorbed = t->tile.absorbed;
    for (int i = t->tile.offsets[p]; i < t->tile.offsets[p + 1]; ++i) {
        double seen = 0.0, light = emission[i] * T[i];
        for (int c = 0; c < 3; ++c) {
            if (!(channels >> c & 1)) continue;
            seen += by_sum[c] * color[3 * i + c];
            by_color[3 * i + c] += by_sum[c] * light;
        }
        by_emission[i] += seen * T[i];
        by_alpha[i] += by_sum[3] * T[i];
        double by = seen * emission[i] + by_sum[3] * alpha[i];
        by_T[i] = absorbed ? -T[i] * by : by;
    }
}

static void sum_up(const twin *t, int p, const double *T, double sum[4]) {
    const double *alpha = t->tile.alpha, *emission = t->tile.emission, *color = t->tile.color;
    memset(sum, 0, 4 * sizeof *sum);
    for (int i = t->tile.offsets[p]; i < t->tile.offsets[p + 1]; ++i) {
        for (int c = 0; c < 3; ++c) sum[c] += emission[i] * T[i] * color[3 * i + c];
        sum[3] += alpha[i] * T[i];
    }
}

static bool is_grey(const twin *t, int p) {
    for (int i = t->tile.offsets[p]; i < t->tile.offsets[p + 1]; ++i)
        for (int c = 1; c < 3; ++c)
            if (((const double *)t->tile.opacity[c])[i] != ((const double *)t->tile.opacity[0])[i])
                return false;
    return true;
}

/* By channels' totals, which by_total holds: to `total`, by that of the net coverage, and to
 * by_opacity. What stands in by->T is left alone. Written over: T of the tile. */
static void pull_channel_totals(twin *t, double *total) {
    if (row_of(t->job.technique)->reconstructs) {
        for (int p = 0; p < t->tile.pixels; ++p)
            for (int c = 0; c < 3 && is_grey(t, p); ++c) {
                total[p] += t->by_total[c][p];
                t->by_total[c][p] = 0.0;
            }
        moit_adjoint by = t->by;
        const void *net = t->tile.alpha;
        for (int c = 0; c < 3; ++c) {
            by.alpha = t->by_opacity[c];
            t->tile.alpha = t->tile.opacity[c];
            moit_adjoint_of_totals(&t->tile, &by, t->by_total[c]);
        }
        t->tile.alpha = net;
        return;
    }
    const void *net = t->tile.alpha;
    for (int c = 0; c < 3; ++c) {
        memset(t->by.T, 0, (size_t)t->tile.fragments * sizeof(double));
        weigh(t, t->tile.opacity[c]);
        pull(t, t->by_total[c], t->by_opacity[c]);
    }
    t->tile.alpha = net;
}

/* What a pixel lets through in channel c. */
static void find_channel_totals(twin *t, double *totals[3]) {
    bool reconstructs = row_of(t->job.technique)->reconstructs;
    const void *net = t->tile.alpha;
    size_t bytes = (size_t)t->tile.pixels * sizeof(double);
    for (int c = 0; c < 3; ++c) {
        if (reconstructs)
            t->job.stages->products(t->tile.pixels, t->tile.offsets, t->tile.opacity[c], totals[c]);
        else {
            weigh(t, t->tile.opacity[c]);
            memcpy(totals[c], t->tile.total, bytes);
        }
    }
    weigh(t, net);
    for (int p = 0; reconstructs && p < t->tile.pixels; ++p)
        for (int c = 0; c < 3 && is_grey(t, p); ++c) totals[c][p] = t->tile.total[p];
}

static void image_backwards(const moit_job *job, const moit_tile *tile, twin *t,
                            const pulling *how) {
    const moit_technique_row *row = row_of(job->technique);
    bool coloured = tile->opacity[0], scales = job->technique->normalize && row->reconstructs;
    double *T = t->by.work[1], *total = t->total;
    double *totals[3] = {tile->channel_total, tile->channel_total + tile->pixels,
                         tile->channel_total + 2 * tile->pixels};
    const double *net = t->tile.alpha;
    if (coloured) find_channel_totals(t, totals);
    else weigh(t, net);
    for (int c = 0; c < 3; ++c)
        for (int p = 0; p < tile->pixels; ++p) {
            int64_t pixel = tile->first_pixel + p;
            double g = seed_at(job, how, 4 * pixel + c);
            double through = coloured ? totals[c][p] : t->tile.total[p];
            /* an opaque surface hides all light: alpha is 1 whatever is in front of it */
            double by_alpha = opaque_at(tile, p) ? 0.0 : seed_at(job, how, 4 * pixel + 3);
            t->color_by[3 * p + c] = g * through;
            t->by_total[c][p] = g * behind_at(job, tile, how, p, c) - by_alpha / 3.0;
        }
    for (int c = 0; coloured && row->by_channel && c < 3; ++c) {
        weigh(t, t->tile.opacity[c]);
        find_weights(t, false, T);
        for (int p = 0; p < tile->pixels; ++p) {
            double by_sum[4] = {0};
            by_sum[c] = seed_at(job, how, 4 * (tile->first_pixel + p) + c);
            pull_sums(t, p, by_sum, 1 << c, T, t->by_opacity[c]);
        }
        pull(t, t->by_total[c], t->by_opacity[c]);
    }
    t->tile.alpha = net;
    if (coloured && row->by_channel) return;
    find_weights(t, scales && t->tile.absorbed, T);
    for (int p = 0; p < tile->pixels; ++p) {
        double sum[4], by_sum[4] = {0}, scale = 1.0;
        total[p] = 0.0;
        sum_up(t, p, T, sum);
        if (scales && sum[3] > 0.0) scale = covered(t, p) / sum[3];
        for (int c = 0; c < 3; ++c) {
            double g = seed_at(job, how, 4 * (tile->first_pixel + p) + c);
            by_sum[c] = g * scale;
            if (!coloured) total[p] += t->by_total[c][p];
            if (scales && sum[3] > 0.0) {
                by_sum[3] -= g * sum[c] * scale / sum[3];
                total[p] -= g * sum[c] / sum[3];
            }
        }
        pull_sums(t, p, by_sum, 7, T, t->by.alpha);
    }
    if (!coloured) {
        pull(t, total, t->by.alpha);
        return;
    }
    if (row->reconstructs) pull_channel_totals(t, total);
    pull(t, total, t->by.alpha);
    if (!row->reconstructs) pull_channel_totals(t, total);
}

static void fragments_backwards(const moit_job *job, const moit_tile *tile, twin *t,
                                const pulling *how) {
    double *T = t->by.work[1], *total = t->total;
    weigh(t, t->tile.alpha);
    find_weights(t, false, T);
    for (int i = 0; i < tile->fragments; ++i) {
        int64_t at = tile->first_fragment + (tile->source ? tile->source[i] : i);
        double g = seed_at(job, how, at);
        t->by.T[i] = t->tile.absorbed ? -T[i] * g : g;
    }
    for (int p = 0; p < tile->pixels; ++p)
        total[p] =
            opaque_at(tile, p) ? seed_at(job, how, tile->first_fragment + tile->opaque[p]) : 0.0;
    pull(t, total, t->by.alpha);
}

static void totals_backwards(const moit_job *job, const moit_tile *tile, twin *t,
                             const pulling *how) {
    double *total = t->total;
    bool coloured = tile->opacity[0];
    memset(t->by.T, 0, (size_t)tile->fragments * sizeof(double));
    for (int p = 0; p < tile->pixels; ++p) {
        int64_t pixel = tile->first_pixel + p;
        bool seen = !opaque_at(tile, p);
        total[p] = seen && !coloured ? seed_at(job, how, pixel) : 0.0;
        for (int c = 0; coloured && c < 3; ++c)
            t->by_total[c][p] = seen ? seed_at(job, how, 3 * pixel + c) : 0.0;
    }
    if (coloured) pull_channel_totals(t, total);
    weigh(t, t->tile.alpha);
    memset(t->by.T, 0, (size_t)tile->fragments * sizeof(double));
    pull(t, total, t->by.alpha);
}

/* From opacities of channels and their mean to what fragments were given. */
static void pull_opacities(const moit_job *job, const moit_tile *tile, twin *t) {
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
    int64_t n = (int64_t)tile->fragments * width;
    if (tile->source) {
        memset(out, 0, (size_t)(tile->given * width) * job->scalar);
        for (int i = 0; i < tile->fragments; ++i)
            for (int k = 0; k < width; ++k)
                moit_set_number(job->fragments->precision, out,
                                (int64_t)tile->source[i] * width + k, numbers[i * width + k]);
    } else if (job->fragments->precision == MOIT_FLOAT64) {
        memcpy(out, numbers, (size_t)n * sizeof *numbers);
    } else {
        for (int64_t i = 0; i < n; ++i) ((float *)(void *)out)[i] = (float)numbers[i];
    }
}

static void give_all(const moit_job *job, const moit_tile *tile, twin *t, const pulling *how) {
    const moit_gradients *out = how->out;
    for (int i = 0; i < tile->fragments; ++i) t->by.alpha[i] += t->by.emission[i];
    give(job, tile, out->depth, 1, t->by.depth);
    give(job, tile, out->alpha, 1, t->by.alpha);
    give(job, tile, out->color, 3, t->by.color);
    for (int i = 0; out->transmission && i < tile->fragments; ++i)
        for (int c = 0; c < 3; ++c) t->by.color[3 * i + c] = t->by_opacity[c][i];
    give(job, tile, out->transmission, 3, t->by.color);
    for (int p = 0; p < tile->pixels; ++p)
        for (int c = 0; c < 3; ++c) {
            double by = how->question == OF_IMAGE ? t->color_by[3 * p + c] : 0.0;
            bool hides = opaque_at(tile, p);
            if (out->background)
                out->background[3 * (tile->first_pixel + p) + c] = hides ? 0.0 : by;
            if (hides && out->color)
                moit_set_number(job->fragments->precision, out->color,
                                3 * (tile->first_fragment + tile->opaque[p]) + c, by);
        }
}

static void pull_tile(const moit_job *job, moit_tile *tile, void *context) {
    const pulling *how = context;
    twin t;
    begin(job, tile, &t);
    switch (how->question) {
    case OF_IMAGE: image_backwards(job, tile, &t, how); break;
    case OF_FRAGMENTS: fragments_backwards(job, tile, &t, how); break;
    default: totals_backwards(job, tile, &t, how);
    }
    pull_opacities(job, tile, &t);
    give_all(job, tile, &t, how);
}

static moit_status ask(const moit_fragments *fragments, const moit_technique *technique,
                       bool cull_opaque, pulling *how, const moit_run *run) {
    moit_job job = moit_job_of(fragments, technique, cull_opaque, run);
    job.scratch = scratch;
    return moit_for_tiles(&job, pull_tile, how);
}

moit_status moit_composite_pullback(const moit_fragments *fragments,
                                    const moit_technique *technique, bool cull_opaque,
                                    const double *background, bool background_per_pixel,
                                    const void *seed, const moit_gradients *out,
                                    const moit_run *run) {
    pulling how = {OF_IMAGE, background, background_per_pixel, seed, out};
    return ask(fragments, technique, cull_opaque, &how, run);
}

moit_status moit_transmittance_pullback(const moit_fragments *fragments,
                                        const moit_technique *technique, bool cull_opaque,
                                        const void *seed, const moit_gradients *out,
                                        const moit_run *run) {
    pulling how = {.question = OF_FRAGMENTS, .seed = seed, .out = out};
    return ask(fragments, technique, cull_opaque, &how, run);
}

moit_status moit_total_transmittance_pullback(const moit_fragments *fragments,
                                              const moit_technique *technique, bool cull_opaque,
                                              const void *seed, const moit_gradients *out,
                                              const moit_run *run) {
    pulling how = {.question = OF_TOTALS, .seed = seed, .out = out};
    return ask(fragments, technique, cull_opaque, &how, run);
}
