/* The questions of moit_gradients.h, tile by tile: a tile in double, the technique's answer, what
 * the loss changes by with it, and back through the technique to what fragments were given as. */
#include "core/adjoints/blocks.h"
#include "core/adjoints/single.h"
#include "core/adjoints/tiles.h"
#include "core/adjoints/twin.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const moit_technique_row *row_of(const moit_technique *technique) {
    return moit_technique_rows[technique->kind];
}

bool moit_has_gradient(moit_kind kind) { return moit_technique_rows[kind]->pull_back; }

const char *moit_gradient_refusal(const moit_technique *technique) {
    const moit_technique_row *row = row_of(technique);
    return row->refusal ? row->refusal(technique) : NULL;
}

enum { OF_IMAGE, OF_FRAGMENTS, OF_CURVES, OF_TOTALS };

typedef struct {
    int question;
    moit_behind behind; /* of an image */
    const void *seed;
    const moit_gradients *out;
    int64_t depths; /* of curves */
    const double *depth;
    double *network; /* by the network's weights, of each run of pixels; or NULL */
    int64_t weights;
    moit_block_slopes *blocks; /* where pixels read blocks; else NULL */
} pulling;

static double seed_at(const moit_job *job, const pulling *how, int64_t i) {
    return moit_number(job->fragments->precision, how->seed, i);
}

static bool opaque_at(const moit_tile *tile, int p) { return tile->opaque && tile->opaque[p] >= 0; }

/* 1 - total, to its last digits where little is covered, too. */
static double covered(const moit_twin *t, int p) {
    bool of_sums = row_of(t->job.technique)->absorbs && !row_of(t->job.technique)->total
                   && (!t->job.blocks || t->job.technique->full_total);
    return of_sums ? moit_covered_by(t->tile.double_b0[p], t->tile.total[p])
                   : 1.0 - t->tile.total[p];
}

/* Asks the technique of opacities, and pulls back what `by` holds of T and the total. */
static void weigh(moit_twin *t, const double *alpha) {
    const moit_technique_row *row = row_of(t->job.technique);
    t->tile.alpha = alpha;
    t->tile.depth = t->by.depth_given;
    if (t->by.kept) row->weigh_again(&t->job, &t->tile, &t->by);
    else row->weigh(&t->job, &t->tile);
}

static void pull(moit_twin *t, double *total, double *alpha) {
    moit_adjoint by = t->by;
    by.total = total;
    by.alpha = alpha;
    row_of(t->job.technique)->pull_back(&t->job, &t->tile, &by);
}

/* From T, or what is absorbed in front: weights, of which the greatest is 1 where only their ratios
 * count and nothing may underflow. */
static void find_weights(moit_twin *t, bool relative, double *T) {
    if (relative && t->tile.absorbed)
        moit_tile_adjoints_of(t->job.run->isa)
            ->relative_weights(t->tile.pixels, t->tile.offsets, t->tile.T, t->tile.alpha, T);
    else if (t->tile.absorbed) t->job.stages->decay(t->tile.fragments, t->tile.T, T);
    else memcpy(T, t->tile.T, (size_t)t->tile.fragments * sizeof *T);
}

static double opaque_color(const moit_job *job, const moit_tile *tile, int p, int c) {
    return moit_number(job->fragments->precision, job->fragments->color,
                       3 * (tile->first_fragment + tile->opaque[p]) + c);
}

/* By sums over fragments of T (emission color, alpha): to by->T, emission and color, and alpha.
 * Of one channel c, adds; c < 0: of all, fills. */
