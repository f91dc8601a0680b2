/* Rows of blocks are looked at by one thread each. */
#include "core/techniques/upsampling.h"

#include <math.h>

/* Depths that shares go by are positive. */
#define LEAST_DEPTH 0x1p-1000

enum { ROOM = MOIT_AROUND + MOIT_PADDING };

typedef struct {
    const moit_squares *squares;
    moit_guides *guides;
} finding;

static void find_farthest(const moit_job *job, moit_tile *tile, void *context) {
    const finding *f = context;
    for (int p = 0; p < tile->pixels; ++p) {
        double *farthest = f->guides->farthest + moit_square_at(f->squares, moit_pixel_at(tile, p));
        double own = __builtin_inf();
        if (tile->opaque && tile->opaque[p] >= 0)
            own = moit_number(job->fragments->precision, job->fragments->depth,
                              tile->first_fragment + tile->opaque[p]);
        *farthest = fmax(*farthest, own);
    }
}

moit_status moit_guides_find(const moit_job *job, const moit_squares *squares,
                             moit_guides *guides) {
    int64_t count = squares->across * squares->down;
    moit_runs rows = {.first = -squares->top * squares->width,
                      .length = squares->side * squares->width};
    moit_job own = *job;
    own.depths = 0;
    own.skips_empty = false;
    finding f = {squares, guides};
    double nothing = job->cull_opaque ? -__builtin_inf() : __builtin_inf(), most = 0.0;
    for (int64_t i = 0; i < count; ++i) guides->farthest[i] = nothing;
    moit_status status = MOIT_OK;
    if (job->cull_opaque) status = moit_for_tiles_of(&own, &rows, find_farthest, &f);
    for (int64_t i = 0; i < count; ++i)
        if (!isinf(guides->farthest[i])) most = fmax(most, guides->farthest[i]);
    guides->no_surface = 2.0 * most;
    guides->guided = guides->guided && most > 0.0;
    return status;
}

/* How far the pixel's opaque surface is. */
static double own_guide(const moit_job *job, const moit_guides *guides, const moit_tile *tile,
                        int p) {
    if (!tile->opaque || tile->opaque[p] < 0) return guides->no_surface;
    /* a twin's fragments are where they were given */
    double depth =
        moit_number(job->given, job->fragments->depth, tile->first_fragment + tile->opaque[p]);
    return fmin(fmax(depth, LEAST_DEPTH), guides->no_surface);
}

void moit_find_blocks_around(const moit_job *job, const moit_squares *squares,
                             const moit_guides *guides, const moit_tile *tile, int first, int n,
                             moit_blocks_around *of) {
    double across[ROOM] = {0}, along[ROOM] = {0}, depth[ROOM], corner[4][ROOM];
    for (int i = 0; i < n; ++i) {
        int64_t pixel = moit_pixel_at(tile, first + i);
        moit_between x = moit_squares_across(squares, pixel), y = moit_squares_down(squares, pixel);
        across[i] = x.share;
        along[i] = y.share;
        for (int k = 0; k < 4; ++k)
            of->place[k][i] = (k < 2 ? y.low : y.high) * squares->across + (k % 2 ? x.high : x.low);
    }
    for (int i = 0; guides->guided && i < ROOM; ++i) {
        depth[i] = i < n ? own_guide(job, guides, tile, first + i) : 1.0;
        for (int k = 0; k < 4; ++k)
            corner[k][i] =
                i < n ? fmin(guides->farthest[of->place[k][i]], guides->no_surface) : 1.0;
    }
    job->precise->upsampling(guides->guided, n, across, along, depth,
                             (const void *[4]){corner[0], corner[1], corner[2], corner[3]},
                             (void *[4]){of->share[0], of->share[1], of->share[2], of->share[3]});
}
