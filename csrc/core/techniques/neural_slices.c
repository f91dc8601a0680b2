/* Slices of optical depth at equal steps of each pixel's own extent, which a network reads
 * (kernels/slice_network.h). */
#include "core/pieces.h"
#include "core/techniques/neural_slices.h"
#include "core/techniques/slices.h"

#include "core/techniques/options.h"
#include "core/techniques/table.h"

#include <math.h>

enum { INPUTS = MOIT_SLICE_INPUTS, HIDDEN = MOIT_SLICE_HIDDEN };

typedef moit_neural_slice_rows rows;

static bool fits(const moit_technique *technique) {
    return technique->slices.bits >= 2 && technique->slices.bits <= 16;
}

static int weights_of(const moit_technique *technique) {
    (void)technique;
    return HIDDEN * (INPUTS + 1) + HIDDEN * (HIDDEN + 1) + HIDDEN + 1;
}

/* What the network sees, and what is in front for sure and what may be. */
static int columns_of(const moit_technique *technique) {
    (void)technique;
    return INPUTS + 2;
}

static rows lay_out(const moit_job *job, int64_t n, int64_t pixels, pieces *p) {
    int64_t points = pixels * job->depths + MOIT_PADDING, asked = points > n ? points : n;
    return (rows){
        .features = piece(p, n * columns_of(job->technique), job->scalar),
        .code = piece(p, n, job->scalar),
        .near = piece(p, n, job->scalar),
        .far = piece(p, n, job->scalar),
        .inside = piece(p, n, job->scalar),
        .asked_inside = piece(p, points, job->scalar),
        .around = piece(p, asked * MOIT_SLICE_AROUND, job->scalar),
        .slot = piece(p, n, sizeof(int32_t)),
        .asked_slot = piece(p, points, sizeof(int32_t)),
        .row = piece(p, n, sizeof(uint32_t)),
        .column = piece(p, n, sizeof(uint32_t)),
        .sums = piece(p, MOIT_MOST_SLICES + 3 + MOIT_PADDING, sizeof(uint32_t)),
        .asked = asked,
    };
}

static size_t scratch(const moit_job *job, int fragments, int pixels) {
    pieces p = {NULL, 0};
    lay_out(job, fragments, pixels, &p);
    return p.used;
}

rows moit_neural_slice_rows_of(const moit_job *job, const moit_tile *tile) {
    pieces p = {tile->own, 0};
    return lay_out(job, tile->fragments + MOIT_PADDING, tile->pixels, &p);
}

/* Codes of the tile's fragments, and where these lie in their pixels' extents, which are left in
 * tile->sums. */
static rows place(const moit_job *job, moit_tile *tile) {
    const moit_technique *technique = job->technique;
    rows r = moit_neural_slice_rows_of(job, tile);
    int n = tile->fragments;
    job->stages->absorbance(n, tile->alpha, job->max_alpha, tile->absorbance);
    moit_warp_tile(job, tile);
    moit_display_places(job, tile, r.row, r.column);
    job->stages->own_codes(moit_slice_most(technique) / moit_slice_depth_of_most(technique),
                           moit_slice_most(technique), n, tile->z, tile->absorbance, r.row,
                           r.column, r.code);
    job->stages->covered_extents(tile->pixels, tile->offsets, tile->z, tile->alpha, tile->sums);
    job->stages->own_places(technique->count, tile->pixels, tile->offsets, tile->z, tile->sums,
                            r.code, r.slot, r.inside, r.near, r.far);
    if (!job->depths) return r;
    moit_moments_warp_curve(job, tile);
    job->stages->own_places(technique->count, tile->pixels, tile->curve_offsets, tile->curve_z,
                            tile->sums, NULL, r.asked_slot, r.asked_inside, NULL, NULL);
    return r;
}

