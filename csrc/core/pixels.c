/* Pixels one by one, for those who choose a technique for each: what a cheap pass knows of them,
 * the fragments of some, and between which colours the exact one must lie. */
#include "core/elementary.h"
#include "core/threads.h"
#include "core/tile.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- What a cheap pass knows ----------------------------------------------------------------- */

/* Over a pixel's absorbance. */
typedef struct {
    double weight, depth, color[3];
} means;

static double absorbance_of(double alpha, double max_alpha) {
    return -moit_log1p(-(alpha < max_alpha ? alpha : max_alpha));
}

static double color_at(const moit_job *job, const moit_tile *tile, int i, int c) {
    return tile->color ? moit_number(job->fragments->precision, tile->color, 3 * (int64_t)i + c)
                       : 0.0;
}

static double most_of(double a, double b, double c) { return fmax(a, fmax(b, c)); }

/* A power of two, with which numbers up to `most` are such that their fourth powers are numbers, as
 * are those of the digits that they differ in: 1 where they are. */
static double unit_for(double most) {
    return most > 0x1p200 || most < 0x1p-200 ? ldexp(1.0, -ilogb(fmax(most, 0x1p-1000))) : 1.0;
}

/* x / d^n, also where d^n is too small for a number; as much as a number can be. */
static double over_power(double x, double d, int n) {
    double power = d;
    for (int k = 1; k < n; ++k) power *= d;
    double quotient = x / power;
    if (power < DBL_MIN) {
        quotient = x;
        for (int k = 0; k < n; ++k) quotient /= d;
    }
    return fmin(fmax(quotient, -DBL_MAX), DBL_MAX);
}

/* What was reckoned in units of 1 / unit, as much as a number can be. */
static double as_held(double x, double unit) { return fmin(x / unit, DBL_MAX); }

static void note_pixel(const moit_job *job, const moit_tile *tile, int p, double *fact) {
    moit_precision precision = job->fragments->precision;
    int first = tile->offsets[p], end = tile->offsets[p + 1];
    double alphas = 0.0, passed = 1.0, most_alpha = 0.0, tint = 0.0;
    double low[3] = {__builtin_inf(), __builtin_inf(), __builtin_inf()}, high[3];
    for (int c = 0; c < 3; ++c) high[c] = -low[c];
    means mean = {.weight = 0.0};
    double farthest = 0.0, brightest = 0.0;
    for (int i = first; i < end; ++i) {
        farthest = fmax(farthest, fabs(moit_number(precision, tile->depth, i)));
        for (int c = 0; c < 3; ++c) brightest = fmax(brightest, fabs(color_at(job, tile, i, c)));
    }
    double near_unit = unit_for(farthest), bright_unit = unit_for(brightest);
    for (int i = first; i < end; ++i) {
        double alpha = moit_number(precision, tile->alpha, i),
               depth = moit_number(precision, tile->depth, i) * near_unit,
               weight = absorbance_of(alpha, job->max_alpha);
        alphas += alpha;
        passed *= 1.0 - alpha;
        most_alpha = fmax(most_alpha, alpha);
        mean.weight += weight;
        double share = mean.weight > 0.0 ? weight / mean.weight : 0.0;
        mean.depth += share * (depth - mean.depth);
        for (int c = 0; c < 3; ++c) {
            double color = color_at(job, tile, i, c) * bright_unit;
            low[c] = fmin(low[c], color);
            high[c] = fmax(high[c], color);
            mean.color[c] += share * (color - mean.color[c]);
            if (tile->opacity[0]) tint += fabs(moit_number(precision, tile->opacity[c], i) - alpha);
        }
    }
    double second = 0.0, third = 0.0, fourth = 0.0, spread[3] = {0}, slope[3] = {0},
           curvature[3] = {0};
    for (int i = first; i < end; ++i) {
        double share = absorbance_of(moit_number(precision, tile->alpha, i), job->max_alpha)
                       / fmax(mean.weight, 0x1p-1000),
               d = moit_number(precision, tile->depth, i) * near_unit - mean.depth;
        second += share * d * d;
        third += share * d * d * d;
        fourth += share * d * d * d * d;
        for (int c = 0; c < 3; ++c) {
            double e = color_at(job, tile, i, c) * bright_unit - mean.color[c];
            spread[c] += share * e * e;
            slope[c] += share * e * d;
            curvature[c] += share * e * d * d;
        }
    }
    double deviation = sqrt(second), covered = 1.0 - passed,
           range = job->fragments->far - job->fragments->near;
    double divisor = deviation > 0.0 ? deviation : 1.0, spread_of_range = deviation / range;
    bool any = end > first;
    fact[MOIT_FACT_COUNT] = end - first;
    fact[MOIT_FACT_ABSORBANCE] = mean.weight;
    fact[MOIT_FACT_COVERED] = covered;
    fact[MOIT_FACT_OVERLAP] = fmax(alphas - covered, 0.0);
    fact[MOIT_FACT_MOST_ALPHA] = most_alpha;
    fact[MOIT_FACT_DEPTH_SPREAD] = range > 0.0 ? as_held(spread_of_range, near_unit) : 0.0;
    fact[MOIT_FACT_DEPTH_SKEW] = over_power(third, divisor, 3);
    fact[MOIT_FACT_DEPTH_TAILS] = over_power(fourth, divisor, 4);
    fact[MOIT_FACT_COLOR_RANGE] =
        any ? as_held(most_of(high[0] - low[0], high[1] - low[1], high[2] - low[2]), bright_unit)
            : 0.0;
    fact[MOIT_FACT_COLOR_SPREAD] =
        as_held(sqrt(most_of(spread[0], spread[1], spread[2])), bright_unit);
    fact[MOIT_FACT_COLOR_SLOPE] =
        as_held(over_power(most_of(fabs(slope[0]), fabs(slope[1]), fabs(slope[2])), divisor, 1),
                bright_unit);
    fact[MOIT_FACT_COLOR_CURVATURE] = as_held(
        over_power(most_of(fabs(curvature[0]), fabs(curvature[1]), fabs(curvature[2])), divisor, 2),
        bright_unit);
    fact[MOIT_FACT_TINT] = tint;
}

