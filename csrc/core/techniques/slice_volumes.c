/* What techniques of slices make of the whole image: tables of regions, and what blocks keep. */
#include "core/techniques/slices.h"

#include "core/techniques/table.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- The whole image ------------------------------------------------------------------------- */

typedef struct {
    moit_slices *slices;
    uint64_t *words; /* (regions, cells / 64) */
    uint32_t *sums;  /* (blocks, slots + 1) */
} making;

/* Whatever may have a code is marked, which needs no more than depth. */
static void mark_tile(const moit_job *job, moit_tile *tile, void *context) {
    const making *m = context;
    const moit_slices *slices = m->slices;
    moit_slice_rows rows = moit_slice_rows_of(job, tile);
    moit_warp_tile(job, tile);
    job->stages->slice_codes(slices->cells, 0.0, 0.0, tile->fragments, tile->z, NULL, NULL, NULL,
                             rows.of_fragments.cell, rows.of_fragments.inside, NULL);
    if (!slices->regions.side && !slices->of_middle) {
        job->stages->slice_marks(slices->cells, 0, tile->fragments, tile->alpha,
                                 rows.of_fragments.cell, m->words);
        return;
    }
    for (int p = 0; p < tile->pixels; ++p) {
        int64_t pixel = moit_pixel_at(tile, p);
        if (slices->of_middle && !moit_is_square_middle(&slices->blocks, pixel)) continue;
        job->stages->slice_marks(
            slices->cells, tile->offsets[p], tile->offsets[p + 1], tile->alpha,
            rows.of_fragments.cell,
            m->words + moit_square_at(&slices->regions, pixel) * (slices->cells / 64));
    }
}

/* Threads add at once. What is too much for a slice stays so: sums do not wrap, in any order. */
static void add(uint32_t *sum, uint32_t steps) {
    if (__atomic_fetch_add(sum, steps, __ATOMIC_RELAXED) >= 1U << 31)
        __atomic_store_n(sum, 1U << 31, __ATOMIC_RELAXED);
}

static void add_tile(const moit_job *job, moit_tile *tile, void *context) {
    const making *m = context;
    const moit_slices *slices = m->slices;
    moit_slice_rows rows = moit_slice_rows_of(job, tile);
    moit_precision precision = job->fragments->precision;
    slices->place(job, slices, tile, &rows);
    for (int p = 0; p < tile->pixels; ++p) {
        int64_t pixel = moit_pixel_at(tile, p);
        if (slices->of_middle && !moit_is_square_middle(&slices->blocks, pixel)) continue;
        uint32_t *sums = m->sums + moit_square_at(&slices->blocks, pixel) * (slices->slots + 1);
        for (int i = tile->offsets[p]; i < tile->offsets[p + 1]; ++i) {
            uint32_t near = (uint32_t)moit_number(precision, rows.near, i),
                     far = (uint32_t)moit_number(precision, rows.far, i);
            int slot = rows.of_fragments.slot[i] / 2;
            if (near) add(&sums[slot], near);
            if (far) add(&sums[slot + 1], far);
        }
    }
}

/* What blocks keep, means that their bits hold, and the sums before each slice. */
static void keep_blocks(const making *m, uint32_t most) {
    moit_slices *slices = m->slices;
    int64_t blocks = slices->blocks.across * slices->blocks.down;
    for (int64_t b = 0; b < blocks; ++b) {
        uint32_t pixels = slices->of_middle ? 1 : (uint32_t)moit_square_pixels(&slices->blocks, b);
        uint32_t *kept = slices->sums + b * (slices->slots + 3);
        const uint32_t *sums = m->sums + b * (slices->slots + 1);
        kept[0] = 0;
        for (int k = 0; k <= slices->slots; ++k) {
            uint32_t mean = (sums[k] + pixels / 2) / pixels;
            kept[k + 1] = kept[k] + (mean < most || !slices->saturates ? mean : most);
        }
        kept[slices->slots + 2] = kept[slices->slots + 1];
    }
}

