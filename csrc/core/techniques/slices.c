/* Slices of optical depth on a tile: what is read of those that pixels keep of their fragments, or
 * blocks of pixels. Its text is kernels/slices.h. */
#include "core/elementary.h"
#include "core/techniques/slices.h"

#include "core/techniques/options.h"
#include "core/techniques/table.h"

#include <math.h>

static void answer(const moit_job *job, moit_tile *tile, void *T) {
    const moit_slices *slices = job->prepared;
    moit_slice_rows rows = moit_slice_rows_of(job, tile);
    bool inside = job->technique->slices.inside;
    double *lower = tile->bounds[0], *upper = tile->bounds[1];
    if (inside) moit_slices_moment_bounds(job, tile, lower, upper);
    moit_slices_place_all(job, tile, &rows);
    const moit_slice_places *places = moit_slice_places_of(job, &rows);
    int n = moit_slice_offsets(job, tile)[tile->pixels];
    double half_step = 0.5 * slices->quantum;
    if (slices->sums) {
        moit_slice_blocks_read(job, tile, moit_slice_offsets(job, tile), places, &rows);
        if (inside) moit_slices_stand(job, tile, &rows, T);
        else
            job->stages->block_absorbance(n, places->depth, places->low, places->full,
                                          job->depths ? NULL : tile->absorbance, half_step,
                                          tile->absorbed, T);
    } else {
        moit_slices_join(job, slices, tile, &rows, job->depths > 0);
        moit_slices_sum(job, slices, tile, &rows, 0, tile->pixels, job->depths > 0);
        job->stages->slice_depths(n, places->before, places->at, places->behind, places->joined,
                                  places->twice);
        job->stages->slice_absorbance(n, places->twice, rows.near, job->depths ? NULL : rows.code,
                                      places->joined, half_step, tile->absorbed, T);
    }
    moit_precision precision = job->fragments->precision;
    for (int i = 0; inside && i < n; ++i) {
        double least = tile->absorbed ? -moit_log(upper[i]) : lower[i],
               most = tile->absorbed ? -moit_log(lower[i]) : upper[i],
               found = moit_number(precision, T, i);
        moit_set_number(precision, T, i, fmin(fmax(found, least), most));
    }
    moit_total_product(job, tile);
}

static void slices_weigh(const moit_job *job, moit_tile *tile) { answer(job, tile, tile->T); }

static void slices_curve(const moit_job *job, moit_tile *tile) { answer(job, tile, tile->curve); }

const moit_technique_row moit_slices_row = {
    .name = "slices",
    OPTIONS(SLICES, TOTALS_OF_BLOCKS, TRUTH("half_total", slices.half_total),
            TRUTH("byte_total", slices.byte_total),
            WHOLE("table", slices.table, 0, MOIT_TABLE_PIXEL), WHOLE("tile", slices.tile, 1, 1024),
            TRUTH("inside", slices.inside)),
    .thick = MOIT_THICK_CELLS,
    .usual_counts = (const int[]){64, 0},
    .least_count = 2,
    .most_count = 256,
    .fits = moit_slices_fit,
    .weigh = slices_weigh,
    .pull_back = moit_slices_pull_back,
    .refusal = moit_slices_refusal,
    .total = moit_total_product,
    .curve = slices_curve,
    .bounds = moit_slices_bounds,
    .prepare = moit_slices_prepare,
    .release = moit_slices_release,
    .scratch = moit_slices_scratch,
    .unit_range = {0.0, 1.0},
    .uses_warp = true,
    .reconstructs = true,
    .absorbs = moit_absorbs,
    .takes_points = true,
    .geometry_passes = 3};