static void note_tile(const moit_job *job, moit_tile *tile, void *facts) {
    for (int p = 0; p < tile->pixels; ++p)
        note_pixel(job, tile, p,
                   (double *)facts + (tile->first_pixel + p) * (int64_t)MOIT_PIXEL_FACTS);
}

moit_status moit_pixel_facts(const moit_fragments *fragments, bool cull_opaque, double *facts,
                             const moit_run *run) {
    moit_job job = moit_plain_job(fragments, cull_opaque, run);
    job.max_alpha = moit_held_max_alpha(fragments->precision, 1.0 - 0.5 / 256.0);
    return moit_for_tiles(&job, note_tile, facts);
}

/* ---- Fragments of some pixels ---------------------------------------------------------------- */

enum { RUN = 1024 }; /* pixels that a thread takes at a time */

typedef struct {
    const moit_fragments *from;
    const int64_t *pixel, *offsets;
    int64_t count;
    char *to[4];
} selection;

static moit_status take_run(void *context, int64_t item, int thread) {
    (void)thread;
    const selection *s = context;
    const void *arrays[4] = {s->from->depth, s->from->alpha, s->from->color, s->from->transmission};
    size_t scalar = s->from->precision == MOIT_FLOAT64 ? sizeof(double) : sizeof(float);
    int64_t end = (item + 1) * RUN < s->count ? (item + 1) * RUN : s->count;
    for (int64_t k = item * RUN; k < end; ++k) {
        int64_t first = s->from->offsets[s->pixel[k]], to = s->offsets[k],
                length = s->offsets[k + 1] - to;
        for (int a = 0; a < 4; ++a) {
            size_t bytes = (a < 2 ? 1 : 3) * scalar;
            if (arrays[a])
                memcpy(s->to[a] + (size_t)to * bytes,
                       (const char *)arrays[a] + (size_t)first * bytes, (size_t)length * bytes);
        }
    }
    return MOIT_OK;
}

moit_status moit_take_pixels(const moit_fragments *fragments, const int64_t *pixel, int64_t count,
                             const int64_t *offsets, void *depth, void *alpha, void *color,
                             void *transmission, const moit_run *run) {
    selection s = {fragments, pixel, offsets, count, {depth, alpha, color, transmission}};
    return moit_parallel_for(run, (count + RUN - 1) / RUN, take_run, &s);
}

/* ---- Between which colours ------------------------------------------------------------------- */

typedef struct {
    const double *background;
    bool per_pixel;
    const void *lower, *upper;
    double *low, *high;
} certificate;

static double bound_at(const moit_job *job, const moit_tile *tile, const void *bounds, int i,
                       int c) {
    int64_t at = tile->first_fragment + (tile->source ? tile->source[i] : i);
    return moit_number(job->fragments->precision, bounds, tile->opacity[0] ? 3 * at + c : at);
}

static double opacity_at(const moit_job *job, const moit_tile *tile, int i, int c) {
    return moit_number(job->fragments->precision, tile->opacity[0] ? tile->opacity[c] : tile->alpha,
                       i);
}

/* Emission of a fragment in a channel, alpha times colour. */
static double emitted_at(const moit_job *job, const moit_tile *tile, int i, int c) {
    return moit_number(job->fragments->precision, tile->emission, i) * color_at(job, tile, i, c);
}

/* The least and the greatest that a pixel's fragments can add in channel c: each is seen through
 * something between its bounds, and what they cover sums to what the pixel covers. So what is left
 * of that sum, over the lower bounds, goes to those that emit least or most for what they cover.
 * Returns how far either may be off because `covered` and what is left of it are differences: no
 * more than all that there is to give. */