/* Sums around what is asked about in pixels first to first + n; of the last of them all sums. */
static void add_up(const moit_job *job, const moit_tile *tile, const rows *r, int first, int n) {
    job->stages->sums_around(job->technique->count, (uint32_t)moit_slice_most(job->technique), n,
                             tile->offsets + first, r->slot, r->near, r->far,
                             moit_slice_offsets(job, tile) + first,
                             job->depths ? r->asked_slot : r->slot, r->asked, r->around, r->sums);
}

static void answer(const moit_job *job, moit_tile *tile, void *T) {
    rows r = place(job, tile);
    bool depths = job->depths > 0;
    add_up(job, tile, &r, 0, tile->pixels);
    job->stages->learnt_absorbance(
        moit_slice_offsets(job, tile)[tile->pixels], r.around, r.asked,
        depths ? r.asked_inside : r.inside, r.near, depths ? NULL : r.code, tile->absorbance,
        moit_slice_quantum(job->technique), job->technique->slices.network, tile->absorbed, T);
    moit_total_product(job, tile);
}

static void weigh(const moit_job *job, moit_tile *tile) { answer(job, tile, tile->T); }

static void curve(const moit_job *job, moit_tile *tile) { answer(job, tile, tile->curve); }

static void see(const moit_job *job, moit_tile *tile, int64_t stride, void *features) {
    rows r = place(job, tile);
    add_up(job, tile, &r, 0, tile->pixels);
    job->stages->slice_features(tile->fragments, r.around, r.asked, r.inside, r.near, r.code,
                                tile->absorbance, moit_slice_quantum(job->technique), stride,
                                features);
}

/* ---- Bounds ---------------------------------------------------------------------------------- */

/* Slices before this one are in front of a place at x of them, or none from this one on behind. */
static int first_at(int count, double x) {
    if (x > count - 1) return count;
    return x > 0.0 ? (int)fmin(x, count - 2) : 0;
}

static int end_at(int count, double x) { return x < 0.0 ? 0 : (int)fmin(x, count - 2) + 2; }

static void bounds(const moit_job *job, moit_tile *tile, double *lower, double *upper) {
    moit_precision precision = job->fragments->precision;
    int count = job->technique->count;
    rows r = place(job, tile);
    moit_total_product(job, tile);
    const int32_t *offsets = moit_slice_offsets(job, tile);
    for (int p = 0; p < tile->pixels; ++p) {
        if (offsets[p] == offsets[p + 1]) continue;
        add_up(job, tile, &r, p, 1);
        moit_slice_proof proof = moit_slice_proof_of(job, tile, p, r.sums);
        double nearest = tile->sums[2 * p], width = tile->sums[2 * p + 1] - nearest;
        double blur = moit_slice_blur(precision) * (2.0 / width + 2.0) * (double)(count - 1);
        for (int i = offsets[p]; i < offsets[p + 1]; ++i) {
            double z = moit_number(precision, job->depths ? tile->curve_z : tile->z, i);
            double x = (z - nearest) / width * (double)(count - 1);
            double alpha = job->depths ? 0.0 : moit_number(precision, tile->alpha, i);
            moit_slice_prove(&proof, first_at(count, x - blur), end_at(count, x + blur), alpha,
                             lower + i, upper + i);
        }
    }
}

const moit_technique_row moit_neural_slices_row = {
    .name = "neural-slices",
    OPTIONS(COUNT, WARPED, SLICE_BITS, NETWORK(slices.network)),
    .usual_counts = (const int[]){5, 8, 16, 0},
    .least_count = 2,
    .most_count = MOIT_MOST_SLICES,
    .fits = fits,
    .weigh = weigh,
    .pull_back = moit_neural_slices_pull_back,
    .total = moit_total_product,
    .curve = curve,
    .bounds = bounds,
    .scratch = scratch,
    .weights = weights_of,
    .columns = columns_of,
    .features = see,
    .unit_range = {-1.0, 1.0},
    .uses_warp = true,
    .reconstructs = true,
    .absorbs = moit_absorbs,
    .takes_points = true,
    .geometry_passes = 3};