static moit_status make_tables(moit_job *job, making *m) {
    moit_slices *slices = m->slices;
    int words = slices->cells / 64;
    int64_t regions = slices->regions.across * slices->regions.down;
    m->words = calloc((size_t)(regions * words), sizeof *m->words);
    slices->table = malloc((size_t)(regions * slices->cells) * sizeof *slices->table);
    moit_status status = MOIT_NO_MEMORY;
    if (m->words && slices->table) status = moit_for_tiles(job, mark_tile, m);
    for (int64_t r = 0; status == MOIT_OK && r < regions; ++r) {
        moit_slice_entry *table = slices->table + r * slices->cells;
        if (slices->guarded)
            slices->length =
                moit_voxel_table(slices->cells, slices->slots, m->words + r * words, table);
        else moit_slice_table(slices->cells, slices->slots, m->words + r * words, table);
    }
    free(m->words);
    return status;
}

static moit_status make_blocks(moit_job *job, making *m) {
    moit_slices *slices = m->slices;
    size_t blocks = (size_t)(slices->blocks.across * slices->blocks.down);
    m->sums = calloc(blocks * (size_t)(slices->slots + 1), sizeof *m->sums);
    slices->sums = malloc(blocks * (size_t)(slices->slots + 3) * sizeof *slices->sums);
    moit_status status = MOIT_NO_MEMORY;
    if (m->sums && slices->sums) status = moit_for_tiles(job, add_tile, m);
    if (status == MOIT_OK) keep_blocks(m, (uint32_t)moit_slice_most(job->technique));
    free(m->sums);
    return status;
}

static moit_status find_guides(const moit_job *job, moit_slices *slices) {
    size_t blocks = (size_t)(slices->blocks.across * slices->blocks.down);
    slices->guides.guided = true;
    slices->guides.farthest = malloc(blocks * sizeof *slices->guides.farthest);
    if (!slices->guides.farthest) return MOIT_NO_MEMORY;
    return moit_guides_find(job, &slices->blocks, &slices->guides);
}

moit_status moit_slices_make(moit_job *job, const moit_slices *how, bool tables_alone) {
    const moit_technique *technique = job->technique;
    const moit_fragments *f = job->fragments;
    int64_t side = technique->resolution < 2 ? 1 : technique->resolution;
    int64_t region = moit_slice_region_side(technique);
    job->prepared = NULL;
    if (!f->pixels) return MOIT_OK;
    moit_slices *slices = malloc(sizeof *slices);
    if (!slices) return MOIT_NO_MEMORY;
    *slices = *how;
    slices->regions = moit_squares_of(f, region);
    slices->blocks = moit_squares_of(f, side);
    slices->cells = technique->slices.cells;
    slices->slots = technique->count;
    slices->quantum = moit_slice_quantum(technique);
    making m = {.slices = slices};
    moit_status status = MOIT_OK;
    if (region != 1 || tables_alone) status = make_tables(job, &m);
    if (status == MOIT_OK && !tables_alone && (side > 1 || how->always_blocks))
        status = make_blocks(job, &m);
    if (status == MOIT_OK && slices->sums && technique->depth_aware)
        status = find_guides(job, slices);
    if (status == MOIT_OK && slices->sums && technique->slices.inside)
        status = moit_slice_moments_make(technique, slices);
    job->prepared = slices;
    return status;
}

moit_status moit_slices_prepare(moit_job *job) {
    return moit_slices_make(job, &(moit_slices){.place = moit_slices_place_in, .saturates = true},
                            false);
}

void moit_slices_release(moit_job *job) {
    moit_slices *slices = job->prepared;
    if (slices) {
        free(slices->table);
        free(slices->sums);
        free(slices->through);
        free(slices->powers);
        free(slices->guides.farthest);
    }
    free(slices);
    job->prepared = NULL;
}
