/* Cuts an image into tiles, gives each thread room for one, and takes opaque surfaces apart. */
#define _GNU_SOURCE
#include "core/tile.h"

#include "core/pieces.h"
#include "core/system.h"
#include "core/threads.h"

#include <string.h>

/* A tile ends where either is reached; both keep its scratch within a core's second-level cache.
 * One pixel is never cut. A thread takes a run of pixels at a time. */
enum { TILE_FRAGMENTS = 4096, TILE_PIXELS = 512, RUN_PIXELS = 2048 };

typedef struct {
    const moit_job *job;
    void (*answer)(const moit_job *, moit_tile *, void *);
    void *context;
    int most_fragments; /* in a tile */
    int most_pixels;
    moit_runs runs;
    char *memory; /* one part a thread */
    size_t part;
} tiling;

static size_t own_bytes(const tiling *t) {
    const moit_job *job = t->job;
    return job->scratch ? job->scratch(job, t->most_fragments + MOIT_PADDING, t->most_pixels) : 0;
}

static moit_tile lay_out(const tiling *t, pieces *p) {
    const moit_job *job = t->job;
    int64_t n = (int64_t)t->most_fragments + MOIT_PADDING, pixels = t->most_pixels;
    int64_t points = pixels * job->depths + MOIT_PADDING;
    int64_t most_points = points > n ? points : n;
    bool coloured = job->fragments->transmission != NULL;
    size_t s = job->scalar;
    moit_tile tile = {
        .offsets = piece(p, pixels + 1, sizeof(int32_t)),
        .curve_offsets = piece(p, pixels + 1, sizeof(int32_t)),
        .T = piece(p, n, s),
        .total = piece(p, pixels, sizeof(double)),
        .channel_total = piece(p, coloured ? 3 * pixels : 0, sizeof(double)),
        .channel_sum = piece(p, coloured ? 3 * pixels : 0, sizeof(double)),
        .curve = piece(p, points, s),
        .absorbance = piece(p, n, s),
        .z = piece(p, n, s),
        .curve_z = piece(p, points, s),
        .b0 = piece(p, pixels, s),
        .b = piece(p, pixels * MOIT_MOST_NUMBERS, s),
        .double_b0 = piece(p, pixels, sizeof(double)),
        .double_b = piece(p, pixels * MOIT_MOST_NUMBERS, sizeof(double)),
        .rules = piece(p, (pixels + MOIT_PADDING) * MOIT_MOST_RULE, sizeof(double)),
        .sums = piece(p, pixels * 4, sizeof(double)),
        .bounds = {piece(p, most_points, sizeof(double)), piece(p, most_points, sizeof(double))},
        .points = {piece(p, most_points, sizeof(double)), piece(p, most_points, sizeof(double)),
                   piece(p, most_points, sizeof(double))},
        .rank = piece(p, n, sizeof(int32_t)),
        .order = piece(p, n, sizeof(int32_t)),
        .own = piece(p, (int64_t)own_bytes(t), 1),
        .kept = piece(p, n, sizeof(int32_t)),
        .hides = piece(p, pixels, sizeof(int32_t)),
        .filled = piece(p, pixels, sizeof(int32_t)),
        .alone = piece(p, pixels, sizeof(int32_t)),
        .alone_at = piece(p, pixels, sizeof(int32_t)),
        .kept_depth = piece(p, n, s),
        .kept_alpha = piece(p, n, s),
        .kept_color = piece(p, 3 * n, s),
        .kept_weights = piece(p, n, s),
        .net = piece(p, coloured ? n : 0, s),
        .channel = {piece(p, coloured ? n : 0, s), piece(p, coloured ? n : 0, s),
                    piece(p, coloured ? n : 0, s)},
    };
    return tile;
}

static const void *from(const moit_job *job, const void *array, int64_t first, int64_t width) {
    return array ? (const char *)array + (size_t)(first * width) * job->scalar : NULL;
}

static void copy_number(const moit_job *job, void *to, int64_t i, const void *array, int64_t k,
                        int64_t width) {
    size_t bytes = (size_t)width * job->scalar;
    memmove((char *)to + (size_t)i * bytes, (const char *)array + (size_t)k * bytes, bytes);
}

