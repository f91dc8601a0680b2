/* Techniques that keep a few layers of a pixel and make do with them. */
#include "core/techniques/options.h"
#include "core/techniques/table.h"

#include <math.h>
#include <string.h>

/* ---- Depth peeling, the k-buffer and hybrid transparency keep fragments as they are -----------
 */

/* T of the `count` nearest of such as have at least this alpha, tile->total of these alone, and in
 * tile->sums what alpha of all others sums to. */
static void weigh_foremost(const moit_job *job, moit_tile *tile, double least) {
    const void *depth = tile->depth;
    if (least > 0.0) {
        moit_precision precision = job->fragments->precision;
        double low = precision == MOIT_FLOAT32 ? (double)(float)least : least;
        for (int i = 0; i < tile->fragments; ++i)
            moit_set_number(precision, tile->z, i,
                            moit_number(precision, tile->alpha, i) < low
                                ? HUGE_VAL
                                : moit_number(precision, depth, i));
        depth = tile->z;
    }
    job->stages->depth_ranks(tile->pixels, tile->offsets, depth, tile->rank, tile->order);
    job->stages->foremost(job->technique->count, least, tile->pixels, tile->offsets, tile->alpha,
                          tile->rank, tile->order, tile->T, tile->total, tile->sums);
}

/* Everitt 2001: each pass draws what is nearest of what lies behind the pass before, `count` times.
 * Renormalised what all fragments let through is known, too, and those drawn stand for all; where
 * they cover nothing, nothing is. */
static void peeling_weigh(const moit_job *job, moit_tile *tile) {
    weigh_foremost(job, tile, 0.0);
    if (!job->technique->normalize) return;
    job->stages->products(tile->pixels, tile->offsets, tile->alpha, tile->double_b0);
    for (int p = 0; p < tile->pixels; ++p)
        if (tile->total[p] < 1.0) tile->total[p] = tile->double_b0[p];
}

/* What no pass has drawn is not seen. */
static void peeling_resolve(const moit_job *job, moit_tile *tile) {
    peeling_weigh(job, tile);
    for (int p = 0; p < tile->pixels; ++p) tile->sums[p] = 0.0;
    job->stages->tail(job->technique->count, tile->pixels, tile->offsets, tile->rank, tile->sums,
                      tile->T);
    job->stages->blend(tile->pixels, tile->offsets, tile->alpha, tile->emission, tile->T,
                       tile->color, tile->sums);
    for (int p = 0; job->technique->normalize && p < tile->pixels; ++p) {
        double *sum = tile->sums + 4 * p, covers = 1.0 - tile->total[p];
        double scale = sum[3] > 0.0 ? covers / sum[3] : 1.0;
        for (int k = 0; k < 4; ++k) sum[k] *= scale;
    }
}

static void peeling_curve(const moit_job *job, moit_tile *tile) {
    moit_precision precision = job->fragments->precision;
    peeling_weigh(job, tile);
    for (int p = 0; p < tile->pixels; ++p) {
        int start = tile->offsets[p], n = tile->offsets[p + 1] - start;
        int kept = n < job->technique->count ? n : job->technique->count;
        for (int i = start; i < start + n; ++i) tile->order[tile->rank[i]] = i;
        for (int64_t k = 0; k < job->depths; ++k) {
            double through = 1.0;
            for (int i = 0; i < kept; ++i) {
                int at = tile->order[i];
                if (!(moit_number(precision, tile->depth, at) < job->depth[k])) break;
                through *= 1.0 - moit_number(precision, tile->alpha, at);
            }
            moit_set_number(precision, tile->curve, p * job->depths + k, through);
        }
    }
}

/* Bavoil et al. 2007: of k + 1 fragments the farthest goes, over what went before it. */
static void kbuffer_weigh(const moit_job *job, moit_tile *tile) {
    job->stages->kbuffer_ranks(job->technique->count, tile->pixels, tile->offsets, tile->depth,
                               tile->rank);
    job->stages->ranked_transmittance(tile->pixels, tile->offsets, tile->alpha, tile->rank,
                                      tile->order, tile->T, tile->total);
}

/* What the fragments behind the foremost of pixel p cover, but for rounding. */
static double tail_coverage(const moit_job *job, const moit_tile *tile, int p) {
    double covered = 0.0;
    for (int i = tile->offsets[p]; i < tile->offsets[p + 1]; ++i)
        if (tile->rank[i] >= job->technique->count)
            covered += (1.0 - covered) * moit_number(job->fragments->precision, tile->alpha, i);
    return covered;
}

/* Maule et al. 2013: behind the k foremost (of Hahlbohm et al. 2025: of such as have some alpha;
 * all others count as behind them), the others as the weighted average of Bavoil and Myers
 * has them, n layers of the mean opacity in the mean colour; renormalised, what they cover is
 * exact. */
