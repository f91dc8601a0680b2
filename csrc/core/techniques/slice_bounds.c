/* What slices prove about the light in front of a place.
 *
 * Slices before those of a place's cell have fragments in front of it alone, and all that may be in
 * front is before the end of its cell's own. A code is less than a step off; what alpha is beyond a
 * code's most, or max_alpha, is counted beside, and a slice that is full may be any. */
#include "core/elementary.h"
#include "core/techniques/slices.h"

#include "core/techniques/table.h"

#include <math.h>

/* Where z may be out of order by rounding, in parts of its range. */
static double blur_of(moit_precision precision) {
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

typedef struct {
    double at_least, at_most;
} steps;

/* Steps in front of z by codes alone; infinite where a slice is full. */
static steps steps_at(const moit_slices *slices, const moit_slice_entry *table,
                      const uint32_t *sums, double most, double z, double blur) {
    int first = slot_at(table, slices->cells, z - blur),
        last = slot_at(table, slices->cells, z + blur), end = last / 2 + 2 * (last & 1);
    steps found = {(double)sums[first / 2], (double)sums[end]};
    for (int k = 0; k < end; ++k)
        if ((double)(sums[k + 1] - sums[k]) >= most) found.at_most = __builtin_inf();
    return found;
}

static void bound_pixel(const moit_job *job, const moit_tile *tile, const moit_slice_rows *rows,
                        int p, double *lower, double *upper) {
    const moit_slices *slices = job->prepared;
    moit_precision precision = job->fragments->precision;
    const int32_t *offsets = job->depths ? tile->curve_offsets : tile->offsets;
    const moit_slice_entry *table = rows->table_of[p];
    int n = tile->offsets[p + 1] - tile->offsets[p];
    double most = moit_slice_most(job->technique), quantum = slices->quantum,
           hidden = hidden_of(job, tile, p), total, high;
    /* less than a step, and what rounding of absorbances, to 2^-22 of them, makes of it */
    double doubt = (1.0 + 0x1p-5) * (double)n * quantum;
    if (!slices->table) moit_slices_own_table(job, slices, tile, rows, p);
    moit_slices_sum(job, slices, tile, rows, p, 1, true);
    moit_bounds_of_total(tile, p, &total, &high);
    for (int i = offsets[p]; i < offsets[p + 1]; ++i) {
        double z = moit_number(precision, job->depths ? tile->curve_z : tile->z, i), own = 0.0;
        steps found = steps_at(slices, table, rows->sums, most, z, blur_of(precision));
        if (!job->depths) own = -moit_log1p(-moit_number(precision, tile->alpha, i));
        double in_front = found.at_most * quantum + doubt + hidden - fmin(own, 1e300);
        double least = fmax(found.at_least * quantum - doubt, 0.0);
        double dimmest = moit_exp(-fmax(in_front, 0.0)) * (1.0 - 0x1p-50);
        upper[i] = fmin(1.0, moit_exp(-least) * (1.0 + 0x1p-50));
        lower[i] = fmin(fmax(dimmest, total), 1.0 - 0x1p-53); /* 1 is a claim of its own */
        if (!(lower[i] <= upper[i])) lower[i] = upper[i];
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
