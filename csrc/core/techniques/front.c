/* The nearest fragments exactly; behind them what a technique reads off moments of all others.
 *
 * A first pass draws all fragments: it keeps the nearest by atomic minima, and adds up moments of
 * all. What the nearest have in these is taken out again, and what that leaves of rounding a bias
 * outweighs that grows as the rest is less of the whole.
 *
 * Keys of 32 bits hold depth in 20 bits and the root of 1 - alpha in 12. What is taken out has to
 * be what was added: so all fragments are rounded to their keys first, and nothing else of depth
 * and alpha is known but what shading has. */
#include "core/techniques/options.h"
#include "core/techniques/table.h"

#include <math.h>
#include <string.h>

enum { LEAST_TAIL_EXPONENT_SINGLE = -20, LEAST_TAIL_EXPONENT_DOUBLE = -43 };
#define MOST_BIAS 0.2         /* moments of which more is unknown say nothing */
#define DEPTH_WORDS 1048575.0 /* of a key of 32 bits */
#define ALPHA_ROOTS 4095.0

moit_technique moit_front_tail(const moit_technique *technique) {
    moit_technique tail = *technique;
    tail.kind = technique->front.tail;
    tail.count = technique->front.moment_count;
    if (technique->front.small_keys) tail.warp = MOIT_WARP_NONE; /* keys have depth warped */
    return tail;
}

static bool front_fits(const moit_technique *technique) {
    moit_technique tail = moit_front_tail(technique);
    return (tail.kind == MOIT_POWER_MOMENTS || tail.kind == MOIT_TRIGONOMETRIC_MOMENTS
            || tail.kind == MOIT_BOUNDED_NEURAL)
           && tail.moments.bits != 16 && !tail.moments.halves && moit_technique_fits(&tail)
           && !(technique->front.small_keys && technique->range_per_pixel);
}

static int front_weights(const moit_technique *technique) {
    moit_technique tail = moit_front_tail(technique);
    return tail.kind == MOIT_BOUNDED_NEURAL ? moit_network_weights(&tail) : 0;
}

/* Of the nearest: moments in double, offsets and, of all pixels, what they let through. */
typedef struct {
    double *b0, *b, *through;
    int32_t *offsets;
} front_part;

static size_t doubles_of(int pixels) { return (size_t)pixels * (2 + MOIT_MOST_NUMBERS); }

/* Of rounded depths, or rounded alphas; none where keys hold both as they are. */
static size_t row_of(const moit_job *job, int fragments) {
    bool rounds = job->technique->front.small_keys;
    return rounds ? ((size_t)fragments * job->scalar + 7) / 8 * 8 : 0;
}

static size_t front_scratch(const moit_job *job, int fragments, int pixels) {
    return 2 * row_of(job, fragments) + doubles_of(pixels) * sizeof(double)
           + (size_t)(pixels + 1) * sizeof(int32_t);
}

static front_part part_of(const moit_job *job, const moit_tile *tile) {
    size_t rounded = 2 * row_of(job, tile->given + MOIT_PADDING);
    double *numbers = (double *)(void *)(tile->own + rounded);
    return (front_part){.b0 = numbers,
                        .b = numbers + 2 * (size_t)tile->pixels,
                        .through = numbers + tile->pixels,
                        .offsets = (int32_t *)(void *)(numbers + doubles_of(tile->pixels))};
}

static double depth_of_key(double z) {
    double word = nearbyint((0.5 + 0.5 * fmin(fmax(z, -1.0), 1.0)) * DEPTH_WORDS);
    return 2.0 * (word / DEPTH_WORDS) - 1.0;
}

static double root_of_key(double alpha) { return nearbyint(ALPHA_ROOTS * sqrt(1.0 - alpha)); }

static double alpha_of_root(double root) {
    double share = root / ALPHA_ROOTS;
    return 1.0 - share * share;
}

void moit_front_round_depth(moit_precision precision, int n, const void *z, void *out) {
    for (int i = 0; i < n; ++i)
        moit_set_number(precision, out, i, depth_of_key(moit_number(precision, z, i)));
}

