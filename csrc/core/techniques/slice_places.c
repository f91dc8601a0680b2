/* A tile's own room, places of its fragments in slices, and what pixels keep of them. */
#include "core/techniques/slices.h"

#include "core/pieces.h"
#include "core/techniques/table.h"

#include <math.h>
#include <string.h>

/* ---- Room ------------------------------------------------------------------------------------ */

static moit_slice_places lay_out_places(pieces *r, int64_t n, size_t scalar) {
    return (moit_slice_places){
        .cell = piece(r, n, scalar),
        .inside = piece(r, n, scalar),
        .from = piece(r, n, scalar),
        .share = piece(r, n, scalar),
        .joined = piece(r, n, scalar),
        .before = piece(r, n, scalar),
        .at = piece(r, n, scalar),
        .behind = piece(r, n, scalar),
        .twice = piece(r, n, scalar),
        .weight = piece(r, n, scalar),
        .depth = piece(r, n, scalar),
        .low = piece(r, n, scalar),
        .full = piece(r, n, scalar),
        .at_least = piece(r, n, sizeof(double)),
        .at_most = piece(r, n, sizeof(double)),
        .slot = piece(r, n, sizeof(int32_t)),
    };
}

static moit_slice_rows lay_out(const moit_job *job, int fragments, int pixels, pieces *r) {
    const moit_technique *t = job->technique;
    int64_t n = fragments, points = pixels * job->depths + MOIT_PADDING;
    int corners = t->kind == MOIT_AVBOIT && t->slices.cubic && t->resolution > 1 ? 16 : 4;
    return (moit_slice_rows){
        .corners = corners,
        .of_fragments = lay_out_places(r, n, job->scalar),
        .of_depths = lay_out_places(r, job->depths ? points : 0, job->scalar),
        .code = piece(r, n, job->scalar),
        .near = piece(r, n, job->scalar),
        .far = piece(r, n, job->scalar),
        .row = piece(r, n, sizeof(uint32_t)),
        .column = piece(r, n, sizeof(uint32_t)),
        .corner = piece(r, (int64_t)corners * pixels, sizeof(int64_t)),
        .share = piece(r, (int64_t)corners * pixels, sizeof(double)),
        .table_of = piece(r, pixels, sizeof(const moit_slice_entry *)),
        .sums_of = piece(r, pixels, sizeof(const uint32_t *)),
        .sums = piece(r, MOIT_MOST_SLICES + 3 + MOIT_PADDING, sizeof(uint32_t)),
        .table = piece(r, job->technique->slices.cells, sizeof(moit_slice_entry)),
        .words = piece(r, MOIT_MOST_SLICE_CELLS / 64, sizeof(uint64_t)),
    };
}

size_t moit_slices_scratch(const moit_job *job, int fragments, int pixels) {
    pieces r = {NULL, 0};
    lay_out(job, fragments, pixels, &r);
    return r.used;
}

moit_slice_rows moit_slice_rows_of(const moit_job *job, const moit_tile *tile) {
    pieces r = {tile->own, 0};
    return lay_out(job, tile->given + MOIT_PADDING, tile->cut, &r);
}

const int32_t *moit_slice_offsets(const moit_job *job, const moit_tile *tile) {
    return job->depths ? tile->curve_offsets : tile->offsets;
}

const moit_slice_places *moit_slice_places_of(const moit_job *job, const moit_slice_rows *rows) {
    return job->depths ? &rows->of_depths : &rows->of_fragments;
}

/* ---- Places ---------------------------------------------------------------------------------- */

void moit_slices_place(const moit_job *job, moit_tile *tile, const moit_slice_rows *rows) {
    moit_display_places(job, tile, rows->row, rows->column);
    double most = moit_slice_most(job->technique);
    job->stages->absorbance(tile->fragments, tile->alpha, job->max_alpha, tile->absorbance);
    moit_warp_tile(job, tile);
    job->stages->slice_codes(job->technique->slices.cells,
                             most / moit_slice_depth_of_most(job->technique), most, tile->fragments,
                             tile->z, tile->absorbance, rows->row, rows->column,
                             rows->of_fragments.cell, rows->of_fragments.inside, rows->code);
}

