/* Backwards through what moments by themselves say: for arrays of a caller. */
#include "moit_gradients.h"

#include "core/elementary.h"
#include "core/adjoints/moments.h"
#include "core/adjoints/wide_bounds.h"
#include "core/system.h"
#include "core/techniques/table.h"
#include "core/threads.h"

#include <math.h>
#include <string.h>

const char *moit_moments_gradient_refusal(const moit_technique *technique) {
    const moit_technique_row *row = moit_technique_rows[technique->kind];
    if (!row->moments || row->pull_back != moit_moments_pull_back)
        return "its moments have none yet";
    if (technique->kind == MOIT_MOMENT_TRANSPARENCY && technique->transparency.passes == 2)
        return "two passes have none by themselves; use passes=1";
    if (technique->kind == MOIT_MOMENT_TRANSPARENCY
        && technique->transparency.storage != MOIT_STORAGE_FLOAT)
        return "words of 16 bits are steps; use storage=\"float32\"";
    if (technique->moments.bits == 16) return "words of 16 bits are steps; use bits=32";
    if (technique->moments.halves) return "half floats are steps; use storage=None";
    if (technique->resolution > 1)
        return "those of blocks have none by themselves; use resolution=1";
    return NULL;
}

enum { BLOCK_POINTS = 8192, BLOCK_PIXELS = 256, MOST_NODES = 4 };

typedef struct {
    const moit_technique *technique;
    const moit_stages *precise;
    moit_isa isa;
    moit_precision precision;
    double bias, beta, max_alpha;
    moit_wrapping_zone zone;
    int64_t pixels, depths;
    int block_pixels;
    const moit_moment_arrays *given;
    bool absorbance, bounds, adds, scales;
    const void *seed;
    const moit_moment_gradients *out;
    char *memory;
    size_t part;
} pulling;

/* A block's numbers in double. */
typedef struct {
    double *z, *own, *by, *A, *by_z, *by_own; /* (pixels, depths), padded */
    double *b0, *b, *by_b0, *by_b, *double_b, *rules;
    int32_t *offsets;
} block;

static size_t lay_out(size_t points, size_t pixels, char *memory, block *o) {
    size_t used = 0;
    struct {
        double **start;
        size_t count;
    } parts[] = {
        {&o->z, points},
        {&o->own, points},
        {&o->by, points},
        {&o->A, points},
        {&o->by_z, points},
        {&o->by_own, points},
        {&o->b0, pixels},
        {&o->by_b0, pixels},
        {&o->b, pixels * MOIT_MOST_NUMBERS},
        {&o->by_b, pixels * MOIT_MOST_NUMBERS},
        {&o->double_b, pixels * MOIT_MOST_NUMBERS},
        {&o->rules, pixels * MOIT_MOST_RULE},
    };
    for (size_t i = 0; i < sizeof parts / sizeof *parts; ++i) {
        *parts[i].start = memory ? (double *)(void *)(memory + used) : NULL;
        used += moit_aligned_size(parts[i].count * sizeof(double));
    }
    o->offsets = memory ? (int32_t *)(void *)(memory + used) : NULL;
    return used + moit_aligned_size((pixels + 1) * sizeof(int32_t));
}

static void widen(moit_precision precision, const void *from, int64_t first, int n, double *to) {
    for (int i = 0; i < n; ++i) to[i] = moit_number(precision, from, first + i);
}

static void give(const pulling *job, void *to, int64_t first, int n, const double *numbers) {
    for (int i = 0; to && i < n; ++i) {
        double more = job->adds ? moit_number(job->precision, to, first + i) : 0.0;
        moit_set_number(job->precision, to, first + i, more + numbers[i]);
    }
}

static void pull_pixel(const pulling *job, const block *o, int p) {
    const moit_moment_family *family = moit_family_of(job->technique);
    const moit_moment_adjoints *adjoints = moit_moment_adjoints_of(job->technique, job->isa);
    int count = job->technique->count, numbers = family->numbers(count);
    int first = o->offsets[p], n = o->offsets[p + 1] - first;
    const double *rule = o->rules + p * family->rule_size(count);
    double S[MOIT_MOST_TERMS], *by_b = o->by_b + p * numbers;
    memset(by_b, 0, (size_t)numbers * sizeof *by_b);
    o->by_b0[p] = 0.0;
    if (!(o->b0[p] > 0.0)) return;
    moit_readings at = {.n = n,
                        .z = o->z + first,
                        .own = job->given->alpha ? o->own + first : NULL,
                        .by = o->by + first,
                        .by_z = o->by_z + first,
                        .by_own = o->by_own + first};
    o->by_b0[p] = adjoints->sum_pulled(count, &job->zone, &at, rule, o->b0[p], job->beta, S);
    moit_moments_of_terms(adjoints, family->stages, &job->zone, numbers / 2, rule, S, by_b);
    for (int k = 0; k < numbers; ++k) by_b[k] *= 1.0 - job->bias;
}