/* Whether nothing of any channel gets through. */
static bool is_opaque(const moit_job *job, const moit_tile *tile, int i) {
    moit_precision precision = job->fragments->precision;
    if (!tile->opacity[0]) return moit_number(precision, tile->alpha, i) == 1.0;
    return moit_number(precision, tile->opacity[0], i) == 1.0
           && moit_number(precision, tile->opacity[1], i) == 1.0
           && moit_number(precision, tile->opacity[2], i) == 1.0;
}

/* Whether one of n numbers has these bits, as 1 has them and nothing else: compilers do comparisons
 * of integers side by side. */
typedef uint32_t __attribute__((may_alias)) bits32;
typedef uint64_t __attribute__((may_alias)) bits64;
static const uint32_t of_one32 = 0x3f800000;
static const uint64_t of_one64 = 0x3ff0000000000000;

static bool has_bits32(int n, const bits32 *numbers, uint32_t bits) {
    uint32_t any = 0;
    for (int i = 0; i < n; ++i) any |= numbers[i] == bits;
    return any;
}

static bool has_bits64(int n, const bits64 *numbers, uint64_t bits) {
    uint64_t any = 0;
    for (int i = 0; i < n; ++i) any |= numbers[i] == bits;
    return any;
}

/* The nearest opaque fragment of each pixel, the first of equals; whether there may be any. */
static bool find_opaque(const moit_job *job, moit_tile *tile) {
    moit_precision precision = job->fragments->precision;
    bool any = precision == MOIT_FLOAT64 ? has_bits64(tile->given, tile->alpha, of_one64)
                                         : has_bits32(tile->given, tile->alpha, of_one32);
    if (!any) return false;
    for (int p = 0; p < tile->pixels; ++p) {
        int nearest = -1;
        for (int i = tile->offsets[p]; i < tile->offsets[p + 1]; ++i)
            if (is_opaque(job, tile, i)
                && (nearest < 0
                    || moit_number(precision, tile->depth, i)
                           < moit_number(precision, tile->depth, nearest)))
                nearest = i;
        tile->hides[p] = nearest;
    }
    return true;
}

/* The depth behind which fragments of pixel p are hidden. */
static double hidden_behind(const moit_job *job, const moit_tile *tile, int p) {
    if (job->limit) return job->limit(job, moit_pixel_at(tile, p));
    return tile->hides[p] < 0 ? __builtin_inf()
                              : moit_number(job->fragments->precision, tile->depth, tile->hides[p]);
}

/* Leaves the fragments that no opaque surface hides, and not the opaque ones themselves. */
static void keep_visible(const moit_job *job, moit_tile *tile) {
    moit_precision precision = job->fragments->precision;
    int kept = 0, start = 0;
    for (int p = 0; p < tile->pixels; ++p) {
        int end = tile->offsets[p + 1];
        double farthest = hidden_behind(job, tile, p);
        for (int i = start; i < end; ++i) {
            if (moit_number(precision, tile->depth, i) > farthest
                || (job->cull_opaque && is_opaque(job, tile, i)))
                continue;
            copy_number(job, tile->kept_depth, kept, tile->depth, i, 1);
            copy_number(job, tile->kept_alpha, kept, tile->emission, i, 1);
            if (tile->opacity[0]) {
                copy_number(job, tile->net, kept, tile->alpha, i, 1);
                for (int c = 0; c < 3; ++c)
                    copy_number(job, tile->channel[c], kept, tile->opacity[c], i, 1);
            }
            if (tile->color) copy_number(job, tile->kept_color, kept, tile->color, i, 3);
            if (tile->weights) copy_number(job, tile->kept_weights, kept, tile->weights, i, 1);
            tile->kept[kept++] = i;
        }
        start = end;
        tile->offsets[p + 1] = kept;
    }
    tile->fragments = kept;
    tile->depth = tile->kept_depth;
    tile->emission = tile->kept_alpha;
    if (!tile->opacity[0]) tile->alpha = tile->emission;
    if (tile->color) tile->color = tile->kept_color;
    if (tile->weights) tile->weights = tile->kept_weights;
    tile->source = tile->kept;
    if (!job->limit) tile->opaque = tile->hides;
}

