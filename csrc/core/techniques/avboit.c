/* Adaptive voxel-based transparency as published (kernels/slices.h has the source).
 *
 * A block keeps what its fragments add to its slices. A slice whose sum is more than its bits hold
 * lets nothing through, and no slice behind it does. */
#include "core/techniques/slices.h"

#include "core/techniques/options.h"
#include "core/techniques/table.h"

#include <stdlib.h>
#include <string.h>

static bool avboit_fits(const moit_technique *technique) {
    const moit_slice_options *o = &technique->slices;
    return moit_slices_fit(technique) && o->table == MOIT_TABLE_IMAGE && !o->inside
           && !technique->full_total && o->bias >= 0.0 && o->bias <= 8.0;
}

static void place(const moit_job *job, const moit_slices *slices, moit_tile *tile,
                  const moit_slice_rows *rows) {
    const moit_slice_places *places = &rows->of_fragments;
    double most = moit_slice_most(job->technique);
    moit_slices_place(job, tile, rows);
    moit_slices_join(job, slices, tile, rows, false);
    job->stages->voxel_codes(tile->fragments, tile->absorbance, places->joined,
                             most / moit_slice_depth_of_most(job->technique), most, rows->near,
                             rows->far);
}

/* Light behind each slice of blocks, as bytes hold it. */
static moit_status see_through(const moit_job *job, moit_slices *slices) {
    int64_t blocks = slices->blocks.across * slices->blocks.down;
    size_t slots = (size_t)slices->slots;
    uint32_t most = (uint32_t)moit_slice_most(job->technique);
    double light[MOIT_MOST_SLICES + MOIT_PADDING];
    slices->through = malloc((size_t)blocks * slots);
    if (!slices->through) return MOIT_NO_MEMORY;
    for (int64_t b = 0; b < blocks; ++b) {
        const uint32_t *sums = slices->sums + b * (slices->slots + 3);
        bool full = false;
        for (size_t k = 0; k < slots; ++k) light[k] = sums[k + 1] * slices->quantum;
        job->precise->decay(slices->slots, light, light);
        for (size_t k = 0; k < slots; ++k) {
            full |= sums[k + 1] - sums[k] > most;
            slices->through[(size_t)b * slots + k] = full ? 0 : (uint8_t)(light[k] * 255.0 + 0.5);
        }
    }
    return MOIT_OK;
}

moit_slices moit_voxels_as_published(const moit_technique *technique) {
    return (moit_slices){.place = place,
                         .guarded = true,
                         .always_blocks = true,
                         .of_middle = !technique->slices.average,
                         .length = 1};
}

static moit_status avboit_prepare(moit_job *job) {
    moit_slices how = moit_voxels_as_published(job->technique);
    moit_status status = moit_slices_make(job, &how, false);
    if (status == MOIT_OK && job->prepared) status = see_through(job, job->prepared);
    return status;
}

/* Light at the two slices around places. */
static void fetch_light(const moit_job *job, const moit_tile *tile, const int32_t *offsets,
                        const moit_slice_places *places, const moit_slice_rows *rows, int corner) {
    const moit_slices *slices = job->prepared;
    moit_precision precision = job->fragments->precision;
    for (int p = 0; p < tile->pixels; ++p) {
        const uint8_t *through =
            slices->through + rows->corner[rows->corners * p + corner] * (int64_t)slices->slots;
        for (int i = offsets[p]; i < offsets[p + 1]; ++i) {
            int slot = places->slot[i] / 2, last = slices->slots - 1,
                next = slot + (places->slot[i] & 1);
            moit_set_number(precision, places->before, i, through[slot < last ? slot : last]);
            moit_set_number(precision, places->behind, i, through[next < last ? next : last]);
        }
    }
}

/* What light lacks at the four slices around places, none in front of all: shares of a spline sum
 * to 1 but for rounding, and where nothing is dark T is to be 1. */