enum { CHUNK = 64, STRIDE = CHUNK + MOIT_PADDING };

/* Of one place, by the bound's T: to b0, b, z and what the surface there absorbs. */
static void pull_wide(const pulling *job, const block *o, int p, int i, const double *y,
                      const double *ahead, double by) {
    int nodes = job->technique->count / 2;
    bool lower = job->beta > 0.0;
    double at[MOST_NODES], value[MOST_NODES], own = job->given->alpha ? o->own[i] : 0.0;
    for (int k = 0; k < nodes; ++k) {
        at[k] = y[k * STRIDE];
        value[k] = lower ? 1.0 - ahead[k * STRIDE] : ahead[k * STRIDE];
    }
    moit_touched given = {.nodes = nodes,
                          .rule = o->rules + p * MOIT_RULE_SIZE(2 * nodes),
                          .b = o->b + p * 2 * nodes,
                          .y = at,
                          .keeps = 1.0 - job->bias,
                          .z = o->z[i]};
    moit_mean_slopes slopes;
    double mean = moit_touching_mean(&given, value, &slopes);
    double share = lower ? 1.0 - mean : mean, absorbed = o->b0[p] * share;
    if (lower) absorbed -= own;
    if (!(absorbed > 0.0)) by = 0.0;
    by *= -moit_exp(-absorbed);
    o->by_b0[p] += by * share;
    if (lower) o->by_own[i] -= by;
    double by_mean = (lower ? -by : by) * o->b0[p];
    o->by_z[i] += by_mean * slopes.z;
    for (int k = 0; k < 2 * nodes; ++k) o->by_b[p * 2 * nodes + k] += by_mean * slopes.b[k];
}

/* Places where bounds are others than moments have: first these are left out of what is pulled
 * (`seed` NULL), then they are pulled by themselves. */
static void wide_places(const pulling *job, const block *o, int pixels, const double *seed) {
    int count = job->technique->count, nodes = count / 2;
    double y[MOST_NODES * STRIDE], ahead[MOST_NODES * STRIDE];
    for (int p = 0; p < pixels; ++p) {
        const double *rule = o->rules + p * MOIT_RULE_SIZE(count);
        for (int i = o->offsets[p]; o->b0[p] > 0.0 && i < o->offsets[p + 1]; i += CHUNK) {
            int left = o->offsets[p + 1] - i, n = left < CHUNK ? left : CHUNK;
            moit_moment_adjoints_of(job->technique, job->isa)
                ->nodes_through(count, n, rule, o->z + i, STRIDE, y, ahead);
            for (int k = 0; k < n; ++k) {
                bool wide = job->given->alpha
                            && o->own[i + k] > o->b0[p] * moit_weight_at(nodes, rule, o->z[i + k]);
                for (int j = 0; j < nodes; ++j)
                    wide = wide || !(fabs(y[j * STRIDE + k]) < MOIT_FARTHEST_NODE);
                if (!wide) continue;
                if (seed) pull_wide(job, o, p, i + k, y + k, ahead + k, seed[i + k]);
                else o->by[i + k] = 0.0;
            }
        }
    }
}

