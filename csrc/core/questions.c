/* The questions of moit.h, each asked of a technique tile by tile. */
#include "core/alone.h"
#include "core/techniques/table.h"

#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

static const moit_technique_row *row_of(const moit_job *job) {
    return moit_technique_rows[job->technique->kind];
}

static moit_status ask(moit_job *job, void (*answer)(const moit_job *, moit_tile *, void *),
                       void *context) {
    const moit_technique_row *row = row_of(job);
    moit_status status = row->prepare ? row->prepare(job) : MOIT_OK;
    if (status == MOIT_OK) status = moit_blocks_prepare(job);
    if (status == MOIT_OK) status = moit_for_tiles(job, answer, context);
    moit_blocks_release(job);
    if (row->release) row->release(job);
    return status;
}

static bool opaque_at(const moit_tile *tile, int p) { return tile->opaque && tile->opaque[p] >= 0; }

/* ---- Images ---------------------------------------------------------------------------------- */

typedef struct {
    const double *background;
    bool per_pixel;
    char *out;
    atomic_bool *again; /* becomes true where a pixel's alpha is LOOK_AGAIN */
} image;

/* Fills tile->sums and tile->total from tile->alpha and emission. */
static void sum_up(const moit_job *job, moit_tile *tile) {
    const moit_technique_row *row = row_of(job);
    if (row->resolve) {
        row->resolve(job, tile);
        return;
    }
    if (row->weigh_and_blend) {
        row->weigh_and_blend(job, tile);
        return;
    }
    row->weigh(job, tile);
    (row->blend ? row->blend : moit_blend)(job, tile);
}

static void find_total(const moit_job *job, moit_tile *tile) {
    const moit_technique_row *row = row_of(job);
    (row->total ? row->total : row->weigh)(job, tile);
}

/* Fills tile->channel_total, with each channel's opacities for alpha, and if it `sums` up
 * tile->channel_sum. */
static void ask_channels(const moit_job *job, moit_tile *tile, bool sums) {
    const void *net = tile->alpha;
    for (int c = 0; c < 3; ++c) {
        double *total = tile->channel_total + c * tile->pixels,
               *sum = tile->channel_sum + c * tile->pixels;
        tile->alpha = tile->opacity[c];
        (sums ? sum_up : find_total)(job, tile);
        for (int p = 0; p < tile->pixels; ++p) total[p] = tile->total[p];
        for (int p = 0; sums && p < tile->pixels; ++p) sum[p] = tile->sums[4 * p + c];
    }
    tile->alpha = net;
}

static bool is_grey(const moit_job *job, const moit_tile *tile, int p) {
    moit_precision precision = job->fragments->precision;
    for (int i = tile->offsets[p]; i < tile->offsets[p + 1]; ++i)
        for (int c = 0; c < 3; ++c)
            if (moit_number(precision, tile->opacity[c], i)
                != moit_number(precision, tile->alpha, i))
                return false;
    return true;
}

/* The same for techniques whose state is one total absorbance or the like: channels that differ are
 * multiplied up beside it, as they would be in a render target. Needs tile->total. */
static void multiply_channels(const moit_job *job, moit_tile *tile) {
    for (int c = 0; c < 3; ++c)
        job->stages->products(tile->pixels, tile->offsets, tile->opacity[c],
                              tile->channel_total + c * tile->pixels);
    for (int p = 0; p < tile->pixels; ++p)
        if (is_grey(job, tile, p))
            for (int c = 0; c < 3; ++c) tile->channel_total[c * tile->pixels + p] = tile->total[p];
}

/* Fills tile->total and, with transmission, tile->channel_total. */
static void find_totals(const moit_job *job, moit_tile *tile) {
    bool coloured = tile->opacity[0], reconstructs = row_of(job)->reconstructs;
    if (coloured && !reconstructs) ask_channels(job, tile, false);
    find_total(job, tile);
    if (coloured && reconstructs) multiply_channels(job, tile);
}

/* The same, and fills tile->sums. */
static void sum_up_channels(const moit_job *job, moit_tile *tile) {
    const moit_technique_row *row = row_of(job);
    bool coloured = tile->opacity[0];
    if (coloured && row->by_channel) {
        ask_channels(job, tile, true);
        for (int p = 0; p < tile->pixels; ++p)
            for (int c = 0; c < 3; ++c)
                tile->sums[4 * p + c] = tile->channel_sum[c * tile->pixels + p];
    } else {
        if (coloured && !row->reconstructs) ask_channels(job, tile, false);
        sum_up(job, tile);
        if (coloured && row->reconstructs) multiply_channels(job, tile);
    }
}