/* Moves pixels that have fragments together. */
static void leave_out_empty(moit_tile *tile) {
    int empty = 0, filled = 0, start = 0;
    for (int p = 0; p < tile->cut; ++p) empty |= tile->offsets[p] == tile->offsets[p + 1];
    if (!empty) return;
    for (int p = 0; p < tile->cut; ++p) {
        int end = tile->offsets[p + 1];
        tile->filled[filled] = p;
        tile->offsets[filled + 1] = end;
        filled += end > start;
        start = end;
    }
    tile->pixels = filled;
    tile->place = tile->filled;
}

static void prepare(const moit_job *job, moit_tile *tile, int64_t first, int pixels) {
    const moit_fragments *f = job->fragments;
    tile->first_pixel = first;
    tile->pixels = tile->cut = pixels;
    tile->place = NULL;
    tile->first_fragment = f->offsets[first];
    for (int p = 0; p <= pixels; ++p)
        tile->offsets[p] = (int32_t)(f->offsets[first + p] - tile->first_fragment);
    if (job->depths)
        for (int p = 0; p <= pixels; ++p) tile->curve_offsets[p] = (int32_t)(p * job->depths);
    tile->given = tile->fragments = tile->offsets[pixels];
    if (job->skips_empty) leave_out_empty(tile);
    tile->depth = from(job, f->depth, tile->first_fragment, 1);
    tile->alpha = tile->emission = from(job, f->alpha, tile->first_fragment, 1);
    tile->color = from(job, f->color, tile->first_fragment, 3);
    tile->weights = from(job, job->weights, tile->first_fragment, 1);
    if (f->transmission) {
        job->stages->opacities(tile->given, tile->emission,
                               from(job, f->transmission, tile->first_fragment, 3),
                               tile->channel[0], tile->channel[1], tile->channel[2], tile->net);
        tile->alpha = tile->net;
        for (int c = 0; c < 3; ++c) tile->opacity[c] = tile->channel[c];
    }
    tile->source = NULL;
    tile->opaque = NULL;
    tile->absorbed = false;
    if (job->limit || (job->cull_opaque && find_opaque(job, tile))) keep_visible(job, tile);
}

/* How many pixels from `first` on make a tile: at least one, as far as both limits go. */
static int tile_length(const tiling *t, int64_t first, int64_t end) {
    const int64_t *offsets = t->job->fragments->offsets;
    int64_t limit = first + t->most_pixels < end ? first + t->most_pixels : end, last = first + 1;
    if (offsets[limit] - offsets[first] <= TILE_FRAGMENTS) return (int)(limit - first);
    while (limit - last > 1) { /* `limit` is too far */
        int64_t middle = last + (limit - last) / 2;
        if (offsets[middle] - offsets[first] <= TILE_FRAGMENTS) last = middle;
        else limit = middle;
    }
    return (int)(last - first);
}

static moit_status answer_run(void *context, int64_t item, int thread) {
    const tiling *t = context;
    int64_t pixels = t->job->fragments->pixels;
    int64_t first = t->runs.first + item * t->runs.length, end = first + t->runs.length;
    if (first < 0) first = 0;
    if (end > pixels) end = pixels;
    moit_tile tile = lay_out(t, &(pieces){t->memory + (size_t)thread * t->part, 0});
    if (!t->job->depths)
        memset(tile.curve_offsets, 0, (size_t)(t->most_pixels + 1) * sizeof *tile.curve_offsets);
    while (first < end) {
        int length = tile_length(t, first, end);
        prepare(t->job, &tile, first, length);
        t->answer(t->job, &tile, t->context);
        first += length;
    }
    return MOIT_OK;
}

moit_job moit_plain_job(const moit_fragments *fragments, bool cull_opaque, const moit_run *run) {
    return (moit_job){
        .fragments = fragments,
        .run = run,
        .stages = moit_stages_of(fragments->precision, run->isa),
        .precise = moit_stages_of(MOIT_FLOAT64, run->isa),
        .scalar = moit_scalar_size(fragments->precision),
        .cull_opaque = cull_opaque,
    };
}

moit_status moit_for_tiles(const moit_job *job,
                           void (*answer)(const moit_job *, moit_tile *, void *), void *context) {
    return moit_for_tiles_of(job, &(moit_runs){0, RUN_PIXELS}, answer, context);
}