/* The tile's fragments become what their keys say: depth warped, and alpha. */
static void round_to_keys(const moit_job *job, moit_tile *tile) {
    moit_precision precision = job->fragments->precision;
    if (!job->technique->front.small_keys) return;
    void *z = tile->own, *alpha = tile->own + row_of(job, tile->given + MOIT_PADDING);
    moit_warp_tile(job, tile);
    moit_front_round_depth(precision, tile->fragments, tile->z, z);
    for (int i = 0; i < tile->fragments; ++i)
        moit_set_number(precision, alpha, i,
                        alpha_of_root(root_of_key(moit_number(precision, tile->alpha, i))));
    tile->depth = z;
    tile->alpha = alpha;
}

/* z of the depths that are asked for, as keys have depth. */
static void place_depths(const moit_job *job, moit_tile *tile) {
    moit_moments_warp_curve(job, tile);
    if (job->technique->front.small_keys)
        moit_front_round_depth(job->fragments->precision, tile->pixels * (int)job->depths,
                               tile->curve_z, tile->curve_z);
}

/* Ranks, and moments of the fragments before `layers`. */
static void gather_front(const moit_job *job, const moit_technique *tail, moit_tile *tile) {
    moit_precision precision = job->fragments->precision;
    front_part front = part_of(job, tile);
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
    job->precise->moments[moit_family_of(tail)->stages].sums(
        tail->count, &job->zone, tile->pixels, front.offsets, a, z, front.b0, front.b);
}

static double least_tail(moit_precision precision) {
    return ldexp(1.0, precision == MOIT_FLOAT64 ? LEAST_TAIL_EXPONENT_DOUBLE
                                                : LEAST_TAIL_EXPONENT_SINGLE);
}

/* Of what rounds off sums of all, how much a bias is to outweigh of a tail that is all of it. */
static double covering_bias(const moit_job *job, const moit_technique *tail) {
    double published = moit_family_of(tail)->constants(tail)->published_bias;
    return published * (job->given == MOIT_FLOAT64 ? 2e-8 : 1.0); /* outweighs rounding of floats */
}

static double bias_of(double covering, double least, double all, double rest) {
    return fmin(fmax(covering * all / fmax(rest, 1e-300), least), MOST_BIAS);
}

moit_tail_bias moit_front_bias(const moit_job *job, int p, const moit_tile *tile) {
    moit_technique tail = moit_front_tail(job->technique);
    double covering = covering_bias(job, &tail), rest = tile->double_b0[p];
    double all = rest + part_of(job, tile).b0[p], least = tail.moments.bias;
    moit_tail_bias own = {.bias = bias_of(covering, least, all, rest)};
    if (!(own.bias > least && own.bias < MOST_BIAS)) return own;
    own.by_all = covering / rest;
    own.by_rest = -own.bias / rest;
    return own;
}