/* What the pixel lets through in channel c, and of their mean: theirs where they agree. */
static double total_at(const moit_tile *tile, int p, int c) {
    return tile->opacity[0] ? tile->channel_total[c * tile->pixels + p] : tile->total[p];
}

static double mean_total(const moit_tile *tile, int p) {
    if (!tile->opacity[0]) return tile->total[p];
    double red = total_at(tile, p, 0);
    return red + ((total_at(tile, p, 1) - red) + (total_at(tile, p, 2) - red)) / 3.0;
}

/* ---- Weights that underflow ------------------------------------------------------------------ */

/* How colours are scaled whose weights do not sum to what is covered. */
static int scaling_of(const moit_job *job) {
    const moit_technique_row *row = row_of(job);
    if (job->technique->normalize && (row->reconstructs || row->renormalizes)) return SCALE_ALL;
    return row->exceeds ? SCALE_EXCESS : SCALE_NOT;
}

/* Whether the technique's T is exp(-x), and it can be asked for x. */
static bool absorbs(const moit_job *job) {
    return row_of(job)->absorbs && row_of(job)->absorbs(job->technique);
}

/* Whether the weights of a pixel, which covers something, are nothing, or next to it where they are
 * what is left of some of them. */
static bool has_lost_weights(const moit_job *job, const moit_tile *tile, int p) {
    double least = job->fragments->precision == MOIT_FLOAT64 ? ldexp(1.0, -WEIGHTS_LOST_DOUBLE)
                                                             : ldexp(1.0, -WEIGHTS_LOST_SINGLE),
           sum = tile->sums[4 * p + 3];
    /* next to nothing either way is too little to be made as much as is covered */
    if (!absorbs(job)) least = ldexp(1.0, -WEIGHTS_LOST_DOUBLE);
    return tile->total[p] < 0.5 && sum < least;
}

/* Whether pixels that have lost their weights are asked about again in double. State of blocks is
 * not to be had for single pixels, nor are samples. */
static bool is_asked_again(const moit_job *job) {
    return job->fragments->precision == MOIT_FLOAT32 && !job->prepared && !job->blocks
           && !row_of(job)->is_random;
}

/* The same of what has kept them: of a total absorbance in the thousands, which lets nothing
 * through even in double, what float rounds off moments or coefficients is too much. */
static bool is_too_thick(const moit_job *job, const moit_tile *tile, int p) {
    return tile->total[p] == 0.0 && absorbs(job) && is_asked_again(job);
}

/* Of pixels whose weights are lost, tile->sums with weights relative to the greatest; where all
 * that is known of these is that they are nothing, with equal ones. */
static void weigh_relatively(const moit_job *job, moit_tile *tile) {
    moit_precision precision = job->fragments->precision;
    bool relative = absorbs(job), asked = false;
    for (int p = 0; p < tile->pixels; ++p) {
        int first = tile->offsets[p], n = tile->offsets[p + 1] - first;
        if (!has_lost_weights(job, tile, p)) continue;
        if (relative && !asked) {
            tile->absorbed = asked = true;
            row_of(job)->weigh(job, tile);
            tile->absorbed = false;
        }
        double least = __builtin_inf();
        for (int i = first; relative && i < first + n; ++i)
            if (moit_number(precision, tile->alpha, i) > 0.0)
                least = fmin(least, moit_number(precision, tile->T, i));
        for (int i = first; i < first + n; ++i) {
            double more = relative ? moit_number(precision, tile->T, i) - least : 0.0;
            moit_set_number(precision, tile->T, i, fmax(more, 0.0));
        }
        char *T = (char *)tile->T + (size_t)first * job->scalar;
        job->stages->decay(n, T, T);
        job->stages->blend(1, tile->offsets + p, tile->alpha, tile->emission, tile->T, tile->color,
                           tile->sums + 4 * p);
    }
}

