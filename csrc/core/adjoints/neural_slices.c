/* Backwards through slices that a network reads, kernels/slice_network.h: the network, what it sees
 * of sums around a place, and slices. What rounding has added to a fragment's code, to its share of
 * a slice and to its pixel's ends stays what it is, as does between which slices it lies: all else
 * varies. The ends move with the nearest and the farthest fragment. */
#include "core/adjoints/networks.h"
#include "core/techniques/neural_slices.h"
#include "core/techniques/slices.h"
#include "core/techniques/table.h"

#include <math.h>
#include <string.h>

enum { INPUTS = MOIT_SLICE_INPUTS, HIDDEN = MOIT_SLICE_HIDDEN, MOST_SUMS = MOIT_MOST_SLICES + 4 };
enum { CHUNK = 64, STRIDE = CHUNK + MOIT_PADDING };
enum { OUTER, FRONT, MIDDLE, BACK, BEYOND, ALL, AROUND };

/* What a tile has. */
typedef struct {
    moit_network_shape network;
    const double *code, *near, *far, *inside, *asked_inside, *around;
    const int32_t *slot, *asked_slot;
    int64_t asked;
    double most, quantum, last; /* of codes; of a step; slices behind the first */
} slices_read;

/* A pixel's ends, and derivatives by these and by the sum before each slice. */
typedef struct {
    double nearest, farthest, by_nearest, by_farthest, by_sum[MOST_SUMS];
} pixel_state;

/* By sums around a place, the code of what lies there and how far between its slices it is. */
typedef struct {
    double sum[AROUND], code, inside, absorbed;
} by_place;

static bool within(double x, double least, double most) { return x > least && x < most; }

/* A place in front of its pixel's extent, or behind. */
static bool is_beside(double inside) { return fabs(inside - 0.5) > 1.0; }

/* By what is absorbed in front of a place that sees x. */
static by_place pull_place(const slices_read *s, const double *sum, double inside, double code,
                           const double *x, double by, double *by_w) {
    by_place to = {.sum = {0.0}};
    double by_x[INPUTS] = {0.0}, quantum = s->quantum, all = fmax(sum[ALL], 1.0);
    double both = sum[BACK] - sum[FRONT], open = fmax(both - code, 0.0);
    to.sum[inside > 1.5 ? BACK : FRONT] += by * quantum;
    if (is_beside(inside)) return to;
    moit_network_activity a = moit_ask_network(&s->network, x);
    moit_pull_network(&s->network, x, &a, by * open * quantum, by_x, by_w);
    double by_open = by * a.share * quantum + by_x[1] / all, twice = 0.0;
    to.absorbed = by_x[2];
    to.inside = by_x[3];
    /* shares of all */
    to.sum[FRONT] += (by_x[0] + by_x[5]) / all;
    to.sum[OUTER] -= by_x[5] / all;
    to.sum[BEYOND] += by_x[6] / all;
    to.sum[BACK] -= by_x[6] / all;
    if (sum[ALL] > 1.0)
        to.sum[ALL] -= (by_x[0] * x[0] + by_x[1] * x[1] + by_x[5] * x[5] + by_x[6] * x[6]) / all;
    /* the share of both that the slice in front has */
    to.sum[MIDDLE] += by_x[4] / fmax(both, 1.0);
    to.sum[FRONT] -= by_x[4] / fmax(both, 1.0);
    if (both > 1.0) {
        to.sum[BACK] -= by_x[4] * x[4] / both;
        to.sum[FRONT] += by_x[4] * x[4] / both;
    }
    if (within(x[7], -8.0, 8.0) && sum[ALL] * quantum > 1e-4) to.sum[ALL] += by_x[7] / sum[ALL];
    if (within(x[9], -8.0, 3.0) && open * quantum > 1e-4) by_open += by_x[9] / open;
    /* what slices say without a network, (twice / 2 - front) / open, is within [0, 1] */
    if (within(x[8], 0.0, 1.0)) {
        twice = 0.5 * by_x[8] / fmax(open, 1.0);
        to.sum[FRONT] -= by_x[8] / fmax(open, 1.0);
        if (open > 1.0) by_open -= by_x[8] * x[8] / open;
    }
    to.sum[FRONT] += twice * (1.0 - inside);
    to.sum[MIDDLE] += twice;
    to.sum[BACK] += twice * inside;
    to.inside += twice * both;
    to.code -= twice; /* what it has added to that itself, wherever it lies */
    if (both > code) {
        to.sum[BACK] += by_open;
        to.sum[FRONT] -= by_open;
        to.code -= by_open;
    }
    return to;
}

/* From how far between slices z is to z and the pixel's ends. */
static void pull_inside(const slices_read *s, pixel_state *of, double z, double by, double *by_z) {
    double extent = of->farthest - of->nearest, rise = by * s->last / extent;
    if (!within(z, of->nearest, of->farthest)) return;
    *by_z += rise;
    of->by_nearest -= rise * (of->farthest - z) / extent;
    of->by_farthest -= rise * (z - of->nearest) / extent;
}