static moit_status pull_block(void *context, int64_t item, int thread) {
    const pulling *job = context;
    const moit_moment_family *family = moit_family_of(job->technique);
    const moit_moment_arrays *given = job->given;
    int64_t first = item * job->block_pixels, left = job->pixels - first;
    int pixels = (int)(left < job->block_pixels ? left : job->block_pixels);
    int numbers = family->numbers(job->technique->count), points = (int)(pixels * job->depths);
    block o;
    lay_out((size_t)(job->block_pixels * job->depths + MOIT_PADDING), (size_t)job->block_pixels,
            job->memory + (size_t)thread * job->part, &o);
    for (int p = 0; p <= pixels; ++p) o.offsets[p] = (int32_t)(p * job->depths);
    int64_t at = first * job->depths;
    widen(job->precision, given->b0, first, pixels, o.b0);
    widen(job->precision, given->b, first * numbers, pixels * numbers, o.b);
    widen(job->precision, given->z, at, points, o.z);
    widen(job->precision, job->seed, at, points, o.by);
    /* lanes beyond the last place are read, too */
    for (int i = points; i < points + MOIT_PADDING; ++i) o.z[i] = o.z[0], o.own[i] = 0.0;
    memset(o.by_z, 0, (size_t)points * sizeof *o.by_z);
    memset(o.by_own, 0, (size_t)points * sizeof *o.by_own);
    for (int i = 0; given->alpha && i < points; ++i) {
        double alpha = moit_number(job->precision, given->alpha, at + i);
        o.own[i] =
            -moit_log1p(-(job->scales ? alpha * job->max_alpha : fmin(alpha, job->max_alpha)));
    }
    moit_moments_read(job->precise, MOIT_FLOAT64, job->technique, &job->zone, job->bias, pixels,
                      o.b, o.double_b, o.rules);
    if (!job->absorbance) {
        job->precise->moments[family->stages].transmittance(
            job->technique->count, &job->zone, pixels, o.offsets, o.z, given->alpha ? o.own : NULL,
            o.rules, o.b0, job->beta, false, o.A);
        for (int i = 0; i < points; ++i) o.by[i] *= -o.A[i];
    }
    if (job->bounds) wide_places(job, &o, pixels, NULL);
    const moit_moment_adjoints *adjoints = moit_moment_adjoints_of(job->technique, job->isa);
    if (job->depths == 1 && adjoints->pull_each) {
        adjoints->pull_each(job->technique->count, pixels, o.rules, o.b0, o.z,
                            given->alpha ? o.own : NULL, job->beta, o.by, o.by_b0, o.by_b, o.by_z,
                            o.by_own);
        for (int k = 0; k < pixels * numbers; ++k) o.by_b[k] *= 1.0 - job->bias;
    }
    for (int p = 0; p < pixels && !(job->depths == 1 && adjoints->pull_each); ++p)
        pull_pixel(job, &o, p);
    if (job->bounds) {
        widen(job->precision, job->seed, at, points, o.by);
        wide_places(job, &o, pixels, o.by);
    }
    for (int i = 0; given->alpha && i < points; ++i) {
        double alpha = moit_number(job->precision, given->alpha, at + i);
        o.by_own[i] *= moit_absorbance_slope(job->technique, job->max_alpha, alpha);
    }
    give(job, job->out->b0, first, pixels, o.by_b0);
    give(job, job->out->b, first * numbers, pixels * numbers, o.by_b);
    give(job, job->out->z, at, points, o.by_z);
    give(job, job->out->alpha, at, points, o.by_own);
    return MOIT_OK;
}

static moit_status pull(pulling *job, const moit_run *run) {
    if (job->pixels == 0 || job->depths == 0) return MOIT_OK;
    if (job->depths > INT32_MAX / 4) return MOIT_NO_MEMORY;
    job->isa = run->isa;
    job->precise = moit_stages_of(MOIT_FLOAT64, run->isa);
    int64_t fit = BLOCK_POINTS / job->depths;
    job->block_pixels = (int)(fit < 1 ? 1 : fit > BLOCK_PIXELS ? BLOCK_PIXELS : fit);
    block none;
    job->part = lay_out((size_t)(job->block_pixels * job->depths + MOIT_PADDING),
                        (size_t)job->block_pixels, NULL, &none);
    int64_t blocks = (job->pixels + job->block_pixels - 1) / job->block_pixels;
    int64_t threads = run->threads < blocks ? run->threads : blocks;
    job->memory = moit_aligned_memory(job->part * (size_t)threads);
    if (!job->memory) return MOIT_NO_MEMORY;
    moit_status status = moit_parallel_for(run, blocks, pull_block, job);
    moit_free_aligned(job->memory);
    return status;
}

static pulling pulling_of(const moit_technique *technique, const moit_moment_arrays *given,
                          const moit_moment_gradients *out) {
    return (pulling){.technique = technique,
                     .precision = given->precision,
                     .bias = technique->moments.bias,
                     .beta = technique->moments.overestimation,
                     .zone = moit_wrapping_zone_of(technique),
                     .max_alpha = moit_held_max_alpha(given->precision, technique->max_alpha),
                     .pixels = given->pixels,
                     .depths = given->depths,
                     .given = given,
                     .scales = moit_technique_rows[technique->kind]->scales_alpha,
                     .out = out};
}

moit_status moit_moments_pullback(const moit_technique *technique, const moit_moment_arrays *given,
                                  bool absorbance, const void *seed,
                                  const moit_moment_gradients *out, const moit_run *run) {
    pulling job = pulling_of(technique, given, out);
    job.absorbance = absorbance;
    job.seed = seed;
    return pull(&job, run);
}

moit_status moit_moments_bounds_pullback(const moit_technique *technique,
                                         const moit_moment_arrays *given, const void *by_lower,
                                         const void *by_upper, const moit_moment_gradients *out,
                                         const moit_run *run) {
    moit_moment_arrays all = *given;
    pulling job = pulling_of(technique, &all, out);
    job.bias = moit_bias_of_bounds(given->precision, technique->count);
    job.bounds = true;
    job.beta = 1.0;
    job.seed = by_lower;
    moit_status status = pull(&job, run);
    job.beta = 0.0;
    job.seed = by_upper;
    job.adds = true;
    return status == MOIT_OK ? pull(&job, run) : status;
}