/* Mends sums of lost weights, or marks those pixels of `out` that are to be looked at again. */
static void find_lost_weights(const moit_job *job, moit_tile *tile, bool *marks) {
    /* mostly none has: the greatest weight that any technique calls lost is asked first */
    const double least = ldexp(1.0, -WEIGHTS_LOST_SINGLE);
    int some = 0;
    for (int p = 0; p < tile->pixels; ++p)
        some |=
            (tile->total[p] < 0.5) & ((tile->sums[4 * p + 3] < least) | (tile->total[p] == 0.0));
    for (int p = 0; some && p < tile->pixels; ++p) {
        if (!has_lost_weights(job, tile, p) && !is_too_thick(job, tile, p)) continue;
        if (is_asked_again(job)) *marks = true;
        else weigh_relatively(job, tile);
        return;
    }
}

static void mark_lost_weights(const moit_job *job, const moit_tile *tile, const image *to) {
    for (int p = 0; p < tile->pixels; ++p)
        if (has_lost_weights(job, tile, p) || is_too_thick(job, tile, p))
            moit_set_number(job->fragments->precision, to->out, 4 * moit_pixel_at(tile, p) + 3,
                            LOOK_AGAIN);
    atomic_store(to->again, true);
}

/* Needs what summing up has left. */
static void count_overflows(const moit_job *job, const moit_tile *tile) {
    int64_t count = 0;
    if (!job->run->overflows || !row_of(job)->overflows) return;
    for (int p = 0; p < tile->pixels; ++p)
        count += tile->offsets[p] < tile->offsets[p + 1] && row_of(job)->overflows(job, tile, p);
    __atomic_fetch_add(job->run->overflows, count, __ATOMIC_RELAXED);
}

/* From tile->sums and totals. */
static void write_pixels(const moit_job *job, const moit_tile *tile, int scaling, const image *to) {
    moit_precision precision = job->fragments->precision;
    for (int p = 0; p < tile->pixels; ++p) {
        const double *sum = tile->sums + 4 * p;
        int64_t pixel = moit_pixel_at(tile, p);
        double scale = 1.0;
        double covers = 1.0 - tile->total[p];
        /* what covers nothing may emit all the same */
        if (scaling == SCALE_ALL && sum[3] > 0.0) scale = covers / sum[3];
        if (scaling == SCALE_EXCESS && sum[3] - covers > 0x1p-15) scale = covers / sum[3];
        for (int c = 0; c < 3; ++c) {
            double behind = opaque_at(tile, p)
                                ? moit_number(precision, job->fragments->color,
                                              3 * (tile->first_fragment + tile->opaque[p]) + c)
                                : to->background[to->per_pixel ? 3 * pixel + c : c];
            moit_set_number(precision, to->out, 4 * pixel + c,
                            total_at(tile, p, c) * behind + scale * sum[c]);
        }
        moit_set_number(precision, to->out, 4 * pixel + 3,
                        opaque_at(tile, p) ? 1.0 : 1.0 - mean_total(tile, p));
    }
}

static void composite_tile(const moit_job *job, moit_tile *tile, void *context) {
    const image *to = context;
    int scaling = scaling_of(job);
    bool marks = false;
    const double *background = to->background + (to->per_pixel ? 3 * tile->first_pixel : 0);
    char *out = to->out + (size_t)(4 * tile->first_pixel) * job->scalar;
    if (tile->pixels < tile->cut)
        job->stages->over(tile->cut, NULL, NULL, NULL, SCALE_NOT, background, to->per_pixel, out);
    if (moit_takes_alone(job)) moit_composite_alone(job, tile, background, to->per_pixel, out);
    if (tile->pixels == 0) return;
    sum_up_channels(job, tile);
    count_overflows(job, tile);
    if (scaling == SCALE_ALL) find_lost_weights(job, tile, &marks);
    if (tile->opaque || tile->opacity[0]) write_pixels(job, tile, scaling, to);
    else
        job->stages->over(tile->pixels, tile->place, tile->total, tile->sums, scaling, background,
                          to->per_pixel, out);
    if (marks) mark_lost_weights(job, tile, to);
}

/* Numbers of float arrays as doubles, from the fragments of one pixel after the other. */
static void widen_pixels(const float *from, int64_t width, const moit_fragments *f, int64_t count,
                         const int64_t *pixel, double *to) {
    for (int64_t k = 0; k < count; ++k)
        for (int64_t i = width * f->offsets[pixel[k]]; i < width * f->offsets[pixel[k] + 1]; ++i)
            *to++ = (double)from[i];
}