/* From what is asked about, at `first` on of its rows, to sums; by_code of what lies there, or NULL
 * where nothing does. */
static void pull_readings(const moit_job *job, const slices_read *s, const moit_readings *at,
                          int first, pixel_state *of, double *by_code, double *by_w) {
    double column[(INPUTS + 2) * STRIDE];
    for (int from = 0; from < at->n; from += CHUNK) {
        int n = at->n - from < CHUNK ? at->n - from : CHUNK, k = first + from;
        const double *inside = s->asked_inside + k;
        job->stages->slice_features(n, s->around + k, s->asked, inside,
                                    by_code ? s->near + k : NULL, by_code ? s->code + k : NULL,
                                    at->own ? at->own + from : NULL, s->quantum, STRIDE, column);
        for (int i = 0; i < n; ++i) {
            double x[INPUTS], sum[AROUND];
            for (int j = 0; j < INPUTS; ++j) x[j] = column[j * STRIDE + i];
            for (int j = 0; j < AROUND; ++j) sum[j] = s->around[j * s->asked + k + i];
            by_place by = pull_place(s, sum, inside[i], by_code ? s->code[k + i] : 0.0, x,
                                     at->by[from + i], by_w);
            int cell = s->asked_slot[k + i] / 2;
            for (int j = OUTER; j <= BEYOND; ++j) /* nothing is before the first */
                if (cell + j > 0) of->by_sum[cell + j - 1] += by.sum[j];
            of->by_sum[(int)s->last + 1] += by.sum[ALL];
            pull_inside(s, of, at->z[from + i], by.inside, at->by_z + from + i);
            if (!by_code) continue;
            by_code[from + i] += by.code;
            at->by_own[from + i] += by.absorbed;
        }
    }
}

/* From what is added to slices to n fragments. */
static void pull_slices(const slices_read *s, pixel_state *of, int first, int n, const double *z,
                        const double *alpha, const double *by_code, double *by_z, double *by_a) {
    int nearest = -1, farthest = -1;
    for (int i = 0; i < n; ++i) {
        double inside = s->inside[first + i], code = s->code[first + i];
        if (is_beside(inside)) continue;
        int k = s->slot[first + i] / 2;
        double near = of->by_sum[k], far = of->by_sum[k + 1];
        if (code < s->most)
            by_a[i] += (by_code[i] + (1.0 - inside) * near + inside * far) / s->quantum;
        pull_inside(s, of, z[i], code * (far - near), by_z + i);
        if (!(alpha[i] > 0.0)) continue; /* what covers nothing widens no extent */
        if (nearest < 0 || z[i] < z[nearest]) nearest = i;
        if (farthest < 0 || z[i] > z[farthest]) farthest = i;
    }
    if (nearest < 0) return;
    by_z[nearest] += of->by_nearest;
    by_z[farthest] += of->by_farthest;
}

static const double *doubles(const char *row) { return (const double *)(const void *)row; }

void moit_neural_slices_pull_back(const moit_job *job, moit_tile *tile, const moit_adjoint *by) {
    const moit_technique *technique = job->technique;
    moit_neural_slice_rows rows = moit_neural_slice_rows_of(job, tile);
    bool depths = job->depths > 0;
    slices_read s = {.network = {technique->slices.network, INPUTS, HIDDEN, HIDDEN},
                     .code = doubles(rows.code),
                     .near = doubles(rows.near),
                     .far = doubles(rows.far),
                     .inside = doubles(rows.inside),
                     .asked_inside = doubles(depths ? rows.asked_inside : rows.inside),
                     .around = doubles(rows.around),
                     .slot = rows.slot,
                     .asked_slot = depths ? rows.asked_slot : rows.slot,
                     .asked = rows.asked,
                     .most = moit_slice_most(technique),
                     .quantum = moit_slice_quantum(technique),
                     .last = technique->count - 1};
    double *by_code = by->work[0];
    moit_adjoint_begin(job, tile, by);
    memset(by_code, 0, (size_t)tile->fragments * sizeof *by_code);
    for (int p = 0; p < tile->pixels; ++p) {
        int first = tile->offsets[p], n = tile->offsets[p + 1] - first;
        pixel_state of = {.nearest = tile->sums[2 * p], .farthest = tile->sums[2 * p + 1]};
        moit_readings at = moit_readings_of(job, tile, by, p, true);
        pull_readings(job, &s, &at, moit_slice_offsets(job, tile)[p], &of,
                      depths ? NULL : by_code + first, by->network);
        moit_slices_pull_sums(n, s.slot + first, s.near + first, s.far + first, s.most, of.by_sum);
        pull_slices(&s, &of, first, n, (const double *)tile->z + first,
                    (const double *)tile->alpha + first, by_code + first, by->work[1] + first,
                    by->work[2] + first);
    }
    moit_adjoint_of_absorbance(job, tile, by);
    moit_adjoint_of_totals(tile, by, by->total);
    moit_adjoint_of_warp(job, tile, by);
}
