/* Shadow maps of what adds up: sums a texel, filtered, and looked up between texels.
 *
 * Moments of absorbance add up where they are not divided by it, and so do Fourier coefficients:
 * Muenstermann et al., "Moment-Based Order-Independent Transparency", 2018, section 6; Jansen and
 * Bavoil, "Fourier Opacity Mapping", 2010. Whoever looks up divides again. Opaque casters are a
 * distribution of depth, whose share in front of a point is its shadow: Peters and Klein, "Moment
 * Shadow Mapping", 2015. */
#include "core/elementary.h"
#include "core/techniques/moments.h"
#include "core/techniques/table.h"
#include "core/threads.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_SUMS = 32, POINTS = 256 };

int moit_texel_numbers(const moit_technique *technique) {
    if (!moit_technique_rows[technique->kind]->adds_texels) return 0;
    const moit_moment_family *family = moit_family_of(technique);
    return family ? 1 + family->numbers(technique->count) : technique->count;
}

/* ---- Sums a texel ---------------------------------------------------------------------------- */

static void sum_tile(const moit_job *job, moit_tile *tile, void *sums) {
    moit_precision precision = job->fragments->precision;
    int numbers = moit_texel_numbers(job->technique);
    int64_t first = tile->first_pixel * numbers;
    if (job->technique->kind == MOIT_FOURIER_OPACITY) {
        moit_fourier_gather(job, tile);
        memcpy((char *)sums + (size_t)first * job->scalar, tile->own,
               (size_t)(tile->pixels * numbers) * job->scalar);
        return;
    }
    moit_moments_gather(job, tile);
    for (int p = 0; p < tile->pixels; ++p) {
        double b0 = moit_number(precision, tile->b0, p);
        int64_t at = first + (int64_t)p * numbers;
        moit_set_number(precision, sums, at, b0);
        for (int k = 1; k < numbers; ++k)
            moit_set_number(precision, sums, at + k,
                            b0 * moit_number(precision, tile->b, p * (numbers - 1) + k - 1));
    }
}

moit_status moit_texel_sums(const moit_fragments *fragments, const moit_technique *technique,
                            void *sums, const moit_run *run) {
    moit_job job = moit_job_of(fragments, technique, false, run);
    return moit_for_tiles(&job, sum_tile, sums);
}

/* ---- Filtered -------------------------------------------------------------------------------- */

typedef struct {
    const moit_texels *from;
    int taps;
    const double *weights;
    void *to;
    double *rows; /* one a thread: of the map's width, and half of the taps on either side */
    int64_t row;
} filtering;

/* Adds `weight` times n numbers from number `at` on. */
static void add_row(const moit_texels *from, int64_t at, double weight, int64_t n, double *sum) {
    if (from->precision == MOIT_FLOAT64) {
        const double *row = (const double *)from->sums + at;
        for (int64_t i = 0; i < n; ++i) sum[i] += weight * row[i];
    } else {
        const float *row = (const float *)from->sums + at;
        for (int64_t i = 0; i < n; ++i) sum[i] += weight * (double)row[i];
    }
}

static int64_t within(int64_t i, int64_t end) { return i < 0 ? 0 : i < end ? i : end - 1; }

/* Columns first and then rows, of one row of texels; beyond the map its border goes on. */
static moit_status filter_row(void *context, int64_t y, int thread) {
    const filtering *f = context;
    const moit_texels *from = f->from;
    int numbers = from->numbers, half = f->taps / 2;
    int64_t n = from->width * numbers, margin = (int64_t)half * numbers;
    double *row = f->rows + thread * f->row, *sum = row + n + 2 * margin;
    memset(row, 0, (size_t)(n + 2 * margin) * sizeof *row);
    for (int k = 0; k < f->taps; ++k)
        add_row(from, within(y + k - half, from->height) * n, f->weights[k], n, row + margin);
    for (int k = 0; k < half; ++k) {
        memcpy(row + (int64_t)k * numbers, row + margin, (size_t)numbers * sizeof *row);
        memcpy(row + margin + n + (int64_t)k * numbers, row + margin + n - numbers,
               (size_t)numbers * sizeof *row);
    }
    memset(sum, 0, (size_t)n * sizeof *sum);
    for (int k = 0; k < f->taps; ++k)
        for (int64_t i = 0; i < n; ++i) sum[i] += f->weights[k] * row[i + (int64_t)k * numbers];
    for (int64_t i = 0; i < n; ++i) moit_set_number(from->precision, f->to, y * n + i, sum[i]);
    return MOIT_OK;
}

