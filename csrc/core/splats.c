/* Splats to fragments: all to the screen, then to tiles, the tiles on several threads. Each tile
 * lists its splats in their order, so no result depends on the number of threads. */
#include "core/offsets.h"
#include "core/splats.h"
#include "core/stages/stages.h"
#include "core/threads.h"
#include "core/tile_lists.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { TILE = MOIT_SPLAT_TILE, TILE_PIXELS = MOIT_SPLAT_PIXELS };

/* ---- To tiles -------------------------------------------------------------------------------- */

static moit_tile_box tiles_of(const void *raster, int64_t i) {
    const moit_screen_splat *s = &((const moit_splat_raster *)raster)->on_screen[i];
    return (moit_tile_box){s->left, s->top, s->right, s->bottom};
}

/* Whether what is hidden has no fragments. */
static bool splats_end(moit_splatting splatting) {
    return splatting == MOIT_PROJECTED || splatting == MOIT_FILTERED;
}

static moit_status list_by_tile(moit_splat_raster *r) {
    int64_t tiles = (int64_t)r->columns * r->rows;
    moit_status status =
        moit_list_by_tile(r->columns, r->rows, r->count, tiles_of, r, &r->first, &r->listed);
    if (status != MOIT_OK) return status;
    for (int64_t t = 0; t < tiles; ++t)
        if (r->first[t + 1] - r->first[t] > r->most_listed)
            r->most_listed = r->first[t + 1] - r->first[t];
    if (!splats_end(r->splatting)) return MOIT_OK;
    r->order = malloc((size_t)(r->first[tiles] + 1) * sizeof *r->order);
    return r->order ? MOIT_OK : MOIT_NO_MEMORY;
}

/* ---- Tiles ----------------------------------------------------------------------------------- */

/* Of a thread: what it sorts by, how far it has come in each pixel, what a splat has there; and of
 * what is drawn front to back the fragments, one after the other, since they stand in another
 * order: where those of each splat begin, the pixel of each (of the tile's), and its alpha. */
typedef struct {
    float *z, *kept;
    int32_t *rank;
    int64_t *begin;
    uint8_t *pixel;
    float through[TILE_PIXELS], alpha[TILE_PIXELS], depth[TILE_PIXELS];
    int64_t next[TILE_PIXELS];
    int32_t count[TILE_PIXELS];
    float nearest, farthest;
} workspace;

typedef struct {
    const moit_splat_raster *raster;
    const moit_stages *stages;
    workspace *spaces; /* one a thread */
    int top, bottom;   /* rows that are drawn */
    int first_row;     /* the first tiles that have some */
    enum { ORDER, COUNT, DRAW } does;
    int64_t *counts; /* (pixels + 1): fragments of pixel p in counts[p + 1] */
    float *depth, *alpha, *color, *deviation;
    moit_splat_visitor *visit; /* what is called instead of writing these; or NULL */
    void *context;
} drawing;

static int within(int64_t value, int least, int most) {
    return value < least ? least : value > most ? most : (int)value;
}

/* What a splat may cover of a tile whose first pixel is (left, top). */
static moit_tile_pixels covered(const moit_screen_splat *s, int left, int top,
                                const moit_tile_pixels *all) {
    return (moit_tile_pixels){
        .left = within((int64_t)s->across[0] - left, all->left, all->right),
        .top = within((int64_t)s->down[0] - top, all->top, all->bottom),
        .right = within((int64_t)s->across[1] - left + 1, all->left, all->right),
        .bottom = within((int64_t)s->down[1] - top + 1, all->top, all->bottom),
    };
}

/* Those of a tile that the picture has among the rows that are drawn. */
static moit_tile_pixels drawn_of_tile(const drawing *d, int left, int top) {
    return (moit_tile_pixels){.left = 0,
                              .top = within((int64_t)d->top - top, 0, TILE),
                              .right = within((int64_t)d->raster->width - left, 0, TILE),
                              .bottom = within((int64_t)d->bottom - top, 0, TILE)};
}

/* Nothing is seen where nothing is drawn: no light comes from there. */
static void let_all_through(workspace *w, const moit_tile_pixels *all) {
    for (int k = 0; k < TILE_PIXELS; ++k) w->through[k] = -1.0f;
    for (int y = all->top; y < all->bottom; ++y)
        for (int x = all->left; x < all->right; ++x) w->through[y * TILE + x] = 1.0f;
}

