/* The nearest fragments exactly; behind them what a technique reads off moments of all others.
 *
 * A first pass draws all fragments: it keeps the nearest by atomic minima, and adds up moments of
 * all. What the nearest have in these is taken out again, and what that leaves of rounding a bias
 * outweighs that grows as the rest is less of the whole. */
#include "core/techniques/table.h"

#include <math.h>

enum { LEAST_TAIL_EXPONENT_SINGLE = -20, LEAST_TAIL_EXPONENT_DOUBLE = -43 };
#define MOST_BIAS 0.2 /* moments of which more is unknown say nothing */

/* The technique that reads the tail: the options of both begin alike. */
static moit_technique tail_of(const moit_technique *technique) {
    moit_technique tail = *technique;
    tail.kind = technique->front.tail;
    tail.count = technique->front.moment_count;
    return tail;
}

bool moit_front_fits(const moit_technique *technique) {
    moit_technique tail = tail_of(technique);
    return (tail.kind == MOIT_POWER_MOMENTS || tail.kind == MOIT_TRIGONOMETRIC_MOMENTS
            || tail.kind == MOIT_BOUNDED_NEURAL)
           && tail.moments.bits != 16 && !tail.moments.halves && moit_technique_fits(&tail);
}

int moit_front_weights(const moit_technique *technique) {
    moit_technique tail = tail_of(technique);
    return tail.kind == MOIT_BOUNDED_NEURAL ? moit_network_weights(&tail) : 0;
}

/* Of the nearest: moments in double, offsets and, of all pixels, what they let through. */
typedef struct {
    double *b0, *b, *through;
    int32_t *offsets;
} front_part;

static size_t doubles_of(int pixels) { return (size_t)pixels * (2 + MOIT_MOST_NUMBERS); }

size_t moit_front_scratch(const moit_job *job, int fragments, int pixels) {
    (void)job;
    (void)fragments;
    return doubles_of(pixels) * sizeof(double) + (size_t)(pixels + 1) * sizeof(int32_t);
}

static front_part part_of(const moit_tile *tile) {
    double *numbers = (double *)(void *)tile->own;
    return (front_part){.b0 = numbers,
                        .b = numbers + 2 * (size_t)tile->pixels,
                        .through = numbers + tile->pixels,
                        .offsets = (int32_t *)(void *)(numbers + doubles_of(tile->pixels))};
}

/* Ranks, and moments of the fragments before `layers`. */
static void gather_front(const moit_job *job, const moit_technique *tail, moit_tile *tile) {
    moit_precision precision = job->fragments->precision;
    front_part front = part_of(tile);
    double *a = tile->points[0], *z = tile->points[1];
    int kept = 0, layers = job->technique->count;
    job->stages->depth_ranks(tile->pixels, tile->offsets, tile->depth, tile->rank, tile->order);
    for (int p = 0; p < tile->pixels; ++p) {
        int start = tile->offsets[p], end = tile->offsets[p + 1];
        front.offsets[p] = kept;
        for (int i = start; i < end; ++i) tile->order[start + tile->rank[i]] = i;
        for (int k = start; k < end && k < start + layers; ++k, ++kept) {
            a[kept] = moit_number(precision, tile->absorbance, tile->order[k]);
            z[kept] = moit_number(precision, tile->z, tile->order[k]);
        }
    }
    front.offsets[tile->pixels] = kept;
    moit_wrapping_zone zone = moit_wrapping_zone_of(tail);
    job->precise->moments[moit_family_of(tail)->stages].sums(
        tail->count, &zone, tile->pixels, front.offsets, a, z, front.b0, front.b);
}

/* tile->b0 and double_b0 become the tail's, double_b its biased moments. */
static void take_front_out(const moit_job *job, const moit_technique *tail, moit_tile *tile) {
    moit_precision precision = job->fragments->precision;
    const moit_moment_constants *known = moit_family_of(tail)->constants(tail);
    /* the published one outweighs the rounding of floats */
    double covering = known->published_bias * (precision == MOIT_FLOAT64 ? 2e-8 : 1.0);
    front_part front = part_of(tile);
    int numbers = moit_family_of(tail)->numbers(tail->count);
    double least =
        exp2(precision == MOIT_FLOAT64 ? LEAST_TAIL_EXPONENT_DOUBLE : LEAST_TAIL_EXPONENT_SINGLE);
    for (int p = 0; p < tile->pixels; ++p) {
        double all = moit_number(precision, tile->b0, p), rest = all - front.b0[p];
        if (!(rest > least * all)) rest = 0.0;
        double own = fmax(covering * all / fmax(rest, 1e-300), tail->moments.bias);
        double bias = fmin(own, MOST_BIAS);
        for (int k = p * numbers; k < (p + 1) * numbers; ++k) {
            double sum = all * moit_number(precision, tile->b, k) - front.b0[p] * front.b[k];
            double mean = rest > 0.0 ? fmin(fmax(sum / rest, -1.0), 1.0) : 0.0;
            tile->double_b[k] = mean + bias * (known->safe[k - p * numbers] - mean);
        }
        tile->double_b0[p] = rest;
        moit_set_number(precision, tile->b0, p, rest);
    }
}