moit_status moit_filter_texels(const moit_texels *texels, int taps, const double *weights,
                               void *filtered, const moit_run *run) {
    if (texels->width == 0 || texels->height == 0) return MOIT_OK;
    filtering f = {.from = texels, .taps = taps, .weights = weights, .to = filtered};
    f.row = (2 * texels->width + taps) * texels->numbers;
    int64_t threads = run->threads < texels->height ? run->threads : texels->height;
    f.rows = malloc((size_t)(threads * f.row) * sizeof *f.rows);
    if (!f.rows) return MOIT_NO_MEMORY;
    moit_status status = moit_parallel_for(run, texels->height, filter_row, &f);
    free(f.rows);
    return status;
}

/* Words of 16 bits that hold four moments, a texel each. */
typedef struct {
    const moit_texels *texels;
    const moit_stages *precise;
    void *to;
} holding;

static moit_status hold_row(void *context, int64_t y, int thread) {
    const holding *h = context;
    moit_precision precision = h->texels->precision;
    int64_t first = 4 * y * h->texels->width, n = 4 * h->texels->width;
    (void)thread;
    for (int64_t i = 0; i < n; i += 4 * POINTS) {
        double b[4 * POINTS];
        int count = (int)(n - i < 4 * POINTS ? n - i : 4 * POINTS);
        for (int k = 0; k < count; ++k)
            b[k] = moit_number(precision, h->texels->sums, first + i + k);
        h->precise->unorm16_moments(true, count / 4, b, NULL);
        for (int k = 0; k < count; ++k) moit_set_number(precision, h->to, first + i + k, b[k]);
    }
    return MOIT_OK;
}

moit_status moit_hold_texels(const moit_texels *texels, void *held, const moit_run *run) {
    holding h = {texels, moit_stages_of(MOIT_FLOAT64, run->isa), held};
    return moit_parallel_for(run, texels->height, hold_row, &h);
}

/* ---- Looked up ------------------------------------------------------------------------------- */

typedef struct {
    const moit_texels *texels;
    const moit_technique *technique;
    const moit_stages *stages;
    moit_warp_map warp;
    double near, far;
    bool opaque;
    int64_t points;
    const double *place, *alpha;
    double *out;
    struct block *blocks; /* one a thread */
} looking;

/* What a block of points works with. */
typedef struct block {
    double sums[POINTS][MOST_SUMS]; /* between texels */
    double b[POINTS * MOST_SUMS], b0[POINTS + MOIT_PADDING], rules[POINTS * MOIT_MOST_RULE];
    double depth[POINTS + MOIT_PADDING], z[POINTS + MOIT_PADDING], own[POINTS + MOIT_PADDING],
        T[POINTS + MOIT_PADDING], total[POINTS + MOIT_PADDING];
    int32_t offsets[POINTS + 1];
} block;

/* The sums at (x, y), in texels from the outer corner of the first; 0 outside. */
static void between_texels(const moit_texels *t, double x, double y, double *sums) {
    for (int k = 0; k < t->numbers; ++k) sums[k] = 0.0;
    if (t->width == 0 || t->height == 0) return;
    if (!(x >= 0.0 && y >= 0.0 && x <= (double)t->width && y <= (double)t->height)) return;
    double left = floor(x - 0.5), top = floor(y - 0.5);
    double across = x - 0.5 - left, along = y - 0.5 - top;
    for (int corner = 0; corner < 4; ++corner) {
        int right = corner & 1, below = corner >> 1;
        double weight = (right ? across : 1.0 - across) * (below ? along : 1.0 - along);
        int64_t column = within((int64_t)left + right, t->width),
                row = within((int64_t)top + below, t->height);
        add_row(t, (row * t->width + column) * t->numbers, weight, t->numbers, sums);
    }
}