static void pull_sums(moit_twin *t, int c, const double *T, double *by_alpha) {
    const double *alpha = t->tile.alpha, *emission = t->tile.emission, *color = t->tile.color;
    moit_pulled_sums of = {.pixels = t->tile.pixels,
                           .offsets = t->tile.offsets,
                           .by_sum = t->by_sums,
                           .T = T,
                           .alpha = alpha,
                           .emission = emission,
                           .color = color,
                           .absorbed = t->tile.absorbed,
                           .by_T = t->by.T,
                           .by_color = t->by.color,
                           .by_emission = t->by.emission,
                           .by_alpha = by_alpha};
    if (c < 0) {
        moit_tile_adjoints_of(t->job.run->isa)->pull_sums(&of);
        return;
    }
    for (int p = 0; p < t->tile.pixels; ++p) {
        const double *by_sum = t->by_sums + 4 * p;
        for (int i = t->tile.offsets[p]; i < t->tile.offsets[p + 1]; ++i) {
            double seen = by_sum[c] * color[3 * i + c];
            of.by_color[3 * i + c] += by_sum[c] * emission[i] * T[i];
            of.by_emission[i] += seen * T[i];
            by_alpha[i] += by_sum[3] * T[i];
            double by = seen * emission[i] + by_sum[3] * alpha[i];
            of.by_T[i] = of.absorbed ? -T[i] * by : by;
        }
    }
}

/* Of pixels [p, end). */
static void sum_up(const moit_twin *t, int p, int end, const double *T) {
    t->job.stages->blend(end - p, t->tile.offsets + p, t->tile.alpha, t->tile.emission, T,
                         t->tile.color, t->sums + 4 * p);
}

/* In place of a sum of weights, which is not below 0. */
#define LOST (-1.0)

/* Whether pictures show pixel p's fragments with equal weights, as those of their own are nothing;
 * as has_lost_weights of questions.c, where weights are not relative anyway. */
static bool has_lost_weights(const moit_twin *t, int p, const double sum[4]) {
    return !t->tile.absorbed && t->tile.total[p] < 0.5 && sum[3] < ldexp(1.0, -WEIGHTS_LOST_DOUBLE);
}

static bool is_grey(const moit_twin *t, int p) {
    for (int i = t->tile.offsets[p]; i < t->tile.offsets[p + 1]; ++i)
        for (int c = 1; c < 3; ++c)
            if (((const double *)t->tile.opacity[c])[i] != ((const double *)t->tile.opacity[0])[i])
                return false;
    return true;
}

/* By channels' totals, which by_total holds: to `total`, by that of the net coverage, and to
 * by_opacity. What stands in by->T is left alone. Written over: T of the tile. */