static bool something_is_seen(const workspace *w) {
    int seen = 0;
    for (int k = 0; k < TILE_PIXELS; ++k) seen |= w->through[k] >= 0.0f;
    return seen;
}

static void order_tile(const drawing *d, workspace *w, const int32_t *listed, int count,
                       int32_t *order) {
    const int32_t offsets[2] = {0, count};
    for (int i = 0; i < count; ++i) w->z[i] = d->raster->on_screen[listed[i]].z;
    d->stages->depth_ranks(1, offsets, w->z, w->rank, order);
    for (int i = 0; i < count; ++i) order[w->rank[i]] = i;
}

enum { BETWEEN_LOOKS = 16 }; /* splats until one looks whether any more are seen */

/* What comes to be read from memory while others are drawn: splats of a tile lie far apart. */
static void fetch(const moit_screen_splat *s) {
    __builtin_prefetch(s);
    __builtin_prefetch((const char *)s + 64);
}

enum { AHEAD = 8 }; /* splats that are fetched before they are drawn */

/* The splat that is n-th to be drawn in a tile. */
static const moit_screen_splat *of_tile(const drawing *d, const int32_t *listed, int count,
                                        const int32_t *order, int n) {
    const moit_screen_splat *on_screen = d->raster->on_screen;
    if (n + AHEAD < count) fetch(&on_screen[listed[order ? order[n + AHEAD] : n + AHEAD]]);
    return &on_screen[listed[order ? order[n] : n]];
}

/* Counts what is seen in these pixels; whether anything is. No branch: what a splat covers of a
 * tile nobody can predict. */
static bool count_pixels(workspace *w, const moit_tile_pixels *r) {
    int seen = 0;
    for (int y = r->top; y < r->bottom; ++y) {
        const float *alpha = w->alpha + y * TILE;
        int32_t *counts = w->count + y * TILE;
        for (int x = r->left; x < r->right; ++x) {
            int one = alpha[x] > 0.0f;
            counts[x] += one;
            seen |= one;
        }
    }
    return seen;
}

/* How far away what is seen in these pixels is. */
static void widen_range(workspace *w, const moit_tile_pixels *r) {
    float nearest = w->nearest, farthest = w->farthest;
    for (int y = r->top; y < r->bottom; ++y)
        for (int k = y * TILE + r->left; k < y * TILE + r->right; ++k) {
            bool there = w->alpha[k] > 0.0f;
            nearest = there && w->depth[k] < nearest ? w->depth[k] : nearest;
            farthest = there && w->depth[k] > farthest ? w->depth[k] : farthest;
        }
    w->nearest = nearest;
    w->farthest = farthest;
}

/* Counts the fragments of the tile's pixels, and finds how far away they are. */
static void count_tile(const drawing *d, workspace *w, const int32_t *listed, int count, int left,
                       int top, const int32_t *order, const moit_tile_pixels *all) {
    memset(w->count, 0, sizeof w->count);
    let_all_through(w, all);
    for (int n = 0; n < count; ++n) {
        if (order && n % BETWEEN_LOOKS == BETWEEN_LOOKS - 1 && !something_is_seen(w)) break;
        const moit_screen_splat *s = of_tile(d, listed, count, order, n);
        moit_tile_pixels r = covered(s, left, top, all);
        if (r.left >= r.right || r.top >= r.bottom) continue;
        d->stages->splat(s, left, top, &r, order, w->through, w->alpha, order ? NULL : w->depth);
        bool seen = count_pixels(w, &r);
        if (!order && seen) widen_range(w, &r);
        if (!order || !seen) continue;
        if (s->z < w->nearest) w->nearest = s->z;
        if (s->z > w->farthest) w->farthest = s->z;
    }
    for (int y = all->top; y < all->bottom; ++y)
        for (int x = all->left; x < all->right; ++x)
            d->counts[(int64_t)(top + y) * d->raster->width + left + x + 1] =
                w->count[y * TILE + x];
}

static void put(const drawing *d, workspace *w, const float color[3], int pixel, float depth,
                float alpha) {
    int64_t at = w->next[pixel]++;
    d->depth[at] = depth;
    d->alpha[at] = alpha;
    for (int c = 0; c < 3; ++c) d->color[3 * at + c] = color[c];
}