static void read_moments(const looking *l, block *w, int n) {
    const moit_technique *technique = l->technique;
    const moit_moment_family *family = moit_family_of(technique);
    const moit_moment_stages *stages = &l->stages->moments[family->stages];
    int numbers = family->numbers(technique->count);
    moit_wrapping_zone zone = moit_wrapping_zone_of(technique);
    moit_moment_steps steps = moit_technique_moments(technique, l->texels->precision);
    for (int i = 0; i < n; ++i) {
        const double *sums = w->sums[i];
        bool there = l->opaque ? true : sums[0] > 0x1p-100;
        w->b0[i] = l->opaque ? 1.0 : sums[0];
        for (int k = 0; k < numbers; ++k)
            w->b[i * numbers + k] = l->opaque ? sums[k] : there ? sums[1 + k] / sums[0] : 0.0;
    }
    stages->rules(technique->count, &zone, false, n, w->b, technique->moments.bias, steps.safe,
                  steps.least, w->rules);
    stages->transmittance(technique->count, &zone, n, w->offsets, w->z, l->alpha ? w->own : NULL,
                          w->rules, w->b0, technique->moments.overestimation, false, w->T);
}

static void read_fourier(const looking *l, block *w, int n) {
    int numbers = l->texels->numbers;
    for (int i = 0; i < n; ++i) {
        w->b0[i] = w->sums[i][0];
        memcpy(w->b + i * numbers, w->sums[i], (size_t)numbers * sizeof(double));
    }
    l->stages->fourier_transmittance(l->technique->count, n, w->offsets, w->z,
                                     l->alpha ? w->own : NULL, w->b, false, w->T);
}

static bool outside(const moit_texels *t, const double *place) {
    return !(place[0] >= 0.0 && place[1] >= 0.0 && place[0] <= (double)t->width
             && place[1] <= (double)t->height);
}

static moit_status look_up_block(void *context, int64_t item, int thread) {
    const looking *l = context;
    block *w = &l->blocks[thread];
    int64_t first = item * POINTS;
    int n = (int)(l->points - first < POINTS ? l->points - first : POINTS);
    const double *place = l->place + 3 * first;
    for (int i = 0; i < n; ++i) {
        between_texels(l->texels, place[3 * i], place[3 * i + 1], w->sums[i]);
        w->depth[i] = fmin(fmax(place[3 * i + 2], l->near), l->far);
        w->offsets[i] = i;
    }
    w->offsets[n] = n;
    l->stages->warp(n, w->depth, &l->warp, w->z);
    if (l->alpha) l->stages->absorbance(n, l->alpha + first, l->technique->max_alpha, w->own);
    if (l->technique->kind == MOIT_FOURIER_OPACITY) read_fourier(l, w, n);
    else read_moments(l, w, n);
    l->stages->decay(n, w->b0, w->total);
    for (int i = 0; i < n; ++i) {
        double depth = place[3 * i + 2], T = w->T[i];
        if (!l->opaque && depth > l->far) T = w->total[i];
        if (l->opaque) T = fmin(fmax(1.0 + moit_log(T), 0.0), 1.0);
        if (outside(l->texels, place + 3 * i) || depth <= l->near) T = 1.0;
        l->out[first + i] = T;
    }
    return MOIT_OK;
}

moit_status moit_shadow_at(const moit_texels *texels, const moit_technique *technique, double near,
                           double far, bool opaque, int64_t points, const double *place,
                           const double *alpha, double *out, const moit_run *run) {
    looking l = {.texels = texels,
                 .technique = technique,
                 .stages = moit_stages_of(MOIT_FLOAT64, run->isa),
                 .warp = moit_warp_over(technique, near, far),
                 .near = near,
                 .far = far,
                 .opaque = opaque,
                 .points = points,
                 .place = place,
                 .alpha = alpha,
                 .out = out};
    int64_t blocks = (points + POINTS - 1) / POINTS;
    if (blocks == 0) return MOIT_OK;
    l.blocks = malloc((size_t)(run->threads < blocks ? run->threads : blocks) * sizeof *l.blocks);
    if (!l.blocks) return MOIT_NO_MEMORY;
    moit_status status = moit_parallel_for(run, blocks, look_up_block, &l);
    free(l.blocks);
    return status;
}