static double bound_sum(const moit_job *job, const moit_tile *tile, const certificate *to, int p,
                        int c, double covered, double *low, double *high) {
    double base[2] = {0.0, 0.0}, left = covered, worth = 0.0, all = 0.0;
    int first = tile->offsets[p], end = tile->offsets[p + 1];
    for (int i = first; i < end; ++i) {
        double least = bound_at(job, tile, to->lower, i, c), opacity = opacity_at(job, tile, i, c),
               emitted = emitted_at(job, tile, i, c);
        if (opacity == 0.0) { /* covers nothing, but may be seen */
            double more = emitted * bound_at(job, tile, to->upper, i, c);
            base[0] += fmin(emitted * least, more);
            base[1] += fmax(emitted * least, more);
            continue;
        }
        base[0] += emitted * least;
        base[1] += emitted * least;
        left -= opacity * least;
        worth = fmax(worth, fabs(tile->points[0][i]));
        all += fabs(emitted) * (bound_at(job, tile, to->upper, i, c) - least);
    }
    for (int side = 0; side < 2; ++side) {
        double rest = fmax(left, 0.0);
        for (int k = first; k < end && rest > 0.0; ++k) {
            int i = tile->order[side ? end - 1 - (k - first) : k];
            double room = opacity_at(job, tile, i, c)
                          * (bound_at(job, tile, to->upper, i, c)
                             - bound_at(job, tile, to->lower, i, c)),
                   taken = fmin(room, rest);
            base[side] += taken * tile->points[0][i];
            rest -= taken;
        }
    }
    *low = base[0];
    *high = base[1];
    return fmin((end - first + 2) * 0x1p-52 * worth, all);
}

/* Fills tile->order with each pixel's fragments by rising emission for what they cover. */
static void order_by_worth(const moit_job *job, moit_tile *tile, int c) {
    double *worth = tile->points[0];
    for (int i = 0; i < tile->fragments; ++i) {
        double opacity = opacity_at(job, tile, i, c);
        worth[i] = opacity > 0.0 ? emitted_at(job, tile, i, c) / opacity : 0.0;
    }
    int32_t *order = (int32_t *)(void *)tile->points[1];
    job->precise->depth_ranks(tile->pixels, tile->offsets, worth, tile->rank, order);
    for (int p = 0; p < tile->pixels; ++p)
        for (int i = tile->offsets[p]; i < tile->offsets[p + 1]; ++i)
            tile->order[tile->offsets[p] + tile->rank[i]] = i;
}

static void bound_colors(const moit_job *job, moit_tile *tile, void *context) {
    const certificate *to = context;
    const moit_fragments *f = job->fragments;
    double unit = f->precision == MOIT_FLOAT64 ? 0x1p-52 : 0x1p-23;
    double least = f->precision == MOIT_FLOAT64 ? 0x1p-1074 : 0x1p-149;
    for (int c = 0; c < 4; ++c) {
        if (c < 3) order_by_worth(job, tile, c);
        for (int p = 0; p < tile->pixels; ++p) {
            int64_t pixel = tile->first_pixel + p;
            bool walled = tile->opaque && tile->opaque[p] >= 0;
            int first = tile->offsets[p], end = tile->offsets[p + 1];
            double passed[3] = {1.0, 1.0, 1.0}, most = 0.0, behind = 0.0, low = 0.0, high = 0.0,
                   off = 0.0;
            for (int i = first; i < end; ++i)
                for (int k = 0; k < 3; ++k) passed[k] *= 1.0 - opacity_at(job, tile, i, k);
            if (c == 3) {
                low = high = walled ? 1.0 : 1.0 - (passed[0] + passed[1] + passed[2]) / 3.0;
                most = 1.0;
            } else {
                behind = walled ? moit_number(f->precision, f->color,
                                              3 * (tile->first_fragment + tile->opaque[p]) + c)
                                : to->background[to->per_pixel ? 3 * pixel + c : c];
                for (int i = first; i < end; ++i) most += fabs(emitted_at(job, tile, i, c));
                off = bound_sum(job, tile, to, p, c, 1.0 - passed[c], &low, &high);
                low += passed[c] * behind;
                high += passed[c] * behind;
            }
            /* what rounding may do to these sums, and to `sorted` in the fragments' precision */
            double doubt = (end - first + 8) * (unit * (most + fabs(behind)) + least) + off;
            to->low[4 * pixel + c] = low - doubt;
            to->high[4 * pixel + c] = high + doubt;
        }
    }
}

moit_status moit_color_bounds(const moit_fragments *fragments, bool cull_opaque,
                              const double *background, bool background_per_pixel,
                              const void *lower, const void *upper, double *low, double *high,
                              const moit_run *run) {
    moit_job job = moit_plain_job(fragments, cull_opaque, run);
    certificate to = {background, background_per_pixel, lower, upper, low, high};
    return moit_for_tiles(&job, bound_colors, &to);
}