/* What is seen in these pixels, as (pixel, alpha) one after the other; how many there are. There is
 * room for one more, which is written and not kept: no branch here either. */
static int64_t pack(const workspace *w, const moit_tile_pixels *r, uint8_t *pixel, float *kept) {
    int64_t found = 0;
    for (int y = r->top; y < r->bottom; ++y)
        for (int k = y * TILE + r->left; k < y * TILE + r->right; ++k) {
            pixel[found] = (uint8_t)k;
            kept[found] = w->alpha[k];
            found += w->alpha[k] > 0.0f;
        }
    return found;
}

/* Of a ray beside its middle, where the direction A d (splat_projection.c) is longer or shorter. */
static float deviation_at(const moit_screen_splat *s, int x, int y) {
    const float *a = s->along;
    double dx = x - s->x, dy = y - s->y;
    double along = (double)a[0] + (double)a[1] * dx + (double)a[2] * dy
                   + ((double)a[3] * dx * dx + (double)a[4] * dx * dy + (double)a[5] * dy * dy);
    double deviation = s->spread / sqrt(along);
    return deviation < (double)FLT_MAX ? (float)deviation : FLT_MAX;
}

/* Calls what is to be called for a fragment. */
static void visit(const drawing *d, workspace *w, int64_t place, const moit_screen_splat *s,
                  int left, int top, int pixel, float alpha) {
    d->visit(d->context, place, s, left + pixel % TILE, top + pixel / TILE, alpha,
             w->next[pixel]++);
}

/* Front to back until nothing more is seen; then again, in the order in which they stand. */
static void draw_front_to_back(const drawing *d, workspace *w, const int32_t *listed, int count,
                               int left, int top, const int32_t *order,
                               const moit_tile_pixels *all) {
    int64_t found = 0;
    int32_t *length = w->rank;
    memset(length, 0, (size_t)count * sizeof *length);
    for (int n = 0; n < count; ++n) {
        if (n % BETWEEN_LOOKS == BETWEEN_LOOKS - 1 && !something_is_seen(w)) break;
        const moit_screen_splat *s = of_tile(d, listed, count, order, n);
        moit_tile_pixels r = covered(s, left, top, all);
        if (r.left >= r.right || r.top >= r.bottom) continue;
        d->stages->splat(s, left, top, &r, true, w->through, w->alpha, NULL);
        int64_t seen = pack(w, &r, w->pixel + found, w->kept + found);
        w->begin[order[n]] = found;
        length[order[n]] = (int32_t)seen;
        found += seen;
    }
    for (int i = 0; i < count; ++i) {
        if (!length[i]) continue;
        const moit_screen_splat *s = &d->raster->on_screen[listed[i]];
        const float color[3] = {s->color[0], s->color[1], s->color[2]}, z = s->z;
        int64_t k = w->begin[i], end = k + length[i];
        for (; d->visit && k < end; ++k)
            visit(d, w, listed + i - d->raster->listed, s, left, top, w->pixel[k], w->kept[k]);
        for (; k < end; ++k) put(d, w, color, w->pixel[k], z, w->kept[k]);
    }
}

static void draw_as_listed(const drawing *d, workspace *w, const int32_t *listed, int count,
                           int left, int top, const moit_tile_pixels *all) {
    for (int i = 0; i < count; ++i) {
        const moit_screen_splat *s = of_tile(d, listed, count, NULL, i);
        moit_tile_pixels r = covered(s, left, top, all);
        if (r.left >= r.right || r.top >= r.bottom) continue;
        d->stages->splat(s, left, top, &r, false, w->through, w->alpha, w->depth);
        for (int y = r.top; y < r.bottom; ++y)
            for (int k = y * TILE + r.left; k < y * TILE + r.right; ++k)
                if (w->alpha[k] > 0.0f && d->visit) {
                    visit(d, w, listed + i - d->raster->listed, s, left, top, k, w->alpha[k]);
                } else if (w->alpha[k] > 0.0f) {
                    if (d->deviation)
                        d->deviation[w->next[k]] = deviation_at(s, left + k % TILE, top + y);
                    put(d, w, s->color, k, w->depth[k], w->alpha[k]);
                }
    }
}

