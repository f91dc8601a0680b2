/* What the stored moments prove, widened for all that rounding may have done to them. */
#include "core/elementary.h"
#include "core/techniques/table.h"
#include "core/threads.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
    double bias;  /* for the choice of the certifying polynomial; too little makes it wild */
    double slack; /* how far a stored mean power may be from the exact one */
    double blur;  /* how far z may be out of order */
    double unit;  /* relative error of b0 and of one absorbance */
} allowance;

/* float32: an absorbance is good to two units in the last place and a mean power is rounded once
 * more. float64: the same, and sums round at every fourth fragment. */
static allowance allowance_for(moit_precision precision, int count, double fragments) {
    static const double bias[2][4] = {{3e-7, 3e-6, 3e-5, 3e-4}, {1e-13, 1e-12, 1e-11, 1e-10}};
    double unit = precision == MOIT_FLOAT64 ? 0x1p-52 : 0x1p-23;
    return (allowance){
        .bias = bias[precision][count / 2 - 1],
        .slack = 4.0 * unit + 0x1p-53 * fragments,
        .blur = 4.0 * unit,
        .unit = 4.0 * unit + 0x1p-53 * fragments,
    };
}

double moit_bias_of_bounds(moit_precision precision, int count) {
    return allowance_for(precision, count, 0.0).bias;
}

/* From shares of b0 to transmittance; `own` is the absorbance of a surface known to lie at z, and
 * `hidden` what max_alpha has cut off the absorbance of others. */
static void transmittance_between(double b0, double at_least, double at_most, double own,
                                  double hidden, double unit, double *lower, double *upper) {
    double doubt = unit * (b0 + own);
    double most = b0 * at_most - own, all = b0 - own;
    if (most > all) most = all;
    if (most < 0.0) most = 0.0;
    most += doubt + hidden * (1.0 + unit);
    *lower = most > 0.0 ? fmin(moit_exp(-most), 1.0 - 0x1p-53) : 1.0; /* 1 is a claim of its own */
    *upper = fmin(1.0, moit_exp(-fmax(b0 * at_least - doubt, 0.0)));
}

/* Absorbance that max_alpha has cut off; infinite for alpha 1. What is scaled was rounded, here and
 * where it was gathered: near max_alpha an absorbance is that many times as much off. */
static double hidden_absorbance(double alpha, double max_alpha, bool scaled) {
    if (!scaled) return alpha > max_alpha ? moit_log1p(-max_alpha) - moit_log1p(-alpha) : 0.0;
    double rounded = 0x1p-52 * alpha / (1.0 - alpha * max_alpha);
    return alpha < 1.0 ? moit_log1p(-alpha * max_alpha) - moit_log1p(-alpha) + rounded
                       : __builtin_inf();
}

/* By the pixel's own fragments: what stands beside it changes no bit. */
static allowance allowance_of(const moit_job *job, const moit_tile *tile, int p) {
    return allowance_for(job->fragments->precision, job->technique->count,
                         tile->offsets[p + 1] - tile->offsets[p]);
}

void moit_power_bounds(const moit_job *job, moit_tile *tile, double *lower, double *upper) {
    moit_precision precision = job->fragments->precision;
    bool scaled = moit_technique_rows[job->technique->kind]->scales_alpha;
    int count = job->technique->count;
    moit_moments_gather(job, tile);
    moit_moments_read(job->precise, precision, job->technique, NULL,
                      moit_bias_of_bounds(precision, count), tile->pixels, tile->b, tile->double_b,
                      tile->rules);
    double *slack = tile->sums;
    for (int p = 0; p < tile->pixels; ++p) slack[p] = allowance_of(job, tile, p).slack;
    /* what lies in front of all is proved exactly */
    job->stages->products(tile->pixels, tile->offsets, tile->alpha, tile->total);

    const int32_t *offsets = job->depths ? tile->curve_offsets : tile->offsets;
    double *z = tile->points[0], *at_least = tile->points[1], *at_most = tile->points[2];
    if (job->depths) moit_moments_warp_curve(job, tile);
    for (int i = 0; i < offsets[tile->pixels]; ++i)
        z[i] = moit_number(precision, job->depths ? tile->curve_z : tile->z, i);
    job->precise->power_bounds(count, tile->pixels, offsets, z, tile->double_b, tile->rules,
                               allowance_for(precision, count, 0.0).blur, slack, at_least, at_most);
    for (int p = 0; p < tile->pixels; ++p) {
        double b0 = moit_number(precision, tile->b0, p), hidden = 0.0;
        double unit = allowance_of(job, tile, p).unit;
        for (int i = tile->offsets[p]; i < tile->offsets[p + 1]; ++i)
            hidden +=
                hidden_absorbance(moit_number(precision, tile->alpha, i), job->max_alpha, scaled);
        for (int i = offsets[p]; i < offsets[p + 1]; ++i) {
            double own = job->depths ? 0.0 : moit_number(precision, tile->absorbance, i);
            /* `hidden` includes the fragment's own: wider, and never inf - inf */
            transmittance_between(b0, at_least[i], at_most[i], own, hidden, unit, &lower[i],
                                  &upper[i]);
        }
    }
}