/* tile->b0 and double_b0 become the tail's, double_b its biased moments. */
static void take_front_out(const moit_job *job, const moit_technique *tail, moit_tile *tile) {
    moit_precision precision = job->fragments->precision;
    const moit_moment_constants *known = moit_family_of(tail)->constants(tail);
    double covering = covering_bias(job, tail), least = least_tail(job->given);
    front_part front = part_of(job, tile);
    int numbers = moit_family_of(tail)->numbers(tail->count);
    for (int p = 0; p < tile->pixels; ++p) {
        double all = moit_number(precision, tile->b0, p), rest = all - front.b0[p];
        if (!(rest > least * all)) rest = 0.0;
        double bias = bias_of(covering, tail->moments.bias, all, rest);
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
    moit_technique tail = moit_front_tail(job->technique);
    moit_job own = *job;
    own.technique = &tail;
    own.bias = tail.moments.bias;
    own.warp = moit_warp_over(&tail, job->fragments->near, job->fragments->far);
    const moit_moment_family *family = moit_family_of(&tail);
    const moit_moment_stages *stages = &job->stages->moments[family->stages];
    round_to_keys(job, tile);
    moit_moments_gather(&own, tile);
    gather_front(job, &tail, tile);
    take_front_out(job, &tail, tile);
    job->precise->moments[family->stages].rules(tail.count, &job->zone, false, tile->pixels,
                                                tile->double_b, 0.0, family->constants(&tail)->safe,
                                                1e-15, tile->rules);
    bool curve = job->depths > 0;
    if (curve) place_depths(job, tile);
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
        stages->transmittance(tail.count, &job->zone, tile->pixels, offsets, z,
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

const double *moit_front_through(const moit_job *job, const moit_tile *tile) {
    return part_of(job, tile).through;
}

const double *moit_front_tails(const moit_tile *tile) { return tile->points[2]; }

static void front_weigh(const moit_job *job, moit_tile *tile) {
    moit_precision precision = job->fragments->precision;
    front_part front = part_of(job, tile);
    read_tail(job, tile);
    for (int p = 0; p < tile->pixels; ++p) {
        double through = 1.0;
        int start = tile->offsets[p], end = tile->offsets[p + 1];
        for (int k = start; k < end; ++k) {
            int i = tile->order[k];
            double T = k < start + job->technique->count ? 1.0 : moit_number(precision, tile->T, i);
            tile->points[2][i] = T;
            moit_set_number(precision, tile->T, i, through * T);
            if (k < start + job->technique->count)
                through *= 1.0 - moit_number(precision, tile->alpha, i);
        }
        front.through[p] = through;
        tile->total[p] *= through;
    }
}

static void front_curve(const moit_job *job, moit_tile *tile) {
    moit_precision precision = job->fragments->precision;
    front_part front = part_of(job, tile);
    read_tail(job, tile);
    for (int p = 0; p < tile->pixels; ++p) {
        bool all;
        front.through[p] = through_before(job, tile, p, __builtin_inf(), &all);
        tile->total[p] *= front.through[p];
        for (int64_t k = 0; k < job->depths; ++k) {
            int64_t at = p * job->depths + k;
            double depth = job->depth[k];
            if (precision == MOIT_FLOAT32) depth = (double)(float)depth; /* as fragments' are */
            if (job->technique->front.small_keys) depth = moit_number(precision, tile->curve_z, at);
            double through = through_before(job, tile, p, depth, &all);
            double T = moit_number(precision, tile->curve, at);
            tile->points[2][at] = T;
            moit_set_number(precision, tile->curve, at, all ? through * T : through);
        }
    }
}

/* The tail is scaled to cover what it does, the nearest are as they are. */
static void front_blend(const moit_job *job, moit_tile *tile) {
    moit_precision precision = job->fragments->precision;
    front_part front = part_of(job, tile);
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

/* Of fragments by rank, tile->order. */
static void order_by_rank(const moit_job *job, moit_tile *tile) {
    job->stages->depth_ranks(tile->pixels, tile->offsets, tile->depth, tile->rank, tile->order);
    for (int p = 0; p < tile->pixels; ++p)
        for (int i = tile->offsets[p]; i < tile->offsets[p + 1]; ++i)
            tile->order[tile->offsets[p] + tile->rank[i]] = i;
}

/* What a key says of the light that its fragment lets through, half a step more or less. */
static double through_key(double root, double half_step) {
    double share = fmin(fmax(root + half_step, 0.0), ALPHA_ROOTS) / ALPHA_ROOTS;
    return share * share;
}

/* Keys of 32 bits prove what lies strictly nearer by their depths, and that nothing else is in
 * front of what is nearer than the last of them. */
static void bound_by_keys(const moit_job *job, moit_tile *tile, double *lower, double *upper) {
    moit_precision precision = job->fragments->precision;
    const double slack = moit_product_slack(2 * job->technique->count), half = 0.5 + 1e-9;
    const void *alpha = tile->alpha;
    round_to_keys(job, tile);
    order_by_rank(job, tile);
    if (job->depths) place_depths(job, tile);
    for (int p = 0; p < tile->pixels; ++p) {
        int start = tile->offsets[p], end = tile->offsets[p + 1], layers = job->technique->count;
        int64_t asked = job->depths ? job->depths : end - start;
        int64_t at = job->depths ? p * job->depths : start;
        for (int64_t i = at; i < at + asked; ++i) {
            double z = moit_number(precision, job->depths ? tile->curve_z : tile->depth, i),
                   least = 1.0, most = 1.0;
            bool all_known = end - start <= layers;
            for (int k = start; k < end && k < start + layers; ++k) {
                double own = moit_number(precision, tile->depth, tile->order[k]),
                       root = root_of_key(moit_number(precision, alpha, tile->order[k]));
                if (own < z) most *= through_key(root, half);
                bool itself = !job->depths && tile->order[k] == i;
                if (own <= z && !itself) least *= through_key(root, -half);
                if (own > z) all_known = true;
            }
            upper[i] = fmin(upper[i], most * (1.0 + slack));
            if (all_known) lower[i] = fmax(lower[i], least * (1.0 - slack));
        }
    }
}

/* What the first `count` of a pixel's nearest let through, as they arrived at one depth. */
static double through_first(const moit_job *job, const moit_tile *tile, int p, int count) {
    double through = 1.0;
    for (int k = tile->offsets[p]; k < tile->offsets[p] + count; ++k)
        through *= 1.0 - moit_number(job->fragments->precision, tile->alpha, tile->order[k]);
    return through;
}

/* What is strictly nearer among the nearest is the most that reaches anything. Of a depth nearer
 * than the last of them it is all there is; of these themselves, what came before them at their
 * depth may count too, as it does for `sorted`. */
static void front_bounds(const moit_job *job, moit_tile *tile, double *lower, double *upper) {
    moit_precision precision = job->fragments->precision;
    const double slack = moit_product_slack(job->technique->count);
    moit_total_bounds(job, tile, lower, upper);
    if (job->technique->front.small_keys) {
        bound_by_keys(job, tile, lower, upper);
        return;
    }
    order_by_rank(job, tile);
    for (int p = 0; p < tile->pixels; ++p) {
        int start = tile->offsets[p], end = tile->offsets[p + 1], layers = job->technique->count;
        int64_t asked = job->depths ? job->depths : end - start;
        int64_t at = job->depths ? p * job->depths : start;
        for (int64_t k = 0; k < asked; ++k, ++at) {
            bool all;
            double depth = job->depths ? job->depth[k] : moit_number(precision, tile->depth, at);
            double through = through_before(job, tile, p, depth, &all), least = through;
            bool known = !all || end - start <= layers;
            upper[at] = fmin(upper[at], through * (1.0 + slack));
            if (!job->depths) {
                known = tile->rank[at] < layers;
                least = known ? through_first(job, tile, p, tile->rank[at]) : 0.0;
            }
            if (known) lower[at] = fmax(lower[at], least * (1.0 - slack));
        }
    }
}

const moit_technique_row moit_front_row = {
    .name = "front",
    OPTIONS(COUNT, WARPED, READ_MOMENTS, MOMENT_BITS(32), WRAPPING_ZONE,
            WHOLE("tail", front.tail, 0, MOIT_KIND_COUNT - 1),
            WHOLE("moment_count", front.moment_count, 2, 8), TRUTH("small_keys", front.small_keys),
            NETWORK(front.network) /* its tail's */),
    .usual_counts = (const int[]){2, 0},
    .least_count = 1,
    .most_count = MOIT_MOST_LAYERS,
    .fits = front_fits,
    .weigh = front_weigh,
    .pull_back = moit_front_pull_back,
    .refusal = moit_front_refusal,
    .see = moit_front_see,
    .unsee = moit_front_unsee,
    .curve = front_curve,
    .bounds = front_bounds,
    .blend = front_blend,
    .scratch = front_scratch,
    .weights = front_weights,
    .unit_range = {-1.0, 1.0},
    .uses_warp = true,
    .reconstructs = true,
    .arrival = MOIT_TIES_IN_ORDER,
    .ties = MOIT_TIES_EARLIER,
    .geometry_passes = 2};
