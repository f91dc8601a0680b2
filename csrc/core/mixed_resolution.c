/* Pictures whose draws have resolutions of their own: McGuire, "Weighted, Blended Order-Independent
 * Transparency", 2013-2016, on rendering some calls small. What techniques of weights keep of a
 * pixel adds up (or multiplies up), so some draws' sums may come from smaller pictures, read
 * between their pixels, whatever lies in front of what. */
#include "core/techniques/table.h"
#include "core/threads.h"

#include <string.h>

enum { CHUNK = 256, ROOM = CHUNK + MOIT_PADDING };

/* ---- Sums ------------------------------------------------------------------------------------ */

bool moit_has_target_sums(const moit_technique *technique) {
    return moit_facts_of(technique->kind).adds_targets;
}

static void sum_tile(const moit_job *job, moit_tile *tile, void *out_) {
    double *out = (double *)out_ + tile->first_pixel * MOIT_TARGET_SUMS;
    moit_weighted_targets(job, tile);
    for (int p = 0; p < tile->pixels; ++p) {
        memcpy(out + MOIT_TARGET_SUMS * p, tile->sums + 4 * p, 4 * sizeof *out);
        out[MOIT_TARGET_SUMS * p + 4] = tile->total[p];
    }
}

moit_status moit_target_sums(const moit_fragments *fragments, const moit_technique *technique,
                             double *sums, const moit_run *run) {
    moit_job job = moit_job_of(fragments, technique, false, run);
    return moit_for_tiles(&job, sum_tile, sums);
}

/* ---- Together -------------------------------------------------------------------------------- */

typedef struct {
    const moit_technique *technique;
    const moit_stages *stages; /* of float, as GPUs have it */
    const moit_target_picture *whole, *small;
    int smaller;
    bool depth_aware;
    const double *behind;
    float *out;
} joining;

/* The two pixels of a smaller picture between whose middles a pixel lies. Pictures have the same
 * middle. */
static moit_between between_pixels(int64_t pixel, int64_t side, int64_t there, int64_t pixels) {
    int64_t beyond = there * side - pixels; /* of both ends together */
    return moit_between_squares(2 * pixel + 1 + beyond, side, there);
}

/* Adds to n pixels' sums, from column x of row y on, what they have of a smaller picture. */
static void add_small(const joining *j, const moit_target_picture *from, int64_t x, int64_t y,
                      int n, double (*sums)[MOIT_TARGET_SUMS]) {
    const moit_target_picture *whole = j->whole;
    int64_t places[4][CHUNK];
    float across[ROOM] = {0}, along[ROOM] = {0}, depth[ROOM], corner[4][ROOM], share[4][ROOM];
    moit_between row = between_pixels(y, from->side, from->height, whole->height);
    for (int i = 0; i < ROOM; ++i) depth[i] = 1.0f;
    memcpy(depth, whole->occluders + y * whole->width + x, (size_t)n * sizeof *depth);
    for (int k = 0; k < 4; ++k)
        for (int i = n; i < ROOM; ++i) corner[k][i] = 1.0f;
    for (int i = 0; i < n; ++i) {
        moit_between column = between_pixels(x + i, from->side, from->width, whole->width);
        across[i] = (float)column.share;
        along[i] = (float)row.share;
        for (int k = 0; k < 4; ++k) {
            places[k][i] =
                (k < 2 ? row.low : row.high) * from->width + (k % 2 ? column.high : column.low);
            corner[k][i] = from->occluders[places[k][i]];
        }
    }
    j->stages->upsampling(j->depth_aware, n, across, along, depth,
                          (const void *[4]){corner[0], corner[1], corner[2], corner[3]},
                          (void *[4]){share[0], share[1], share[2], share[3]});
    for (int i = 0; i < n; ++i) {
        double found[MOIT_TARGET_SUMS] = {0.0};
        for (int k = 0; k < 4; ++k) {
            const double *held = from->sums + MOIT_TARGET_SUMS * places[k][i];
            for (int c = 0; c < MOIT_TARGET_SUMS; ++c) found[c] += (double)share[k][i] * held[c];
        }
        for (int c = 0; c < 4; ++c) sums[i][c] += found[c];
        if (moit_multiplies_totals(j->technique)) sums[i][4] *= found[4];
        else sums[i][4] += found[4];
    }
}

static moit_status join_row(void *context, int64_t y, int thread) {
    const joining *j = context;
    const moit_target_picture *whole = j->whole;
    (void)thread;
    for (int64_t x = 0; x < whole->width; x += CHUNK) {
        double sums[CHUNK][MOIT_TARGET_SUMS];
        int n = (int)(whole->width - x < CHUNK ? whole->width - x : CHUNK);
        int64_t first = y * whole->width + x;
        memcpy(sums, whole->sums + MOIT_TARGET_SUMS * first, (size_t)n * sizeof *sums);
        for (int i = 0; i < j->smaller; ++i) add_small(j, &j->small[i], x, y, n, sums);
        for (int i = 0; i < n; ++i) {
            int64_t p = first + i;
            double total, share = moit_target_share(j->technique, sums[i][3], sums[i][4], &total);
            for (int c = 0; c < 3; ++c)
                j->out[4 * p + c] = (float)(total * j->behind[3 * p + c] + share * sums[i][c]);
            j->out[4 * p + 3] = whole->occluders[p] < 1.0f ? 1.0f : (float)(1.0 - total);
        }
    }
    return MOIT_OK;
}

moit_status moit_join_targets(const moit_technique *technique, const moit_target_picture *whole,
                              int smaller, const moit_target_picture *small, bool depth_aware,
                              const double *behind, float *out, const moit_run *run) {
    joining j = {.technique = technique,
                 .stages = moit_stages_of(MOIT_FLOAT32, run->isa),
                 .whole = whole,
                 .small = small,
                 .smaller = smaller,
                 .depth_aware = depth_aware,
                 .behind = behind,
                 .out = out};
    return moit_parallel_for(run, whole->height, join_row, &j);
}