/* Asks again, in double, of those pixels whose alpha is LOOK_AGAIN. */
static moit_status look_again(const moit_fragments *f, const moit_technique *technique,
                              bool cull_opaque, const image *to, const moit_run *run) {
    float *out = (float *)(void *)to->out;
    int64_t count = 0, n = 0;
    for (int64_t p = 0; p < f->pixels; ++p)
        if (out[4 * p + 3] == (float)LOOK_AGAIN) {
            ++count;
            n += f->offsets[p + 1] - f->offsets[p];
        }
    size_t per_fragment = f->transmission ? 8 : 5, per_pixel = 4 + 3 + 2;
    char *memory = malloc(((size_t)n * per_fragment + (size_t)count * per_pixel + 1) * 8);
    if (!memory) return MOIT_NO_MEMORY;
    double *depth = (double *)(void *)memory, *alpha = depth + n, *color = alpha + n,
           *transmission = color + 3 * n, *behind = depth + (int64_t)per_fragment * n,
           *found = behind + 3 * count;
    int64_t *pixel = (int64_t *)(void *)(found + 4 * count), *offsets = pixel + count;
    offsets[0] = 0;
    for (int64_t p = 0, k = 0; p < f->pixels; ++p) {
        if (out[4 * p + 3] != (float)LOOK_AGAIN) continue;
        pixel[k] = p;
        memcpy(behind + 3 * k, to->background + (to->per_pixel ? 3 * p : 0), 3 * sizeof *behind);
        offsets[k + 1] = offsets[k] + f->offsets[p + 1] - f->offsets[p];
        ++k;
    }
    widen_pixels(f->depth, 1, f, count, pixel, depth);
    widen_pixels(f->alpha, 1, f, count, pixel, alpha);
    if (f->color) widen_pixels(f->color, 3, f, count, pixel, color);
    if (f->transmission) widen_pixels(f->transmission, 3, f, count, pixel, transmission);
    moit_fragments some = {.precision = MOIT_FLOAT64,
                           .pixels = count,
                           .offsets = offsets,
                           .depth = depth,
                           .alpha = alpha,
                           .color = f->color ? color : NULL,
                           .transmission = f->transmission ? transmission : NULL,
                           .near = f->near,
                           .far = f->far};
    moit_technique precise = *technique;
    if (moit_technique_rows[technique->kind]->moments
        && technique->moments.bias == moit_default_bias(technique, MOIT_FLOAT32))
        precise.moments.bias = moit_default_bias(technique, MOIT_FLOAT64);
    moit_run again = *run;
    again.overflows = NULL; /* they have been counted */
    moit_status status = moit_composite(&some, &precise, cull_opaque, behind, true, found, &again);
    for (int64_t k = 0; status == MOIT_OK && k < 4 * count; ++k)
        out[4 * pixel[k / 4] + k % 4] = (float)found[k];
    free(memory);
    return status;
}

moit_status moit_composite(const moit_fragments *fragments, const moit_technique *technique,
                           bool cull_opaque, const double *background, bool background_per_pixel,
                           void *out, const moit_run *run) {
    moit_job job = moit_job_of(fragments, technique, cull_opaque, run);
    atomic_bool again = false;
    image to = {background, background_per_pixel, out, &again};
    job.skips_empty = true;
    moit_status status = ask(&job, composite_tile, &to);
    return status == MOIT_OK && atomic_load(&again)
               ? look_again(fragments, technique, cull_opaque, &to, run)
               : status;
}

static void total_of_tile(const moit_job *job, moit_tile *tile, void *out) {
    int channels = tile->opacity[0] ? 3 : 1;
    find_totals(job, tile);
    for (int p = 0; p < tile->pixels; ++p)
        for (int c = 0; c < channels; ++c)
            moit_set_number(job->fragments->precision, out, (tile->first_pixel + p) * channels + c,
                            opaque_at(tile, p) ? 0.0 : total_at(tile, p, c));
}

moit_status moit_total_transmittance(const moit_fragments *fragments,
                                     const moit_technique *technique, bool cull_opaque, void *out,
                                     const moit_run *run) {
    moit_job job = moit_job_of(fragments, technique, cull_opaque, run);
    return ask(&job, total_of_tile, out);
}

/* ---- Transmittance --------------------------------------------------------------------------- */

/* Results of the surviving fragments go back to where the fragments came from: 0 behind the opaque
 * surface, and for that surface what its pixel lets through in front of it. */