void moit_power_shares(const moit_job *job, moit_tile *tile, const double *z, double *at_least,
                       double *at_most) {
    moit_precision precision = job->fragments->precision;
    int count = job->technique->count;
    moit_moments_read(job->precise, precision, job->technique, NULL,
                      moit_bias_of_bounds(precision, count), tile->pixels, tile->b, tile->double_b,
                      tile->rules);
    memset(tile->sums, 0, (size_t)tile->pixels * sizeof *tile->sums);
    job->precise->power_bounds(count, tile->pixels,
                               job->depths ? tile->curve_offsets : tile->offsets, z, tile->double_b,
                               tile->rules, 0.0, tile->sums, at_least, at_most);
}

/* ---- Moments by themselves ------------------------------------------------------------------- */

/* For sums of up to some thousand fragments. */
enum { ASSUMED_FRAGMENTS = 4096, BLOCK_POINTS = 4096 };

typedef struct {
    const moit_technique *technique;
    const moit_stages *precise;
    moit_precision precision;
    int64_t pixels, depths;
    const void *b0, *b, *z, *alpha;
    void *lower, *upper;
    double *memory;
    size_t part; /* doubles a thread */
} bounds_job;

/* One pixel at a time: this answers questions about single rays, not images. */
static moit_status bound_pixel(void *context, int64_t pixel, int thread) {
    const bounds_job *job = context;
    int count = job->technique->count;
    allowance allow = allowance_for(job->precision, count, ASSUMED_FRAGMENTS);
    double *z = job->memory + (size_t)thread * job->part;
    double *at_least = z + BLOCK_POINTS + MOIT_PADDING,
           *at_most = at_least + BLOCK_POINTS + MOIT_PADDING;
    double double_b[MOIT_MOST_NUMBERS], rule[MOIT_MOST_RULE];
    bool scaled = moit_technique_rows[job->technique->kind]->scales_alpha;
    double max_alpha = moit_held_max_alpha(job->precision, job->technique->max_alpha);
    size_t scalar = job->precision == MOIT_FLOAT64 ? sizeof(double) : sizeof(float);
    moit_moments_read(job->precise, job->precision, job->technique, NULL, allow.bias, 1,
                      (const char *)job->b + (size_t)(pixel * count) * scalar, double_b, rule);
    double b0 = moit_number(job->precision, job->b0, pixel);
    for (int64_t first = 0; first < job->depths; first += BLOCK_POINTS) {
        int n = (int)(job->depths - first < BLOCK_POINTS ? job->depths - first : BLOCK_POINTS);
        int64_t at = pixel * job->depths + first;
        for (int i = 0; i < n; ++i) z[i] = moit_number(job->precision, job->z, at + i);
        for (int i = n; i < n + MOIT_PADDING; ++i) z[i] = z[0];
        job->precise->power_bounds(count, 1, (int32_t[2]){0, n}, z, double_b, rule, allow.blur,
                                   &allow.slack, at_least, at_most);
        for (int i = 0; i < n; ++i) {
            double alpha = job->alpha ? moit_number(job->precision, job->alpha, at + i) : 0.0;
            double own = -moit_log1p(-(scaled ? alpha * max_alpha : fmin(alpha, max_alpha)));
            double low, high;
            transmittance_between(b0, at_least[i], at_most[i], own, 0.0, allow.unit, &low, &high);
            moit_set_bounds(job->precision, job->lower, job->upper, at + i, low, high);
        }
    }
    return MOIT_OK;
}

/* Where moments prove nothing, what lies in front of a depth is part of the total. */
static moit_status bound_pixel_by_total(void *context, int64_t pixel, int thread) {
    (void)thread;
    const bounds_job *job = context;
    double unit = allowance_for(job->precision, 4, ASSUMED_FRAGMENTS).unit;
    double max_alpha = moit_held_max_alpha(job->precision, job->technique->max_alpha);
    double b0 = moit_number(job->precision, job->b0, pixel);
    for (int64_t i = pixel * job->depths; i < (pixel + 1) * job->depths; ++i) {
        double alpha = job->alpha ? moit_number(job->precision, job->alpha, i) : 0.0;
        double own = -moit_log1p(-fmin(alpha, max_alpha)), low, high;
        transmittance_between(b0, 0.0, 1.0, own, 0.0, unit, &low, &high);
        moit_set_bounds(job->precision, job->lower, job->upper, i, low, high);
    }
    return MOIT_OK;
}

moit_status moit_moments_bounds(const moit_technique *technique, moit_precision precision,
                                int64_t pixels, int64_t depths, const void *b0, const void *b,
                                const void *z, const void *alpha, void *lower, void *upper,
                                const moit_run *run) {
    if (pixels == 0 || depths == 0) return MOIT_OK;
    if (moit_stores_words(technique) || moit_stores_halves(technique)) {
        moit_moment_words_bounds(technique, precision, pixels, depths, b0, alpha, lower, upper);
        return MOIT_OK;
    }
    bounds_job job = {
        .technique = technique,
        .precise = moit_stages_of(MOIT_FLOAT64, run->isa),
        .precision = precision,
        .pixels = pixels,
        .depths = depths,
        .b0 = b0,
        .b = b,
        .z = z,
        .alpha = alpha,
        .lower = lower,
        .upper = upper,
        .part = 3 * (BLOCK_POINTS + MOIT_PADDING),
    };
    int64_t threads = run->threads < pixels ? run->threads : pixels;
    job.memory = malloc(job.part * (size_t)threads * sizeof *job.memory);
    if (!job.memory) return MOIT_NO_MEMORY;
    bool proves = moit_technique_rows[technique->kind]->bounds != NULL;
    moit_status status =
        moit_parallel_for(run, pixels, proves ? bound_pixel : bound_pixel_by_total, &job);
    free(job.memory);
    return status;
}
