/* Orders of fragments: front to back within a pixel, and by pixel. */
#include "core/tile.h"

static void order_tile(const moit_job *job, moit_tile *tile, void *order_) {
    int64_t *order = (int64_t *)order_ + tile->first_fragment;
    job->stages->depth_ranks(tile->pixels, tile->offsets, tile->depth, tile->rank, tile->order);
    for (int p = 0; p < tile->pixels; ++p)
        for (int i = tile->offsets[p]; i < tile->offsets[p + 1]; ++i)
            order[tile->offsets[p] + tile->rank[i]] = tile->first_fragment + i;
}

moit_status moit_depth_order(const moit_fragments *fragments, int64_t *order, const moit_run *run) {
    moit_job job = moit_plain_job(fragments, false, run);
    return moit_for_tiles(&job, order_tile, order);
}

int64_t moit_group_by_pixel(const int64_t *pixel, int64_t count, int64_t pixels, int64_t *offsets,
                            int64_t *order) {
    for (int64_t p = 0; p <= pixels; ++p) offsets[p] = 0;
    for (int64_t i = 0; i < count; ++i) {
        if (pixel[i] < 0 || pixel[i] >= pixels) return i;
        ++offsets[pixel[i] + 1];
    }
    for (int64_t p = 0; p < pixels; ++p) offsets[p + 1] += offsets[p];
    /* offsets[p] says where the next fragment of p goes: in the end, where p + 1 begins. */
    for (int64_t i = 0; i < count; ++i) order[offsets[pixel[i]]++] = i;
    for (int64_t p = pixels; p > 0; --p) offsets[p] = offsets[p - 1];
    offsets[0] = 0;
    return count;
}