static void pull_channel_totals(moit_twin *t, double *total) {
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
static void find_channel_totals(moit_twin *t, double *totals[3]) {
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

/* Back through what pixels sum up in a channel, or with `channel` < 0 in all, to by->T, and with
 * `adds` from by_total of these to `total`. The technique has been asked of the tile's alpha. */
static void pull_picture(const moit_job *job, const moit_tile *tile, moit_twin *t,
                         const pulling *how, int channel, bool adds, double *total,
                         double *by_alpha) {
    const moit_technique_row *row = row_of(job->technique);
    bool scales = job->technique->normalize && (row->reconstructs || row->see);
    double *T = t->by.work[1];
    find_weights(t, scales && t->tile.absorbed, T);
    if (row->see) row->see(&t->job, &t->tile, T);
    bool any_lost = false;
    sum_up(t, 0, tile->pixels, T);
    for (int p = 0; p < tile->pixels; ++p) {
        double *sum = t->sums + 4 * p, *by_sum = t->by_sums + 4 * p, scale = 1.0;
        memset(by_sum, 0, 4 * sizeof *by_sum);
        total[p] = 0.0;
        bool lost = scales && has_lost_weights(t, p, sum);
        if (lost) {
            any_lost = true;
            for (int i = tile->offsets[p]; i < tile->offsets[p + 1]; ++i) T[i] = 1.0;
            sum_up(t, p, p + 1, T);
        }
        if (scales && sum[3] > 0.0) scale = covered(t, p) / sum[3];
        for (int c = channel < 0 ? 0 : channel; c < (channel < 0 ? 3 : channel + 1); ++c) {
            double g = seed_at(job, how, 4 * (tile->first_pixel + p) + c);
            by_sum[c] = g * scale;
            if (adds) total[p] += t->by_total[c][p];
            if (scales && sum[3] > 0.0) {
                by_sum[3] -= g * sum[c] * scale / sum[3];
                total[p] -= g * sum[c] / sum[3];
            }
        }
        if (lost) sum[3] = LOST;
    }
    pull_sums(t, channel, T, by_alpha);
    for (int p = 0; any_lost && p < tile->pixels; ++p)
        if (t->sums[4 * p + 3] == LOST)
            for (int i = tile->offsets[p]; i < tile->offsets[p + 1]; ++i) t->by.T[i] = 0.0;
    if (!row->unsee) return;
    moit_adjoint by = t->by;
    by.total = total;
    by.alpha = by_alpha;
    row->unsee(&t->job, &t->tile, &by);
}

static void image_backwards(const moit_job *job, const moit_tile *tile, moit_twin *t,
                            const pulling *how) {
    const moit_technique_row *row = row_of(job->technique);
    bool coloured = tile->opacity[0];
    double *total = t->total;
    double *totals[3] = {tile->channel_total, tile->channel_total + tile->pixels,
                         tile->channel_total + 2 * tile->pixels};
    const double *net = t->tile.alpha;
    if (coloured) find_channel_totals(t, totals);
    else weigh(t, net);
    for (int p = 0; p < tile->pixels; ++p) {
        int64_t pixel = tile->first_pixel + p;
        const double *behind = how->behind.color + (how->behind.per_pixel ? 3 * pixel : 0);
        bool hides = opaque_at(tile, p);
        /* an opaque surface hides all light: alpha is 1 whatever is in front of it */
        double by_alpha = hides ? 0.0 : seed_at(job, how, 4 * pixel + 3) / 3.0;
        for (int c = 0; c < 3; ++c) {
            double g = seed_at(job, how, 4 * pixel + c);
            double color = hides ? opaque_color(job, tile, p, c) : behind[c];
            t->color_by[3 * p + c] = g * (coloured ? totals[c][p] : t->tile.total[p]);
            t->by_total[c][p] = g * color - by_alpha;
        }
    }
    for (int c = 0; coloured && row->by_channel && c < 3; ++c) {
        weigh(t, t->tile.opacity[c]);
        pull_picture(job, tile, t, how, c, true, total, t->by_opacity[c]);
        pull(t, total, t->by_opacity[c]);
    }
    t->tile.alpha = net;
    if (coloured && row->by_channel) return;
    pull_picture(job, tile, t, how, -1, !coloured, total, t->by.alpha);
    if (!coloured) {
        pull(t, total, t->by.alpha);
        return;
    }
    if (row->reconstructs) pull_channel_totals(t, total);
    pull(t, total, t->by.alpha);
    if (!row->reconstructs) pull_channel_totals(t, total);
}

static void fragments_backwards(const moit_job *job, const moit_tile *tile, moit_twin *t,
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

static void curves_backwards(const moit_job *job, const moit_tile *tile, moit_twin *t,
                             const pulling *how) {
    bool absorbed = t->tile.absorbed;
    t->tile.absorbed = false;
    row_of(job->technique)->curve(&t->job, &t->tile);
    t->tile.absorbed = absorbed;
    const double *T = t->tile.curve;
    for (int p = 0; p < tile->pixels; ++p) {
        moit_known_range range = moit_known_range_of(job, tile, p);
        t->total[p] = 0.0;
        for (int64_t k = 0, i = p * job->depths; k < job->depths; ++k, ++i) {
            double depth = job->depth[k];
            double g = seed_at(job, how, (tile->first_pixel + p) * job->depths + k);
            t->by.T[i] = 0.0;
            if (depth < range.near || depth > range.opaque) continue;
            if (depth > range.far) t->total[p] += g;
            else t->by.T[i] = absorbed ? -T[i] * g : g;
        }
    }
    pull(t, t->total, t->by.alpha);
}

static void totals_backwards(const moit_job *job, const moit_tile *tile, moit_twin *t,
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

/* By the colours of opaque surfaces, which are behind all else. */
static void give_opaque(const moit_job *job, const moit_tile *tile, const moit_twin *t,
                        const pulling *how) {
    for (int p = 0; tile->opaque && how->out->color && p < tile->pixels; ++p)
        for (int c = 0; tile->opaque[p] >= 0 && c < 3; ++c)
            moit_set_number(job->fragments->precision, how->out->color,
                            3 * (tile->first_fragment + tile->opaque[p]) + c,
                            how->question == OF_IMAGE ? t->color_by[3 * p + c] : 0.0);
}

static void pull_tile(const moit_job *job, moit_tile *tile, void *context) {
    const pulling *how = context;
    moit_twin t;
    bool single = how->question == OF_IMAGE || how->question == OF_FRAGMENTS;
    if (single && !tile->opacity[0] && moit_is_single(job)) {
        const moit_behind *behind = how->question == OF_IMAGE ? &how->behind : NULL;
        moit_single_asked asked = {behind, how->seed, how->out};
        if (moit_single_backwards(job, tile, &asked)) return;
    }
    moit_twin_begin(job, tile, &t);
    if (how->network && !(how->blocks && how->blocks->collects))
        t.by.network = how->network + tile->first_pixel / how->behind.run * how->weights;
    t.by.blocks = how->blocks;
    switch (how->question) {
    case OF_IMAGE: image_backwards(job, tile, &t, how); break;
    case OF_FRAGMENTS: fragments_backwards(job, tile, &t, how); break;
    case OF_CURVES: curves_backwards(job, tile, &t, how); break;
    default: totals_backwards(job, tile, &t, how);
    }
    if (how->blocks && how->blocks->collects) return;
    moit_twin_give(job, tile, &t, how->out);
    give_opaque(job, tile, &t, how);
    if (how->question == OF_IMAGE) moit_behind_give(&how->behind, tile, t.color_by);
}

enum { LEAST_RUN = 2048, MOST_RUNS = 256 };

static int64_t runs_of(const moit_job *job, const pulling *how) {
    return (job->fragments->pixels + how->behind.run - 1) / how->behind.run;
}

/* Sums over all pixels (the network's weights, one background) are of runs of these first, and then
 * added up in the order of runs. */
static moit_status begin_sums(const moit_job *job, pulling *how) {
    int64_t pixels = job->fragments->pixels, run = (pixels + MOST_RUNS - 1) / MOST_RUNS;
    bool one = how->out->background && !how->behind.per_pixel;
    how->behind.run = how->out->network && run > LEAST_RUN ? run : LEAST_RUN;
    how->behind.by = how->out->background;
    how->weights = how->out->network ? moit_network_weights(job->technique) : 0;
    size_t runs = (size_t)runs_of(job, how) + 1;
    if (how->weights) how->network = calloc(runs * (size_t)how->weights, sizeof *how->network);
    if (one) how->behind.by = calloc(3 * runs, sizeof *how->behind.by);
    bool failed = (how->weights && !how->network) || (one && !how->behind.by);
    return failed ? MOIT_NO_MEMORY : MOIT_OK;
}

static void add_up(const double *parts, int64_t runs, int64_t numbers, double *to) {
    for (int64_t k = 0; parts && k < numbers; ++k) {
        to[k] = 0.0;
        for (int64_t i = 0; i < runs; ++i) to[k] += parts[i * numbers + k];
    }
}

static void end_sums(const moit_job *job, pulling *how) {
    int64_t runs = runs_of(job, how);
    add_up(how->network, runs, how->weights, how->out->network);
    free(how->network);
    if (how->behind.by == how->out->background) return;
    add_up(how->behind.by, runs, 3, how->out->background);
    free(how->behind.by);
}

static moit_status ask_tiles(const moit_job *job, pulling *how) {
    return moit_for_tiles_of(job, &(moit_runs){0, how->behind.run}, pull_tile, how);
}

/* Pixels give to the blocks that they read first, then fragments take from theirs. */
static moit_status ask_blocks(const moit_job *job, pulling *how) {
    moit_block_slopes slopes;
    moit_status status = moit_block_slopes_begin(job, &slopes);
    moit_runs strips = moit_block_strips(&slopes);
    how->blocks = &slopes;
    if (status == MOIT_OK) status = moit_for_tiles_of(job, &strips, pull_tile, how);
    if (status == MOIT_OK) {
        moit_block_slopes_join(&slopes);
        status = ask_tiles(job, how);
    }
    moit_block_slopes_end(&slopes);
    return status;
}

static size_t scratch(const moit_job *job, int fragments, int pixels) {
    size_t twin = moit_twin_scratch(job, fragments, pixels);
    size_t single = moit_is_single(job) ? moit_single_scratch(fragments, pixels) : 0;
    return twin > single ? twin : single;
}

static moit_status ask(const moit_fragments *fragments, const moit_technique *technique,
                       bool cull_opaque, pulling *how, const moit_run *run) {
    moit_job job = moit_job_of(fragments, technique, cull_opaque, run);
    const moit_technique_row *row = row_of(technique);
    moit_technique held = *technique;
    if (technique->kind == MOIT_HYBRID && fragments->precision == MOIT_FLOAT32) {
        held.core_alpha = (double)(float)technique->core_alpha; /* as floats are compared */
        job.technique = &held;
    }
    if (technique->kind == MOIT_WEIGHTED_BLENDED) { /* targets move as if they held all digits */
        held.weighted.bits = 32;
        job.technique = &held;
    }
    moit_status status = moit_twin_prepare(&job);
    job.scratch = scratch;
    job.depths = how->depths;
    job.depth = how->depth;
    if (status == MOIT_OK) {
        status = begin_sums(&job, how);
        if (status == MOIT_OK) status = (job.blocks ? ask_blocks : ask_tiles)(&job, how);
        end_sums(&job, how);
    }
    moit_blocks_release(&job);
    if (row->release) row->release(&job);
    return status;
}

moit_status moit_composite_pullback(const moit_fragments *fragments,
                                    const moit_technique *technique, bool cull_opaque,
                                    const double *background, bool background_per_pixel,
                                    const void *seed, const moit_gradients *out,
                                    const moit_run *run) {
    pulling how = {.question = OF_IMAGE,
                   .behind = {.color = background, .per_pixel = background_per_pixel},
                   .seed = seed,
                   .out = out};
    return ask(fragments, technique, cull_opaque, &how, run);
}

moit_status moit_transmittance_pullback(const moit_fragments *fragments,
                                        const moit_technique *technique, bool cull_opaque,
                                        const void *seed, const moit_gradients *out,
                                        const moit_run *run) {
    pulling how = {.question = OF_FRAGMENTS, .seed = seed, .out = out};
    return ask(fragments, technique, cull_opaque, &how, run);
}

moit_status moit_curve_pullback(const moit_fragments *fragments, const moit_technique *technique,
                                bool cull_opaque, int64_t depths, const double *depth,
                                const void *seed, const moit_gradients *out, const moit_run *run) {
    pulling how = {
        .question = OF_CURVES, .seed = seed, .out = out, .depths = depths, .depth = depth};
    return ask(fragments, technique, cull_opaque, &how, run);
}

moit_status moit_total_transmittance_pullback(const moit_fragments *fragments,
                                              const moit_technique *technique, bool cull_opaque,
                                              const void *seed, const moit_gradients *out,
                                              const moit_run *run) {
    pulling how = {.question = OF_TOTALS, .seed = seed, .out = out};
    return ask(fragments, technique, cull_opaque, &how, run);
}