static void give_fragments(const moit_job *job, const moit_tile *tile, const void *T, void *out_) {
    moit_precision precision = job->fragments->precision;
    char *out = (char *)out_ + (size_t)tile->first_fragment * job->scalar;
    if (!tile->source) {
        memcpy(out, T, (size_t)tile->fragments * job->scalar);
        return;
    }
    memset(out, 0, (size_t)tile->given * job->scalar);
    for (int i = 0; i < tile->fragments; ++i)
        moit_set_number(precision, out, tile->source[i], moit_number(precision, T, i));
    for (int p = 0; p < tile->pixels; ++p)
        if (opaque_at(tile, p)) moit_set_number(precision, out, tile->opaque[p], tile->total[p]);
}

moit_known_range moit_known_range_of(const moit_job *job, const moit_tile *tile, int p) {
    moit_precision precision = job->fragments->precision;
    double near = job->fragments->near, far = job->fragments->far, opaque = __builtin_inf();
    if (opaque_at(tile, p))
        opaque =
            moit_number(precision, job->fragments->depth, tile->first_fragment + tile->opaque[p]);
    if (row_of(job)->reconstructs && job->technique->range_per_pixel
        && tile->offsets[p] < tile->offsets[p + 1]) {
        moit_warp_map map = moit_pixel_warp(job, tile, p);
        near = map.near;
        far = map.far;
    }
    moit_widen_range(job, tile, p, &near, &far);
    if (precision == MOIT_FLOAT64) return (moit_known_range){near, far, opaque};
    /* fragments may lie beyond the ends by these ends' rounding */
    near = fmin(near, (double)(float)near);
    far = fmax(far, (double)(float)far);
    return (moit_known_range){near, far, opaque};
}

static void give_curve(const moit_job *job, const moit_tile *tile, const void *curve, void *out) {
    moit_precision precision = job->fragments->precision;
    for (int p = 0; p < tile->pixels; ++p) {
        moit_known_range range = moit_known_range_of(job, tile, p);
        for (int64_t k = 0; k < job->depths; ++k) {
            double depth = job->depth[k], T = moit_number(precision, curve, p * job->depths + k);
            if (depth > range.far) T = tile->total[p];
            if (depth < range.near) T = 1.0;
            if (depth > range.opaque) T = 0.0;
            moit_set_number(precision, out, (tile->first_pixel + p) * job->depths + k, T);
        }
    }
}

static void transmittance_of_tile(const moit_job *job, moit_tile *tile, void *out) {
    row_of(job)->weigh(job, tile);
    give_fragments(job, tile, tile->T, out);
}

moit_status moit_transmittance(const moit_fragments *fragments, const moit_technique *technique,
                               bool cull_opaque, void *out, const moit_run *run) {
    moit_job job = moit_job_of(fragments, technique, cull_opaque, run);
    return ask(&job, transmittance_of_tile, out);
}

static void curve_of_tile(const moit_job *job, moit_tile *tile, void *out) {
    row_of(job)->curve(job, tile);
    give_curve(job, tile, tile->curve, out);
}

moit_status moit_curve(const moit_fragments *fragments, const moit_technique *technique,
                       bool cull_opaque, int64_t depths, const double *depth, void *out,
                       const moit_run *run) {
    moit_job job = moit_job_of(fragments, technique, cull_opaque, run);
    job.depths = depths;
    job.depth = depth;
    return depths ? ask(&job, curve_of_tile, out) : MOIT_OK;
}

/* ---- Networks -------------------------------------------------------------------------------- */

static void features_of_tile(const moit_job *job, moit_tile *tile, void *out_) {
    int columns = moit_network_columns(job->technique);
    double *out = (double *)out_ + tile->first_fragment * columns;
    int64_t stride = tile->fragments + MOIT_PADDING;
    row_of(job)->features(job, tile, stride, tile->own);
    memset(out, 0, (size_t)tile->given * (size_t)columns * sizeof *out);
    for (int i = 0; i < tile->fragments; ++i)
        for (int k = 0; k < columns; ++k)
            out[(int64_t)(tile->source ? tile->source[i] : i) * columns + k] =
                moit_number(job->fragments->precision, tile->own, k * stride + i);
}

moit_status moit_network_features(const moit_fragments *fragments, const moit_technique *technique,
                                  bool cull_opaque, double *out, const moit_run *run) {
    moit_job job = moit_job_of(fragments, technique, cull_opaque, run);
    return ask(&job, features_of_tile, out);
}

/* ---- State ----------------------------------------------------------------------------------- */

typedef struct {
    char *b0, *b;
    uint16_t *words;
} state;

