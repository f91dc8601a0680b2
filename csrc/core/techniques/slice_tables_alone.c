/* Where slices stand, by itself: for passes on a GPU. */
#include "core/techniques/slices.h"
#include "core/techniques/table.h"

moit_slice_regions moit_slice_regions_of(const moit_fragments *f, const moit_technique *technique) {
    moit_squares s = moit_squares_of(f, moit_slice_region_side(technique));
    return (moit_slice_regions){.count = f->pixels ? s.across * s.down : 0,
                                .side = s.side,
                                .top = s.top,
                                .left = s.left,
                                .across = s.across};
}

moit_status moit_slice_tables(const moit_fragments *fragments, const moit_technique *technique,
                              bool cull_opaque, float *out, int *joined, const moit_run *run) {
    moit_job job = moit_job_of(fragments, technique, cull_opaque, run);
    moit_slices how = technique->kind == MOIT_AVBOIT ? moit_voxels_as_published(technique)
                                                     : (moit_slices){.length = 1};
    moit_status status = moit_slices_make(&job, &how, true);
    const moit_slices *slices = job.prepared;
    *joined = slices ? slices->length : 1;
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
