/* Slices and four power moments of each pixel.
 *
 * Moments of a pixel prove between which ends lies what is in front of a place, and the moments of
 * slices, which these have themselves, prove it of the slices. Slices of a block of pixels stand
 * somewhere on the way from one of their ends to the other: there the pixel's light is read on the
 * way between its own. Where a pixel is as its block this is what the slices say; where it is not,
 * its own moments have more to say than which end is nearer. Ours. */
#include "core/elementary.h"
#include "core/techniques/slices.h"

#include "core/techniques/table.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOMENTS = 4 };

moit_job moit_slices_job_of_moments(const moit_job *job, moit_technique *moments) {
    *moments = (moit_technique){
        .kind = MOIT_POWER_MOMENTS,
        .count = MOMENTS,
        .max_alpha = job->technique->max_alpha,
        .warp = job->technique->warp,
        .range_per_pixel = job->technique->range_per_pixel,
        .moments = {.exclude_self = true, .bits = 32},
    };
    moments->moments.bias = moit_default_bias(moments, job->fragments->precision);
    moit_job of = *job;
    of.technique = moments;
    of.bias = moments->moments.bias;
    of.warp = moit_warp_over(moments, job->fragments->near, job->fragments->far);
    return of;
}

void moit_slices_moment_bounds(const moit_job *job, moit_tile *tile, double *lower, double *upper) {
    moit_technique moments;
    moit_job of = moit_slices_job_of_moments(job, &moments);
    moit_power_bounds(&of, tile, lower, upper);
}

/* ---- Of blocks ------------------------------------------------------------------------------- */

static void add_slice(double steps, double z, double *sums) {
    double power = steps;
    for (int k = 0; k < MOMENTS; ++k) {
        power *= z;
        sums[k] += power;
    }
}

/* Sums of powers of where a block's slices stand, `low` to `low + extent` from the first cell's
 * front to the last one's back. */
static void sum_powers(const moit_slices *slices, const moit_slice_entry *table,
                       const uint32_t *before, double low, double extent, double *sums) {
    double cells = (double)slices->cells;
    for (int cell = 0, last = -1; cell < slices->cells;) {
        moit_slice_entry e = table[cell];
        int slot = e.slot / 2, length = e.slot & 1 ? (int)(1.0F / e.share + 0.5F) : 1;
        double front = low + extent * ((double)cell / cells);
        cell += length;
        if (!(e.slot & 1)) continue;
        double back = low + extent * ((double)cell / cells);
        if (slot != last) add_slice((double)(before[slot + 1] - before[slot]), front, sums);
        add_slice((double)(before[slot + 2] - before[slot + 1]), back, sums);
        last = slot + 1;
    }
}

moit_status moit_slice_moments_make(const moit_technique *technique, moit_slices *slices) {
    int64_t blocks = slices->blocks.across * slices->blocks.down;
    slices->powers = calloc((size_t)blocks * MOMENTS, sizeof *slices->powers);
    if (!slices->powers) return MOIT_NO_MEMORY;
    bool warped = technique->warp != MOIT_WARP_NONE; /* else both have depth as it is */
    for (int64_t b = 0; b < blocks; ++b)
        sum_powers(slices, slices->table + moit_slice_region_of(slices, b) * slices->cells,
                   slices->sums + b * (slices->slots + 3), warped ? -1.0 : 0.0, warped ? 2.0 : 1.0,
                   slices->powers + b * MOMENTS);
    return MOIT_OK;
}

/* Mean powers of the slices that pixels read, into tile->b. */
static void read_powers(const moit_job *job, moit_tile *tile, const moit_slice_rows *rows) {
    const moit_slices *slices = job->prepared;
    for (int p = 0; p < tile->pixels; ++p) {
        double steps = 0.0, powers[MOMENTS] = {0.0};
        for (int k = 0; k < 4; ++k) {
            int64_t block = rows->corner[4 * p + k];
            double share = rows->share[4 * p + k];
            steps += share * moit_slice_steps_of(slices, block);
            for (int j = 0; j < MOMENTS; ++j)
                powers[j] += share * slices->powers[block * MOMENTS + j];
        }
        for (int j = 0; j < MOMENTS; ++j)
            moit_set_number(job->fragments->precision, tile->b, MOMENTS * p + j,
                            steps > 0.0 ? powers[j] / steps : 0.0);
    }
}

void moit_slices_stand(const moit_job *job, moit_tile *tile, const moit_slice_rows *rows, void *T) {
    const moit_slices *slices = job->prepared;
    const moit_slice_places *places = moit_slice_places_of(job, rows);
    const int32_t *offsets = moit_slice_offsets(job, tile);
    moit_precision precision = job->fragments->precision;
    moit_technique moments;
    moit_job of = moit_slices_job_of_moments(job, &moments);
    int n = offsets[tile->pixels];
    memcpy(places->at_least, tile->points[1], (size_t)n * sizeof(double));
    memcpy(places->at_most, tile->points[2], (size_t)n * sizeof(double));
    read_powers(job, tile, rows);
    double *z = tile->points[0], *low = tile->points[1], *high = tile->points[2];
    moit_power_shares(&of, tile, z, low, high);
    for (int p = 0; p < tile->pixels; ++p) {
        double b0 = moit_number(precision, tile->b0, p);
        for (int i = offsets[p]; i < offsets[p + 1]; ++i) {
            double total = moit_number(precision, places->low, i), extent = high[i] - low[i],
                   own = job->depths ? 0.0 : moit_number(precision, tile->absorbance, i);
            double share = moit_number(precision, places->depth, i) * (0.5 * slices->quantum);
            /* in the middle where slices say nothing */
            double way = total > 0.0 && extent > 0.0 ? (share / total - low[i]) / extent : 0.5;
            way = fmin(fmax(way, 0.0), 1.0);
            double x = b0 * (places->at_least[i] + way * (places->at_most[i] - places->at_least[i]))
                       - 0.5 * own;
            x = fmax(x, 0.0);
            moit_set_number(precision, T, i, tile->absorbed ? x : moit_exp(-x));
        }
    }
}