static void hybrid_weigh(const moit_job *job, moit_tile *tile) {
    int layers = job->technique->count;
    weigh_foremost(job, tile, job->technique->core_alpha);
    for (int p = 0; p < tile->pixels; ++p) {
        double sum = tile->sums[p], core = tile->total[p];
        int n = 0;
        for (int i = tile->offsets[p]; i < tile->offsets[p + 1]; ++i) n += tile->rank[i] >= layers;
        double covered = n == 0                      ? 0.0
                         : job->technique->normalize ? fmin(tail_coverage(job, tile, p), sum)
                                                     : moit_averaged_coverage(sum, n);
        tile->total[p] = core * (1.0 - covered);
        tile->sums[p] = sum > 0.0 ? core * (covered / sum) : core;
    }
    job->stages->tail(layers, tile->pixels, tile->offsets, tile->rank, tile->sums, tile->T);
}

/* ---- Adaptive transparency and multi-layer alpha blending blend layers ------------------------
 */

/* A layer's numbers and its step, as if all were double; in buckets once more its numbers, and
 * fragments' depth and alpha. */
static size_t layers_scratch(const moit_job *job, int fragments, int pixels) {
    size_t layers = (size_t)pixels * (size_t)job->technique->count,
           numbers = layers * (MOIT_LAYER_NUMBERS + 2);
    if (job->technique->kind == MOIT_MLAB && job->technique->layers.buckets)
        numbers += layers * MOIT_LAYER_NUMBERS + 2 * (size_t)fragments;
    return numbers * sizeof(double);
}

static char *steps_of(const moit_job *job, const moit_tile *tile) {
    return tile->own
           + (size_t)tile->pixels * (size_t)job->technique->count * MOIT_LAYER_NUMBERS
                 * sizeof(double);
}

/* Fragments' depths as the layers hold them. */
static const void *held_depths(const moit_job *job, moit_tile *tile) {
    bool quantized = job->technique->layers.quantized;
    if (!quantized && job->technique->warp == MOIT_WARP_NONE) return tile->depth;
    job->stages->warp(tile->fragments, tile->depth, &job->warp, tile->z);
    if (quantized) job->stages->words(tile->fragments, tile->z);
    return tile->z;
}

/* The same of the curve's depths. */
static void hold_curve_depths(const moit_job *job, moit_tile *tile) {
    for (int64_t k = 0; k < job->depths; ++k)
        moit_set_number(job->fragments->precision, tile->curve, k, job->depth[k]);
    memcpy(tile->curve_z, tile->curve, (size_t)job->depths * job->scalar);
    bool quantized = job->technique->layers.quantized;
    if (quantized || job->technique->warp != MOIT_WARP_NONE)
        job->stages->warp((int)job->depths, tile->curve, &job->warp, tile->curve_z);
    if (quantized) job->stages->words((int)job->depths, tile->curve_z);
    for (int p = 1; p < tile->pixels; ++p)
        memcpy((char *)tile->curve_z + (size_t)tile->curve_offsets[p] * job->scalar, tile->curve_z,
               (size_t)job->depths * job->scalar);
}

/* Fills the steps and tile->total; returns the fragments' depths as held. */
static const void *adaptive_steps(const moit_job *job, moit_tile *tile) {
    const void *depth = held_depths(job, tile);
    int nodes = job->technique->count;
    char *steps = steps_of(job, tile);
    const moit_layer_options *options = &job->technique->layers;
    job->stages->adaptive(nodes, options->quantized, options->by_energy, tile->pixels,
                          tile->offsets, depth, tile->alpha, steps);
    for (int p = 0; p < tile->pixels; ++p)
        tile->total[p] =
            moit_number(job->fragments->precision, steps, 2 * ((int64_t)(p + 1) * nodes) - 1);
    return depth;
}

static void adaptive_weigh(const moit_job *job, moit_tile *tile) {
    const void *depth = adaptive_steps(job, tile);
    job->stages->steps(job->technique->count, tile->pixels, tile->offsets, depth,
                       steps_of(job, tile), tile->T);
}

static void adaptive_curve(const moit_job *job, moit_tile *tile) {
    adaptive_steps(job, tile);
    hold_curve_depths(job, tile);
    job->stages->steps(job->technique->count, tile->pixels, tile->curve_offsets, tile->curve_z,
                       steps_of(job, tile), tile->curve);
}

static bool mlab_fits(const moit_technique *technique) {
    return !technique->layers.buckets || technique->count > 1;
}

/* Which fragments a bucket has: those in front of the first with front_alpha, or the others up to
 * the first with back_alpha; the rest is as if it were not there. */
