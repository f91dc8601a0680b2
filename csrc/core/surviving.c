/* Which fragments techniques see, for those who ask elsewhere: on a GPU. */
#include "core/tile.h"

#include <string.h>

typedef struct {
    bool *kept;
    int64_t *occluder;
    char *opacity, *net;
} survivors;

static void survive(const moit_job *job, moit_tile *tile, void *context) {
    const survivors *to = context;
    const moit_fragments *f = job->fragments;
    size_t s = job->scalar;
    bool *kept = to->kept + tile->first_fragment;
    memset(kept, !tile->source, (size_t)tile->given);
    for (int i = 0; tile->source && i < tile->fragments; ++i) kept[tile->source[i]] = true;
    for (int p = 0; p < tile->pixels; ++p)
        to->occluder[tile->first_pixel + p] =
            tile->opaque && tile->opaque[p] >= 0 ? tile->first_fragment + tile->opaque[p] : -1;
    for (int i = 0; f->transmission && i < tile->fragments; ++i) {
        size_t at = (size_t)(tile->first_fragment + (tile->source ? tile->source[i] : i)) * s;
        memcpy(to->net + at, (const char *)tile->alpha + (size_t)i * s, s);
        for (int c = 0; c < 3; ++c)
            memcpy(to->opacity + 3 * at + (size_t)c * s,
                   (const char *)tile->opacity[c] + (size_t)i * s, s);
    }
}

moit_status moit_surviving(const moit_fragments *fragments, bool cull_opaque, bool *kept,
                           int64_t *occluder, void *opacity, void *net, const moit_run *run) {
    moit_job job = moit_plain_job(fragments, cull_opaque, run);
    survivors to = {kept, occluder, opacity, net};
    return moit_for_tiles(&job, survive, &to);
}