static moit_status draw_tile(void *context, int64_t item, int thread) {
    const drawing *d = context;
    const moit_splat_raster *r = d->raster;
    workspace *w = &d->spaces[thread];
    int64_t tile = (int64_t)d->first_row * r->columns + item;
    int left = (int)(tile % r->columns) * TILE, top = (int)(tile / r->columns) * TILE;
    const int32_t *listed = r->listed + r->first[tile];
    int32_t *order = r->order ? r->order + r->first[tile] : NULL;
    int count = (int)(r->first[tile + 1] - r->first[tile]);
    moit_tile_pixels all = drawn_of_tile(d, left, top);
    if (d->does != DRAW) {
        if (order) order_tile(d, w, listed, count, order);
        if (d->does == COUNT) count_tile(d, w, listed, count, left, top, order, &all);
        return MOIT_OK;
    }
    let_all_through(w, &all);
    int64_t start = r->offsets[(int64_t)d->top * r->width];
    for (int y = all.top; y < all.bottom; ++y)
        for (int x = all.left; x < all.right; ++x)
            w->next[y * TILE + x] = r->offsets[(int64_t)(top + y) * r->width + left + x] - start;
    if (order) draw_front_to_back(d, w, listed, count, left, top, order, &all);
    else draw_as_listed(d, w, listed, count, left, top, &all);
    return MOIT_OK;
}

/* The most fragments that a tile has among the rows that are drawn. */
static int64_t most_of_a_tile(const drawing *d, int64_t tiles) {
    const moit_splat_raster *r = d->raster;
    int64_t most = 0;
    for (int64_t item = 0; item < tiles; ++item) {
        int left = (int)(item % r->columns) * TILE,
            top = (int)(d->first_row + item / r->columns) * TILE;
        moit_tile_pixels all = drawn_of_tile(d, left, top);
        int64_t found = 0;
        for (int y = all.top; y < all.bottom; ++y) {
            const int64_t *row = r->offsets + (int64_t)(top + y) * r->width + left;
            found += row[all.right] - row[all.left];
        }
        if (found > most) most = found;
    }
    return most;
}

static void let_go(workspace *w) {
    free(w->z);
    free(w->rank);
    free(w->begin);
    free(w->pixel);
    free(w->kept);
}

static moit_status for_tiles(drawing *d, float range[2], const moit_run *run) {
    const moit_splat_raster *r = d->raster;
    d->first_row = d->top / TILE;
    int64_t tiles = (int64_t)r->columns * ((d->bottom + TILE - 1) / TILE - d->first_row);
    int threads = (int)(run->threads < tiles ? run->threads : tiles);
    size_t most = (size_t)r->most_listed + MOIT_PADDING,
           kept = r->order && d->does == DRAW ? (size_t)most_of_a_tile(d, tiles) + 1 : 1;
    d->stages = moit_stages_of(MOIT_FLOAT32, run->isa);
    d->spaces = calloc((size_t)threads, sizeof *d->spaces);
    moit_status status = d->spaces ? MOIT_OK : MOIT_NO_MEMORY;
    for (int t = 0; t < threads && status == MOIT_OK; ++t) {
        workspace *w = &d->spaces[t];
        w->nearest = INFINITY;
        w->farthest = -INFINITY;
        w->z = malloc(most * sizeof *w->z);
        w->rank = malloc(most * sizeof *w->rank);
        w->begin = malloc(most * sizeof *w->begin);
        w->pixel = malloc(kept * sizeof *w->pixel);
        w->kept = malloc(kept * sizeof *w->kept);
        if (!w->z || !w->rank || !w->begin || !w->pixel || !w->kept) status = MOIT_NO_MEMORY;
    }
    if (status == MOIT_OK) status = moit_parallel_for(run, tiles, draw_tile, d);
    for (int t = 0; t < threads && d->spaces; ++t) {
        const workspace *w = &d->spaces[t];
        if (range && w->nearest < range[0]) range[0] = w->nearest;
        if (range && w->farthest > range[1]) range[1] = w->farthest;
        let_go(&d->spaces[t]);
    }
    free(d->spaces);
    return status;
}

/* ---- The whole ------------------------------------------------------------------------------- */