moit_status moit_for_tiles_of(const moit_job *job, const moit_runs *runs_,
                              void (*answer)(const moit_job *, moit_tile *, void *),
                              void *context) {
    const int64_t *offsets = job->fragments->offsets;
    int64_t pixels = job->fragments->pixels, all = offsets[pixels];
    int64_t most = all < TILE_FRAGMENTS ? all : TILE_FRAGMENTS; /* small images need little room */
    for (int64_t first = 0; first < pixels; first += 64) {
        int64_t end = first + 64 < pixels ? first + 64 : pixels;
        if (offsets[end] - offsets[first] <= most) continue; /* nor has one of them more */
        for (int64_t p = first; p < end; ++p) {
            int64_t n = offsets[p + 1] - offsets[p];
            if (n > most) most = n;
        }
    }
    /* places in a tile are int32_t, with the padding and three colours to a fragment */
    if (most > INT32_MAX / 4) return MOIT_NO_MEMORY;
    tiling t = {.job = job,
                .answer = answer,
                .context = context,
                .most_fragments = (int)most,
                .runs = *runs_};
    t.most_pixels = TILE_PIXELS;
    if (job->depths > 64) { /* keep a tile's curves in cache, too */
        int64_t fit = TILE_PIXELS * 64 / job->depths;
        t.most_pixels = fit > 1 ? (int)fit : 1;
    }
    if (pixels < t.most_pixels) t.most_pixels = (int)pixels;
    if (job->depths > INT32_MAX / 4) return MOIT_NO_MEMORY;

    pieces size = {NULL, 0};
    lay_out(&t, &size);
    t.part = size.used;
    int64_t runs = (pixels - t.runs.first + t.runs.length - 1) / t.runs.length;
    int64_t threads = job->run->threads < runs ? job->run->threads : runs;
    if (threads < 1) return MOIT_OK;
    t.memory = moit_aligned_memory(t.part * (size_t)threads);
    if (!t.memory) return MOIT_NO_MEMORY;
    moit_status status = moit_parallel_for(job->run, runs, answer_run, &t);
    moit_free_aligned(t.memory);
    return status;
}

/* The least and the greatest depth of a pixel's fragments, or of those alone that are not opaque.
 */
static void find_range(const moit_job *job, const moit_tile *tile, int p, bool opaque_too,
                       double *near, double *far) {
    moit_precision precision = job->fragments->precision;
    for (int i = tile->offsets[p]; i < tile->offsets[p + 1]; ++i) {
        if (!opaque_too && is_opaque(job, tile, i)) continue;
        double depth = moit_number(precision, tile->depth, i);
        if (depth < *near) *near = depth;
        if (depth > *far) *far = depth;
    }
}

moit_warp_map moit_pixel_warp(const moit_job *job, const moit_tile *tile, int p) {
    moit_warp_map map = job->warp;
    map.near = __builtin_inf();
    map.far = -map.near;
    find_range(job, tile, p, job->cull_opaque, &map.near, &map.far);
    if (map.near > map.far) find_range(job, tile, p, true, &map.near, &map.far);
    return map;
}

void moit_widen_range(const moit_job *job, const moit_tile *tile, int p, double *near,
                      double *far) {
    if (!job->cull_opaque) find_range(job, tile, p, true, near, far);
}

void moit_display_places(const moit_job *job, const moit_tile *tile, uint32_t *row,
                         uint32_t *column) {
    const moit_fragments *f = job->fragments;
    int64_t width = f->width ? f->width : f->pixels;
    for (int p = 0; p < tile->pixels; ++p) {
        int64_t pixel = moit_pixel_at(tile, p);
        uint32_t down = (uint32_t)(f->top + pixel / width),
                 right = (uint32_t)(f->left + pixel % width);
        for (int i = tile->offsets[p]; i < tile->offsets[p + 1]; ++i) {
            row[i] = down;
            column[i] = right;
        }
    }
    memset(row + tile->fragments, 0, MOIT_PADDING * sizeof *row);
    memset(column + tile->fragments, 0, MOIT_PADDING * sizeof *column);
}