static void fetch_dark(const moit_job *job, const moit_tile *tile, const int32_t *offsets,
                       const moit_slice_places *places, const moit_slice_rows *rows, int corner) {
    const moit_slices *slices = job->prepared;
    moit_precision precision = job->fragments->precision;
    char *of_slices[4] = {places->at, places->before, places->behind, places->full};
    for (int p = 0; p < tile->pixels; ++p) {
        const uint8_t *through =
            slices->through + rows->corner[rows->corners * p + corner] * (int64_t)slices->slots;
        for (int i = offsets[p]; i < offsets[p + 1]; ++i) {
            bool in_front = moit_number(precision, places->twice, i) < 0.0;
            /* A cell without slices stands at the next one. */
            if (!(places->slot[i] & 1)) moit_set_number(precision, places->joined, i, 0.0);
            for (int k = 0; k < 4; ++k) {
                int slot = places->slot[i] / 2 + k - 1, last = slices->slots - 1;
                slot = slot < 0 ? 0 : slot < last ? slot : last;
                moit_set_number(precision, of_slices[k], i, in_front ? 0 : 255 - through[slot]);
            }
        }
    }
}

static void answer(const moit_job *job, moit_tile *tile, void *T) {
    const moit_slices *slices = job->prepared;
    moit_slice_rows rows = moit_slice_rows_of(job, tile);
    const moit_slice_places *places = moit_slice_places_of(job, &rows);
    const int32_t *offsets = moit_slice_offsets(job, tile);
    int n = offsets[tile->pixels];
    double shift = job->technique->slices.bias * slices->length / slices->cells;
    moit_slices_place_all(job, tile, &rows);
    /* depths in front of the first cell are below 0 */
    job->stages->voxel_places(n, job->depths ? tile->curve_z : tile->z, shift, places->twice);
    job->stages->slice_codes(slices->cells, 0.0, 0.0, n, places->twice, NULL, NULL, NULL,
                             places->cell, places->inside, NULL);
    moit_slice_corners(job, tile, &rows);
    memset(places->depth, 0, ((size_t)n + MOIT_PADDING) * job->scalar);
    bool cubic = job->technique->slices.cubic;
    for (int k = 0; k < rows.corners; ++k) {
        moit_slice_corner(job, tile, offsets, places, &rows, k);
        if (cubic) {
            fetch_dark(job, tile, offsets, places, &rows, k);
            /* by any number above 0: what is in front of all is not dark already */
            job->stages->voxel_cubic_light(n, places->weight, places->at, places->before,
                                           places->behind, places->full, places->joined,
                                           places->low);
        } else {
            fetch_light(job, tile, offsets, places, &rows, k);
            job->stages->voxel_light(n, places->twice, places->before, places->behind,
                                     places->joined, places->low);
        }
        job->stages->slice_blend(n, places->weight, places->low, places->depth);
    }
    for (int i = 0; cubic && i < n; ++i) {
        double dark = moit_number(job->fragments->precision, places->depth, i);
        moit_set_number(job->fragments->precision, places->depth, i, dark < 1.0 ? 1.0 - dark : 0.0);
    }
    memcpy(T, places->depth, (size_t)n * job->scalar);
    moit_total_product(job, tile);
}

static void avboit_weigh(const moit_job *job, moit_tile *tile) { answer(job, tile, tile->T); }

static void avboit_curve(const moit_job *job, moit_tile *tile) { answer(job, tile, tile->curve); }

const moit_technique_row moit_avboit_row = {.name = "avboit",
                                            OPTIONS(SLICES, NUMBER("slice_bias", slices.bias),
                                                    TRUTH("average", slices.average),
                                                    TRUTH("cubic", slices.cubic)),
                                            .fits = avboit_fits,
                                            .weigh = avboit_weigh,
                                            .total = moit_total_product,
                                            .curve = avboit_curve,
                                            .prepare = avboit_prepare,
                                            .release = moit_slices_release,
                                            .scratch = moit_slices_scratch,
                                            .unit_range = {0.0, 1.0},
                                            .uses_warp = true,
                                            .reconstructs = true,
                                            .takes_points = true,
                                            .geometry_passes = 3};