static void take_bucket(const moit_job *job, const moit_tile *tile, const void *held, bool front,
                        void *depth, void *alpha) {
    const moit_layer_options *o = &job->technique->layers;
    moit_precision precision = job->fragments->precision;
    for (int p = 0; p < tile->pixels; ++p) {
        double first = HUGE_VAL, last = HUGE_VAL;
        for (int i = tile->offsets[p]; i < tile->offsets[p + 1]; ++i) {
            double own = moit_number(precision, tile->alpha, i),
                   at = moit_number(precision, held, i);
            if (own >= o->front_alpha) first = fmin(first, at);
            if (own >= o->back_alpha) last = fmin(last, at);
        }
        for (int i = tile->offsets[p]; i < tile->offsets[p + 1]; ++i) {
            double at = moit_number(precision, held, i);
            bool there = at <= last && (at < first) == front;
            moit_set_number(precision, depth, i, at);
            moit_set_number(precision, alpha, i,
                            there ? moit_number(precision, tile->alpha, i) : -1.0);
        }
    }
}

/* Kern et al. 2020: one layer for what is faint in front, and multi-layer alpha blending for what
 * is not, so that faint fragments push nothing of that together. */
static void mlab_buckets(const moit_job *job, moit_tile *tile, const void *held,
                         const void *color) {
    const moit_technique *technique = job->technique;
    int layers = technique->count;
    size_t number = MOIT_LAYER_NUMBERS * job->scalar,
           all = (size_t)tile->pixels * (size_t)layers * MOIT_LAYER_NUMBERS * sizeof(double);
    char *state = steps_of(job, tile) + (size_t)tile->pixels * (size_t)layers * 2 * sizeof(double);
    char *depth = state + all, *alpha = depth + (size_t)tile->fragments * sizeof(double);
    for (int front = 1; front >= 0; --front) {
        int few = front ? 1 : layers - 1;
        take_bucket(job, tile, held, front, depth, alpha);
        job->stages->mlab(few, technique->layers.quantized, false, tile->pixels, tile->offsets,
                          depth, alpha, color, technique->layers.min_alpha, state);
        for (int p = 0; p < tile->pixels; ++p)
            memcpy((char *)tile->own + ((size_t)(p * layers) + !front) * number,
                   state + (size_t)(p * few) * number, (size_t)few * number);
    }
}

static const void *mlab_layers(const moit_job *job, moit_tile *tile, const void *color) {
    const moit_technique *technique = job->technique;
    const void *depth = held_depths(job, tile);
    if (technique->layers.buckets) {
        mlab_buckets(job, tile, depth, color);
        return depth;
    }
    job->stages->mlab(technique->count, technique->layers.quantized, technique->layers.by_energy,
                      tile->pixels, tile->offsets, depth, tile->alpha, color,
                      technique->layers.min_alpha, tile->own);
    return depth;
}

/* One layer over the other, from the front. */
static void mlab_resolve(const moit_job *job, moit_tile *tile) {
    moit_precision precision = job->fragments->precision;
    mlab_layers(job, tile, tile->color);
    int64_t at = 0;
    for (int p = 0; p < tile->pixels; ++p) {
        double through = 1.0, sum[3] = {0.0};
        for (int i = 0; i < job->technique->count; ++i, at += MOIT_LAYER_NUMBERS) {
            for (int c = 0; c < 3; ++c)
                sum[c] += through * moit_number(precision, tile->own, at + 1 + c);
            through *= moit_number(precision, tile->own, at + 4);
        }
        memcpy(tile->sums + 4 * p, sum, sizeof sum);
        tile->sums[4 * p + 3] = 1.0 - through;
        tile->total[p] = through;
    }
}

static bool mlab_overflows(const moit_job *job, const moit_tile *tile, int p) {
    if (!job->technique->layers.quantized) return false;
    int count = job->technique->count;
    moit_precision precision = job->fragments->precision;
    bool over = false;
    for (int64_t i = (int64_t)p * count; i < (int64_t)(p + 1) * count; ++i)
        for (int c = 1; c <= 3; ++c)
            over |= fabs(moit_number(precision, tile->own, MOIT_LAYER_NUMBERS * i + c))
                    >= MOIT_MOST_HALF;
    return over;
}

static const void *mlab_steps(const moit_job *job, moit_tile *tile) {
    moit_precision precision = job->fragments->precision;
    const void *depth = mlab_layers(job, tile, NULL);
    char *steps = steps_of(job, tile);
    int64_t at = 0, step = 0;
    for (int p = 0; p < tile->pixels; ++p) {
        double through = 1.0;
        for (int i = 0; i < job->technique->count; ++i, at += MOIT_LAYER_NUMBERS, step += 2) {
            through *= moit_number(precision, tile->own, at + 4);
            moit_set_number(precision, steps, step, moit_number(precision, tile->own, at));
            moit_set_number(precision, steps, step + 1, through);
        }
        tile->total[p] = through;
    }
    return depth;
}