/* On the screen and listed by tile; on failure *raster is NULL. */
static moit_status place(const moit_splats *splats, moit_splatting splatting,
                         const moit_camera *camera, int width, int height,
                         moit_splat_raster **raster, const moit_run *run) {
    moit_splat_raster *r = calloc(1, sizeof *r);
    *raster = NULL;
    if (!r) return MOIT_NO_MEMORY;
    *r = (moit_splat_raster){.splatting = splatting,
                             .camera = *camera,
                             .width = width,
                             .height = height,
                             .columns = (width + TILE - 1) / TILE,
                             .rows = (height + TILE - 1) / TILE,
                             .count = splats->count};
    r->on_screen = malloc((size_t)(splats->count + 1) * sizeof *r->on_screen);
    moit_status status = r->on_screen ? MOIT_OK : MOIT_NO_MEMORY;
    if (status == MOIT_OK) status = moit_project_splats(r, splats, run);
    if (status == MOIT_OK) status = list_by_tile(r);
    if (status == MOIT_OK) *raster = r;
    else moit_end_splats(r);
    return status;
}

moit_status moit_begin_splats(const moit_splats *splats, moit_splatting splatting,
                              const moit_camera *camera, int width, int height, int64_t *offsets,
                              float range[2], moit_splat_raster **raster, const moit_run *run) {
    moit_status status = place(splats, splatting, camera, width, height, raster, run);
    if (status != MOIT_OK) return status;
    moit_splat_raster *r = *raster;
    r->offsets = offsets;
    drawing count = {.raster = r, .bottom = height, .does = COUNT, .counts = offsets};
    range[0] = INFINITY;
    range[1] = -INFINITY;
    status = for_tiles(&count, range, run);
    if (status != MOIT_OK) {
        moit_end_splats(r);
        *raster = NULL;
        return status;
    }
    moit_offsets_of_counts(offsets, (int64_t)width * height);
    return MOIT_OK;
}

moit_status moit_draw_splats(const moit_splat_raster *raster, int top, int bottom, float *depth,
                             float *alpha, float *color, float *deviation, const moit_run *run) {
    drawing d = {.raster = raster,
                 .top = top,
                 .bottom = bottom,
                 .does = DRAW,
                 .depth = depth,
                 .alpha = alpha,
                 .color = color,
                 .deviation = deviation};
    return for_tiles(&d, NULL, run);
}

moit_status moit_visit_splats(const moit_splat_raster *raster, int top, int bottom,
                              moit_splat_visitor *visit, void *context, const moit_run *run) {
    drawing d = {.raster = raster,
                 .top = top,
                 .bottom = bottom,
                 .does = DRAW,
                 .visit = visit,
                 .context = context};
    return for_tiles(&d, NULL, run);
}

void moit_end_splats(moit_splat_raster *raster) {
    if (!raster) return;
    free(raster->on_screen);
    free(raster->first);
    free(raster->listed);
    free(raster->order);
    free(raster);
}

moit_status moit_find_screen_splats(const moit_splats *splats, moit_splatting splatting,
                                    const moit_camera *camera, int width, int height,
                                    moit_screen_splats *found, const moit_run *run) {
    *found = (moit_screen_splats){.count = 0};
    moit_splat_raster *r;
    moit_status status = place(splats, splatting, camera, width, height, &r, run);
    if (status != MOIT_OK) return status;
    drawing order = {.raster = r, .bottom = height, .does = ORDER};
    if (r->order) status = for_tiles(&order, NULL, run);
    if (status == MOIT_OK) {
        found->tiles = (int64_t)r->columns * r->rows;
        /* places in a tile's list to splats */
        for (int64_t t = 0; t < found->tiles && r->order; ++t)
            for (int64_t k = r->first[t]; k < r->first[t + 1]; ++k)
                r->order[k] = r->listed[r->first[t] + r->order[k]];
        found->splats = r->on_screen;
        found->count = r->count;
        found->first = r->first;
        found->front_to_back = r->order;
        r->on_screen = NULL;
        r->first = NULL;
        r->order = NULL;
    }
    moit_end_splats(r);
    return status;
}

void moit_let_go_of_screen_splats(moit_screen_splats *found) {
    free(found->splats);
    free(found->first);
    free(found->front_to_back);
    *found = (moit_screen_splats){.count = 0};
}
