/* How far moments are from those of no distribution, and what bias brings them back. */
#include "core/elementary.h"
#include "core/techniques/moments.h"
#include "core/techniques/table.h"
#include "core/threads.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Biases below 2^-LEAST_EXPONENT do nothing to doubles; they are sought in steps of four, and
 * between these by halving. */
enum { ITEM_PIXELS = 64, LEAST_EXPONENT = 60, STEP = 2, HALVINGS = 11 };

typedef struct {
    const moit_technique *technique;
    const moit_stages *precise;
    moit_precision precision;
    int64_t pixels;
    const void *b0, *b;
    bool needed; /* the least bias, not the least pivot */
    double *out;
} pivots_job;

typedef struct {
    double b[ITEM_PIXELS * MOIT_MOST_NUMBERS], bias[ITEM_PIXELS], pivot[ITEM_PIXELS];
    int from[ITEM_PIXELS]; /* the pixel of the item that each is */
    int pixels;
} rays;

static void find_pivots(const pivots_job *job, rays *r) {
    const moit_moment_family *family = moit_family_of(job->technique);
    moit_wrapping_zone zone = moit_wrapping_zone_of(job->technique);
    job->precise->moments[family->stages].pivots(job->technique->count, &zone, r->pixels, r->b,
                                                 r->bias, family->constants(job->technique)->safe,
                                                 r->pivot);
}

/* Exponents of bias: with low none is positive, with high all are. */
static void find_biases(const pivots_job *job, rays *r, double *out) {
    double low[ITEM_PIXELS], high[ITEM_PIXELS];
    for (int p = 0; p < r->pixels; ++p) high[p] = HUGE_VAL;
    for (int exponent = -LEAST_EXPONENT; exponent <= 0; exponent += STEP) {
        for (int p = 0; p < r->pixels; ++p) r->bias[p] = moit_exp2(exponent);
        find_pivots(job, r);
        for (int p = 0; p < r->pixels; ++p)
            if (r->pivot[p] > 0.0 && isinf(high[p])) {
                high[p] = exponent;
                low[p] = exponent - STEP;
            }
    }
    for (int halving = 0; halving < HALVINGS; ++halving) {
        for (int p = 0; p < r->pixels; ++p)
            r->bias[p] = isinf(high[p]) ? 1.0 : moit_exp2(0.5 * (low[p] + high[p]));
        find_pivots(job, r);
        for (int p = 0; p < r->pixels; ++p) {
            if (isinf(high[p])) continue;
            double middle = 0.5 * (low[p] + high[p]);
            if (r->pivot[p] > 0.0) high[p] = middle;
            else low[p] = middle;
        }
    }
    for (int p = 0; p < r->pixels; ++p) out[r->from[p]] = moit_exp2(high[p]);
}

static moit_status answer_item(void *context, int64_t item, int thread) {
    (void)thread;
    const pivots_job *job = context;
    size_t numbers = (size_t)moit_moment_set(job->technique);
    int64_t first = item * ITEM_PIXELS;
    int pixels = (int)(first + ITEM_PIXELS < job->pixels ? ITEM_PIXELS : job->pixels - first);
    double *out = job->out + first;
    rays r = {.pixels = 0};
    for (int p = 0; p < pixels; ++p) {
        out[p] = job->needed ? 0.0 : 1.0;
        if (!(moit_number(job->precision, job->b0, first + p) > 0.0)) continue;
        double *own = r.b + (size_t)r.pixels * numbers;
        for (size_t k = 0; k < numbers; ++k)
            own[k] = moit_number(job->precision, job->b, (first + p) * (int64_t)numbers + (int)k);
        r.bias[r.pixels] = job->needed ? 0.0 : job->technique->moments.bias;
        r.from[r.pixels++] = p;
    }
    if (job->technique->kind == MOIT_MOMENT_TRANSPARENCY
        && job->technique->transparency.storage == MOIT_STORAGE_UNORM16)
        job->precise->unorm16_moments(job->technique->transparency.symmetric, r.pixels, r.b, NULL);
    find_pivots(job, &r);
    if (!job->needed) {
        for (int p = 0; p < r.pixels; ++p) out[r.from[p]] = r.pivot[p];
        return MOIT_OK;
    }
    int left = 0; /* those that need any */
    for (int p = 0; p < r.pixels; ++p) {
        if (r.pivot[p] > 0.0) continue;
        memmove(r.b + (size_t)left * numbers, r.b + (size_t)p * numbers, numbers * sizeof *r.b);
        r.from[left++] = r.from[p];
    }
    r.pixels = left;
    if (left) find_biases(job, &r, out);
    return MOIT_OK;
}

static moit_status ask(pivots_job job, const moit_run *run) {
    job.precise = moit_stages_of(MOIT_FLOAT64, run->isa);
    return moit_parallel_for(run, (job.pixels + ITEM_PIXELS - 1) / ITEM_PIXELS, answer_item, &job);
}

int moit_moment_set(const moit_technique *technique) {
    const moit_moment_family *family = moit_family_of(technique);
    return family ? family->numbers(technique->count) : 0;
}

moit_status moit_moments_pivots(const moit_technique *technique, moit_precision precision,
                                int64_t pixels, const void *b0, const void *b, double *pivot,
                                const moit_run *run) {
    return ask((pivots_job){.technique = technique,
                            .precision = precision,
                            .pixels = pixels,
                            .b0 = b0,
                            .b = b,
                            .out = pivot},
               run);
}

moit_status moit_moments_least_bias(const moit_technique *technique, moit_precision precision,
                                    int64_t pixels, const void *b0, const void *b, double *bias,
                                    const moit_run *run) {
    return ask((pivots_job){.technique = technique,
                            .precision = precision,
                            .pixels = pixels,
                            .b0 = b0,
                            .b = b,
                            .needed = true,
                            .out = bias},
               run);
}