/* What reads the tail: at fragments, or at the job's depths. */
static void read_tail(const moit_job *job, moit_tile *tile) {
    moit_technique tail = tail_of(job->technique);
    moit_job own = *job;
    own.technique = &tail;
    own.bias = tail.moments.bias;
    const moit_moment_family *family = moit_family_of(&tail);
    const moit_moment_stages *stages = &job->stages->moments[family->stages];
    moit_wrapping_zone zone = moit_wrapping_zone_of(&tail);
    moit_moments_gather(&own, tile);
    gather_front(job, &tail, tile);
    take_front_out(job, &tail, tile);
    job->precise->moments[family->stages].rules(tail.count, &zone, tile->pixels, tile->double_b,
                                                0.0, family->constants(&tail)->safe, 1e-15,
                                                tile->rules);
    bool curve = job->depths > 0;
    if (curve) moit_moments_warp_curve(&own, tile);
    const int32_t *offsets = curve ? tile->curve_offsets : tile->offsets;
    const void *z = curve ? tile->curve_z : tile->z;
    void *T = curve ? tile->curve : tile->T;
    if (tail.kind == MOIT_BOUNDED_NEURAL) {
        double *outlines = moit_bounded_read(&own, tile);
        job->stages->bounded_transmittance(tail.count, tile->pixels, offsets, z,
                                           curve ? NULL : tile->absorbance, tile->rules, outlines,
                                           tile->b0, tail.bounded.network, false, T);
    } else {
        bool excludes = tail.moments.exclude_self && !curve;
        stages->transmittance(tail.count, &zone, tile->pixels, offsets, z,
                              excludes ? tile->absorbance : NULL, tile->rules, tile->b0,
                              tail.moments.overestimation, false, T);
    }
    job->precise->decay(tile->pixels, tile->double_b0, tile->total);
}

/* What fragments let through that are among the first `layers` and strictly nearer than `depth`;
 * whether these are all of them. */
static double through_before(const moit_job *job, const moit_tile *tile, int p, double depth,
                             bool *all) {
    moit_precision precision = job->fragments->precision;
    int start = tile->offsets[p], end = tile->offsets[p + 1];
    double through = 1.0;
    *all = true;
    for (int k = start; *all && k < end && k < start + job->technique->count; ++k) {
        *all = moit_number(precision, tile->depth, tile->order[k]) < depth;
        if (*all) through *= 1.0 - moit_number(precision, tile->alpha, tile->order[k]);
    }
    return through;
}

void moit_front_weigh(const moit_job *job, moit_tile *tile) {
    moit_precision precision = job->fragments->precision;
    front_part front = part_of(tile);
    read_tail(job, tile);
    for (int p = 0; p < tile->pixels; ++p) {
        double through = 1.0;
        int start = tile->offsets[p], end = tile->offsets[p + 1];
        for (int k = start; k < end; ++k) {
            int i = tile->order[k];
            double T = k < start + job->technique->count ? 1.0 : moit_number(precision, tile->T, i);
            moit_set_number(precision, tile->T, i, through * T);
            if (k < start + job->technique->count)
                through *= 1.0 - moit_number(precision, tile->alpha, i);
        }
        front.through[p] = through;
        tile->total[p] *= through;
    }
}

void moit_front_curve(const moit_job *job, moit_tile *tile) {
    moit_precision precision = job->fragments->precision;
    read_tail(job, tile);
    for (int p = 0; p < tile->pixels; ++p) {
        bool all;
        tile->total[p] *= through_before(job, tile, p, __builtin_inf(), &all);
        for (int64_t k = 0; k < job->depths; ++k) {
            double depth = job->depth[k];
            if (precision == MOIT_FLOAT32) depth = (double)(float)depth; /* as fragments' are */
            double through = through_before(job, tile, p, depth, &all);
            double T = moit_number(precision, tile->curve, p * job->depths + k);
            moit_set_number(precision, tile->curve, p * job->depths + k,
                            all ? through * T : through);
        }
    }
}

/* The tail is scaled to cover what it does, the nearest are as they are. */
void moit_front_blend(const moit_job *job, moit_tile *tile) {
    moit_precision precision = job->fragments->precision;
    front_part front = part_of(tile);
    for (int p = 0; job->technique->normalize && p < tile->pixels; ++p) {
        int start = tile->offsets[p], end = tile->offsets[p + 1], layers = job->technique->count;
        double covers = 0.0;
        for (int i = start; i < end; ++i)
            if (tile->rank[i] >= layers)
                covers +=
                    moit_number(precision, tile->alpha, i) * moit_number(precision, tile->T, i);
        double share = covers > 0.0 ? (front.through[p] - tile->total[p]) / covers : 1.0;
        for (int i = start; i < end; ++i)
            if (tile->rank[i] >= layers)
                moit_set_number(precision, tile->T, i, share * moit_number(precision, tile->T, i));
    }
    moit_blend(job, tile);
}

/* What is strictly nearer among the nearest proves all where it is not all of these, and else the
 * most. */
void moit_front_bounds(const moit_job *job, moit_tile *tile, double *lower, double *upper) {
    moit_precision precision = job->fragments->precision;
    const double slack = moit_product_slack(job->technique->count);
    moit_total_bounds(job, tile, lower, upper);
    job->stages->depth_ranks(tile->pixels, tile->offsets, tile->depth, tile->rank, tile->order);
    for (int p = 0; p < tile->pixels; ++p) {
        int start = tile->offsets[p], end = tile->offsets[p + 1];
        for (int i = start; i < end; ++i) tile->order[start + tile->rank[i]] = i;
        bool none_behind = end - start <= job->technique->count;
        int64_t asked = job->depths ? job->depths : end - start;
        int64_t at = job->depths ? p * job->depths : start;
        for (int64_t k = 0; k < asked; ++k, ++at) {
            bool all;
            double depth = job->depths ? job->depth[k] : moit_number(precision, tile->depth, at);
            double through = through_before(job, tile, p, depth, &all);
            upper[at] = fmin(upper[at], through * (1.0 + slack));
            if (!all || none_behind) lower[at] = fmax(lower[at], through * (1.0 - slack));
        }
    }
}