static void gather_tile(const moit_job *job, moit_tile *tile, void *context) {
    const state *to = context;
    size_t numbers = (size_t)moit_moment_numbers(job->technique), row = numbers * job->scalar;
    const moit_moment_family *family = moit_family_of(job->technique);
    (family->state ? family->state : moit_moments_gather)(job, tile);
    memcpy(to->b0 + (size_t)tile->first_pixel * job->scalar, tile->b0,
           (size_t)tile->pixels * job->scalar);
    if (to->b) memcpy(to->b + (size_t)tile->first_pixel * row, tile->b, (size_t)tile->pixels * row);
    if (to->words)
        memcpy(to->words + (size_t)tile->first_pixel * numbers, moit_moment_words(tile),
               (size_t)tile->pixels * numbers * sizeof *to->words);
}

moit_status moit_gather(const moit_fragments *fragments, const moit_technique *technique,
                        bool cull_opaque, void *b0, void *b, const moit_run *run) {
    moit_job job = moit_job_of(fragments, technique, cull_opaque, run);
    state to = {b0, b, NULL};
    return ask(&job, gather_tile, &to);
}

moit_status moit_gather_words(const moit_fragments *fragments, const moit_technique *technique,
                              bool cull_opaque, void *b0, uint16_t *words, const moit_run *run) {
    moit_job job = moit_job_of(fragments, technique, cull_opaque, run);
    state to = {b0, NULL, words};
    return ask(&job, gather_tile, &to);
}

/* ---- Bounds ---------------------------------------------------------------------------------- */

typedef struct {
    void *lower, *upper;
} interval;

static void bounds_of_tile(const moit_job *job, moit_tile *tile, void *context) {
    const interval *to = context;
    moit_precision precision = job->fragments->precision;
    double *lower = tile->bounds[0], *upper = tile->bounds[1];
    /* words and half floats are rounded at every fragment, states of blocks are of other pixels,
     * too: they prove nothing */
    bool rounded = moit_stores_words(job->technique) || moit_stores_halves(job->technique);
    bool proves = !rounded && !job->blocks;
    if (row_of(job)->bounds && proves) row_of(job)->bounds(job, tile, lower, upper);
    else moit_total_bounds(job, tile, lower, upper);
    int64_t first = job->depths ? tile->first_pixel * job->depths : tile->first_fragment;
    if (!job->depths) {
        for (int i = 0; tile->source && i < tile->given; ++i) /* behind the opaque surface */
            moit_set_bounds(precision, to->lower, to->upper, first + i, 0.0, 0.0);
        for (int i = 0; i < tile->fragments; ++i)
            moit_set_bounds(precision, to->lower, to->upper,
                            first + (tile->source ? tile->source[i] : i), lower[i], upper[i]);
        for (int p = 0; p < tile->pixels; ++p)
            if (opaque_at(tile, p)) {
                double low, high;
                moit_bounds_of_total(tile, p, &low, &high);
                moit_set_bounds(precision, to->lower, to->upper, first + tile->opaque[p], low,
                                high);
            }
        return;
    }
    for (int p = 0; p < tile->pixels; ++p) {
        moit_known_range range = moit_known_range_of(job, tile, p);
        for (int64_t k = 0, i = p * job->depths; k < job->depths; ++k, ++i) {
            double depth = job->depth[k], low = lower[i], high = upper[i];
            if (depth > range.far) moit_bounds_of_total(tile, p, &low, &high);
            if (depth < range.near) low = high = 1.0;
            if (depth > range.opaque) low = high = 0.0;
            moit_set_bounds(precision, to->lower, to->upper, first + i, low, high);
        }
    }
}

moit_status moit_bounds(const moit_fragments *fragments, const moit_technique *technique,
                        bool cull_opaque, void *lower, void *upper, const moit_run *run) {
    moit_job job = moit_job_of(fragments, technique, cull_opaque, run);
    interval to = {lower, upper};
    return ask(&job, bounds_of_tile, &to);
}

moit_status moit_curve_bounds(const moit_fragments *fragments, const moit_technique *technique,
                              bool cull_opaque, int64_t depths, const double *depth, void *lower,
                              void *upper, const moit_run *run) {
    moit_job job = moit_job_of(fragments, technique, cull_opaque, run);
    interval to = {lower, upper};
    job.depths = depths;
    job.depth = depth;
    return depths ? ask(&job, bounds_of_tile, &to) : MOIT_OK;
}