/* The same of the depths that a job asks at. */
static void place_depths(const moit_job *job, moit_tile *tile, const moit_slice_rows *rows) {
    moit_moments_warp_curve(job, tile);
    job->stages->slice_codes(job->technique->slices.cells, 0.0, 0.0,
                             tile->curve_offsets[tile->pixels], tile->curve_z, NULL, NULL, NULL,
                             rows->of_depths.cell, rows->of_depths.inside, NULL);
}

void moit_slices_own_table(const moit_job *job, const moit_slices *slices, const moit_tile *tile,
                           const moit_slice_rows *rows, int p) {
    memset(rows->words, 0, (size_t)slices->cells / 8);
    job->stages->slice_marks(slices->cells, tile->offsets[p], tile->offsets[p + 1], tile->alpha,
                             rows->of_fragments.cell, rows->words);
    moit_slice_table(slices->cells, slices->slots, rows->words, rows->table);
}

/* Slots of the pixels first to first + n by the tables of these. */
static void join(const moit_job *job, const moit_tile *tile, const moit_slice_rows *rows, int first,
                 int n, bool depths) {
    const moit_slice_entry *const *tables = rows->table_of + first;
    const moit_slice_places *own = &rows->of_fragments, *asked = &rows->of_depths;
    job->stages->slice_join(n, tile->offsets + first, tables, own->cell, own->slot, own->from,
                            own->share);
    if (depths)
        job->stages->slice_join(n, tile->curve_offsets + first, tables, asked->cell, asked->slot,
                                asked->from, asked->share);
}

void moit_slices_join(const moit_job *job, const moit_slices *slices, const moit_tile *tile,
                      const moit_slice_rows *rows, bool depths) {
    const moit_slice_places *own = &rows->of_fragments, *asked = &rows->of_depths;
    for (int p = 0; p < tile->pixels; ++p) {
        rows->table_of[p] = rows->table;
        if (slices->table)
            rows->table_of[p] =
                slices->table
                + moit_square_at(&slices->regions, moit_pixel_at(tile, p)) * slices->cells;
    }
    if (slices->table) join(job, tile, rows, 0, tile->pixels, depths);
    for (int p = 0; !slices->table && p < tile->pixels; ++p) {
        moit_slices_own_table(job, slices, tile, rows, p);
        join(job, tile, rows, p, 1, depths);
    }
    job->stages->slice_shares(tile->fragments, own->from, own->share, rows->code, own->inside,
                              own->joined, rows->near, rows->far);
    if (depths)
        job->stages->slice_shares(tile->curve_offsets[tile->pixels], asked->from, asked->share,
                                  NULL, asked->inside, asked->joined, NULL, NULL);
}

void moit_slices_place_in(const moit_job *job, const moit_slices *slices, moit_tile *tile,
                          const moit_slice_rows *rows) {
    moit_slices_place(job, tile, rows);
    moit_slices_join(job, slices, tile, rows, false);
}

void moit_slices_sum(const moit_job *job, const moit_slices *slices, const moit_tile *tile,
                     const moit_slice_rows *rows, int first, int pixels, bool all) {
    const moit_slice_places *places = moit_slice_places_of(job, rows);
    job->stages->slice_sums(slices->slots, (uint32_t)moit_slice_most(job->technique), pixels,
                            tile->offsets + first, rows->of_fragments.slot, rows->near, rows->far,
                            moit_slice_offsets(job, tile) + first, places->slot, all,
                            places->before, places->at, places->behind, rows->sums);
}

void moit_slices_place_all(const moit_job *job, moit_tile *tile, const moit_slice_rows *rows) {
    moit_slices_place(job, tile, rows);
    if (job->depths) place_depths(job, tile, rows);
}
