/* What slices prove about the light in front of a place.
 *
 * Slices before those of a place's cell have fragments in front of it alone, and all that may be in
 * front is before the end of its cell's own. A code is less than a step off; what alpha is beyond a
 * code's most, or max_alpha, is counted beside, and a slice that is full may be any. */
#include "core/elementary.h"
#include "core/techniques/slices.h"

#include "core/techniques/table.h"

#include <math.h>

double moit_slice_blur(moit_precision precision) {
    return precision == MOIT_FLOAT64 ? 0x1p-50 : 0x1p-21;
}

static int slot_at(const moit_slice_entry *table, int cells, double z) {
    double x = z * (double)cells;
    int cell = x > 0.0 ? (int)fmin(x, (double)(cells - 1)) : 0;
    return table[cell].slot;
}

/* Optical depth that codes do not hold. */
static double hidden_of(const moit_job *job, const moit_tile *tile, int p) {
    moit_precision precision = job->fragments->precision;
    double most = fmin(moit_slice_depth_of_most(job->technique), -moit_log1p(-job->max_alpha)),
           hidden = 0.0;
    for (int i = tile->offsets[p]; i < tile->offsets[p + 1]; ++i)
        hidden += fmax(0.0, -moit_log1p(-moit_number(precision, tile->alpha, i)) - most);
    return hidden;
}

moit_slice_proof moit_slice_proof_of(const moit_job *job, const moit_tile *tile, int p,
                                     const uint32_t *sums) {
    int n = tile->offsets[p + 1] - tile->offsets[p];
    moit_slice_proof of = {.sums = sums,
                           .most = moit_slice_most(job->technique),
                           .quantum = moit_slice_quantum(job->technique),
                           .hidden = hidden_of(job, tile, p)};
    double high;
    /* less than a step, and what rounding of absorbances, to 2^-22 of them, makes of it */
    of.doubt = (1.0 + 0x1p-5) * (double)n * of.quantum;
    moit_bounds_of_total(tile, p, &of.total, &high);
    return of;
}

void moit_slice_prove(const moit_slice_proof *of, int first, int end, double alpha, double *lower,
                      double *upper) {
    double at_most = (double)of->sums[end], own = -moit_log1p(-alpha);
    for (int k = 0; k < end; ++k) /* a slice that is full may be any */
        if ((double)(of->sums[k + 1] - of->sums[k]) >= of->most) at_most = __builtin_inf();
    double in_front = at_most * of->quantum + of->doubt + of->hidden - fmin(own, 1e300);
    double least = fmax((double)of->sums[first] * of->quantum - of->doubt, 0.0);
    double dimmest = moit_exp(-fmax(in_front, 0.0)) * (1.0 - 0x1p-50);
    *upper = fmin(1.0, moit_exp(-least) * (1.0 + 0x1p-50));
    *lower = fmin(fmax(dimmest, of->total), 1.0 - 0x1p-53); /* 1 is a claim of its own */
    if (!(*lower <= *upper)) *lower = *upper;
}

static void bound_pixel(const moit_job *job, const moit_tile *tile, const moit_slice_rows *rows,
                        int p, double *lower, double *upper) {
    const moit_slices *slices = job->prepared;
    moit_precision precision = job->fragments->precision;
    const int32_t *offsets = job->depths ? tile->curve_offsets : tile->offsets;
    const moit_slice_entry *table = rows->table_of[p];
    double blur = moit_slice_blur(precision);
    if (!slices->table) moit_slices_own_table(job, slices, tile, rows, p);
    moit_slices_sum(job, slices, tile, rows, p, 1, true);
    moit_slice_proof proof = moit_slice_proof_of(job, tile, p, rows->sums);
    for (int i = offsets[p]; i < offsets[p + 1]; ++i) {
        double z = moit_number(precision, job->depths ? tile->curve_z : tile->z, i);
        double alpha = job->depths ? 0.0 : moit_number(precision, tile->alpha, i);
        int first = slot_at(table, slices->cells, z - blur),
            last = slot_at(table, slices->cells, z + blur);
        moit_slice_prove(&proof, first / 2, last / 2 + 2 * (last & 1), alpha, lower + i, upper + i);
    }
}

void moit_slices_bounds(const moit_job *job, moit_tile *tile, double *lower, double *upper) {
    const moit_slices *slices = job->prepared;
    const int32_t *offsets = job->depths ? tile->curve_offsets : tile->offsets;
    bool inside = job->technique->slices.inside;
    if (inside) moit_slices_moment_bounds(job, tile, lower, upper);
    else moit_total_bounds(job, tile, lower, upper);
    if (slices->sums) return; /* what blocks keep proves nothing of a pixel */
    moit_slice_rows rows = moit_slice_rows_of(job, tile);
    moit_slices_place_all(job, tile, &rows);
    moit_slices_join(job, slices, tile, &rows, job->depths > 0);
    double *low = tile->points[0], *high = tile->points[1];
    for (int p = 0; p < tile->pixels; ++p) {
        bound_pixel(job, tile, &rows, p, low, high);
        for (int i = offsets[p]; i < offsets[p + 1]; ++i) {
            double least = fmax(lower[i], low[i]), most = fmin(upper[i], high[i]);
            if (least > most) continue; /* by last digits: either is right */
            lower[i] = least;
            upper[i] = most;
        }
    }
}
