/* Where slices stand, by itself: for passes on a GPU. */
#include "core/techniques/slices.h"
#include "core/techniques/table.h"

#include <string.h>

int64_t moit_slice_regions(const moit_fragments *f, const moit_technique *technique,
                           int64_t squares[4]) {
    int64_t region = technique->slices.table == MOIT_TABLE_IMAGE  ? 0
                     : technique->slices.table == MOIT_TABLE_TILE ? technique->slices.tile
                                                                  : 1;
    moit_squares s = moit_squares_of(f, region);
    int64_t found[4] = {s.side, s.top, s.left, s.across};
    memcpy(squares, found, sizeof found);
    return f->pixels ? s.across * s.down : 0;
}

moit_status moit_slice_tables(const moit_fragments *fragments, const moit_technique *technique,
                              bool cull_opaque, float *out, const moit_run *run) {
    moit_job job = moit_job_of(fragments, technique, cull_opaque, run);
    moit_status status =
        moit_slices_make(&job, &(moit_slices){.place = moit_slices_place_in}, true);
    const moit_slices *slices = job.prepared;
    if (slices && status == MOIT_OK) {
        int64_t entries = slices->regions.across * slices->regions.down * slices->cells;
        for (int64_t i = 0; i < entries; ++i) {
            out[3 * i] = slices->table[i].slot;
            out[3 * i + 1] = slices->table[i].from;
            out[3 * i + 2] = slices->table[i].share;
        }
    }
    moit_slices_release(&job);
    return status;
}
