/* Backwards through slices of optical depth, kernels/slices.h. What rounding to whole steps has
 * added to a fragment's code, and to its share of a slice, stays what it is: all else varies.
 * Slices stand where they stand. */
#include "core/techniques/slices.h"

#include "core/techniques/table.h"

#include <string.h>

const char *moit_slices_refusal(const moit_technique *technique) {
    return technique->resolution > 1
               ? "pixels that share a block's slices have none yet; use resolution=1"
               : NULL;
}

enum { MOST_SUMS = MOIT_MOST_SLICES + 4 };

/* What places have as doubles. */
typedef struct {
    const double *joined, *before, *at, *behind, *share;
    const int32_t *slot;
} places;

static places places_of(const moit_slice_places *p) {
    return (places){.joined = (const double *)(const void *)p->joined,
                    .before = (const double *)(const void *)p->before,
                    .at = (const double *)(const void *)p->at,
                    .behind = (const double *)(const void *)p->behind,
                    .share = (const double *)(const void *)p->share,
                    .slot = p->slot};
}

/* How fast a place moves in its joined cell. */
static double rise_of(const places *at, int i, double z, int cells) {
    return z > 0.0 && z < 1.0 && at->joined[i] < 1.0 ? cells * at->share[i] : 0.0;
}

/* A pixel's: codes of its fragments, and where these lie. */
typedef struct {
    const double *code, *near, *far;
    places own;
    int cells, first, end;
    double most, half_step, quantum;
} slices_of_pixel;

/* By sums before slices, from what was read at places `first` on. */
static void read_sums(const slices_of_pixel *s, const places *read, int first,
                      const moit_readings *at, double *by_code, double *by_before) {
    for (int i = 0; i < at->n; ++i) {
        int k = first + i, slot = read->slot[k] / 2, any = read->slot[k] & 1;
        double inside = read->joined[k], twice, own = 0.0;
        twice = read->before[k] + read->at[k] + inside * (read->behind[k] - read->before[k]);
        if (by_code) own = s->near[k] + inside * s->code[k];
        if (!(twice > own)) continue;
        double by = at->by[i] * s->half_step;
        by_before[slot] += by * (1.0 - inside);
        by_before[slot + any] += by;
        by_before[slot + 2 * any] += by * inside;
        at->by_z[i] +=
            by * (read->behind[k] - read->before[k]) * rise_of(read, k, at->z[i], s->cells);
        if (by_code) by_code[i] -= by;
    }
}

void moit_slices_pull_sums(int n, const int32_t *slot, const double *near, const double *far,
                           double most, double *by_sum) {
    double sum[MOST_SUMS] = {0.0}, behind = 0.0;
    for (int i = 0; i < n; ++i) {
        sum[slot[i] / 2] += near[i];
        sum[slot[i] / 2 + 1] += far[i];
    }
    for (int k = MOST_SUMS; k-- > 0;) { /* a slice is in all sums before later ones */
        double here = by_sum[k];
        by_sum[k] = sum[k] >= most ? 0.0 : behind;
        behind += here;
    }
}

/* By what is added to slices to fragments. */
static void pull_slices(const slices_of_pixel *s, const double *by_slice, const double *z,
                        double *by_code, double *by_z, double *by_a) {
    for (int i = s->first; i < s->end; ++i) {
        int k = s->own.slot[i] / 2;
        double near = by_slice[k], far = by_slice[k + 1];
        double inside = s->own.joined[i];
        double by = by_code[i - s->first] + (1.0 - inside) * near + inside * far;
        by_z[i] += s->code[i] * (far - near) * rise_of(&s->own, i, z[i], s->cells);
        if (s->code[i] < s->most) by_a[i] += by / s->quantum;
    }
}

void moit_slices_pull_back(const moit_job *job, moit_tile *tile, const moit_adjoint *by) {
    const moit_slices *slices = job->prepared;
    moit_slice_rows rows = moit_slice_rows_of(job, tile);
    places read = places_of(moit_slice_places_of(job, &rows));
    slices_of_pixel s = {.code = (const double *)(const void *)rows.code,
                         .near = (const double *)(const void *)rows.near,
                         .far = (const double *)(const void *)rows.far,
                         .own = places_of(&rows.of_fragments),
                         .cells = slices->cells,
                         .most = moit_slice_most(job->technique),
                         .half_step = 0.5 * slices->quantum,
                         .quantum = slices->quantum};
    double *by_code = by->work[0];
    moit_adjoint_begin(job, tile, by);
    if (job->technique->slices.inside) moit_slices_take_bounded(job, tile, by);
    for (int p = 0; p < tile->pixels; ++p) {
        double by_sum[MOST_SUMS] = {0.0};
        moit_readings at = moit_readings_of(job, tile, by, p, false);
        s.first = tile->offsets[p];
        s.end = tile->offsets[p + 1];
        memset(by_code + s.first, 0, (size_t)(s.end - s.first) * sizeof *by_code);
        read_sums(&s, &read, moit_slice_offsets(job, tile)[p], &at,
                  job->depths ? NULL : by_code + s.first, by_sum);
        moit_slices_pull_sums(s.end - s.first, s.own.slot + s.first, s.near + s.first,
                              s.far + s.first, s.most, by_sum);
        pull_slices(&s, by_sum, tile->z, by_code + s.first, by->work[1], by->work[2]);
    }
    if (job->technique->slices.inside) moit_slices_pull_bounds(job, tile, by);
    moit_adjoint_of_absorbance(job, tile, by);
    moit_adjoint_of_totals(tile, by, by->total);
    moit_adjoint_of_warp(job, tile, by);
}