static void mlab_weigh(const moit_job *job, moit_tile *tile) {
    const void *depth = mlab_steps(job, tile);
    job->stages->steps(job->technique->count, tile->pixels, tile->offsets, depth,
                       steps_of(job, tile), tile->T);
}

static void mlab_curve(const moit_job *job, moit_tile *tile) {
    mlab_steps(job, tile);
    hold_curve_depths(job, tile);
    job->stages->steps(job->technique->count, tile->pixels, tile->curve_offsets, tile->curve_z,
                       steps_of(job, tile), tile->curve);
}

const moit_technique_row moit_depth_peeling_row = {.name = "depth-peeling",
                                                   OPTIONS(COUNT, NORMALIZE),
                                                   .thick = MOIT_THICK_MIDDLE,
                                                   .usual_counts = (const int[]){4, 0},
                                                   .least_count = 1,
                                                   .most_count = MOIT_MOST_LAYERS,
                                                   .weigh = peeling_weigh,
                                                   .pull_back = moit_peeling_pull_back,
                                                   .see = moit_peeling_see,
                                                   .unsee = moit_peeling_unsee,
                                                   .curve = peeling_curve,
                                                   .resolve = peeling_resolve,
                                                   .by_channel = true,
                                                   .arrival = MOIT_TIES_IN_ORDER,
                                                   .ties = MOIT_TIES_EARLIER,
                                                   .exact_counts = true,
                                                   .passes_count = true};

/* Of what merges neighbours where there is one too many. */
#define MERGING WARP, TRUTH("quantized", layers.quantized), TRUTH("by_energy", layers.by_energy)

const moit_technique_row moit_adaptive_row = {.name = "adaptive",
                                              OPTIONS(COUNT, NORMALIZE, MERGING),
                                              .thick = MOIT_THICK_MIDDLE,
                                              .usual_counts = (const int[]){4, 0},
                                              .least_count = 2,
                                              .most_count = MOIT_MOST_LAYERS,
                                              .weigh = adaptive_weigh,
                                              .curve = adaptive_curve,
                                              .scratch = layers_scratch,
                                              .unit_range = {0.0, 1.0},
                                              .uses_warp = true,
                                              .exceeds = true,
                                              .renormalizes = true,
                                              .arrival = MOIT_IN_ORDER,
                                              .geometry_passes = 2};

const moit_technique_row moit_mlab_row = {
    .name = "mlab",
    OPTIONS(COUNT, MERGING, NUMBER("min_alpha", layers.min_alpha), TRUTH("buckets", layers.buckets),
            NUMBER("front_alpha", layers.front_alpha), NUMBER("back_alpha", layers.back_alpha)),
    .fits = mlab_fits,
    .thick = MOIT_THICK_MIDDLE,
    .usual_counts = (const int[]){2, 4, 6, 0},
    .least_count = 1,
    .most_count = MOIT_MOST_LAYERS,
    .weigh = mlab_weigh,
    .overflows = mlab_overflows,
    .curve = mlab_curve,
    .resolve = mlab_resolve,
    .scratch = layers_scratch,
    .unit_range = {0.0, 1.0},
    .uses_warp = true,
    .arrival = MOIT_IN_ORDER,
    .ties = MOIT_TIES_LATER,
    .geometry_passes = 1};

const moit_technique_row moit_kbuffer_row = {.name = "kbuffer",
                                             OPTIONS(COUNT),
                                             .thick = MOIT_THICK_MIDDLE,
                                             .usual_counts = (const int[]){4, 0},
                                             .least_count = 1,
                                             .most_count = MOIT_MOST_LAYERS,
                                             .weigh = kbuffer_weigh,
                                             .pull_back = moit_sorted_pull_back,
                                             .by_channel = true,
                                             .arrival = MOIT_IN_ORDER,
                                             .ties = MOIT_TIES_EARLIER,
                                             .exact_up_to = 1,
                                             .exact_counts = true,
                                             .geometry_passes = 1};

const moit_technique_row moit_hybrid_row = {
    .name = "hybrid",
    OPTIONS(COUNT, NORMALIZE, NUMBER("core_alpha", core_alpha)),
    .thick = MOIT_THICK_MIDDLE,
    .usual_counts = (const int[]){4, 0},
    .least_count = 1,
    .most_count = MOIT_MOST_LAYERS,
    .weigh = hybrid_weigh,
    .pull_back = moit_hybrid_pull_back,
    .by_channel = true,
    .arrival = MOIT_TIES_IN_ORDER,
    .ties = MOIT_TIES_EARLIER,
    .exact_up_to = 1,
    .exact_counts = true,
    .geometry_passes = 2};
