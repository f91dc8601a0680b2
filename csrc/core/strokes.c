/* Strokes to fragments: their parts to tiles, the tiles on several threads. Each tile lists its
 * parts in their order, so no result depends on the number of threads. */
#include "core/offsets.h"
#include "core/stages/stages.h"
#include "core/stroke_layers.h"
#include "core/threads.h"
#include "core/tile_lists.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { TILE = MOIT_STROKE_TILE, TILE_PIXELS = TILE * TILE };

/* ---- To tiles -------------------------------------------------------------------------------- */

static moit_tile_box tiles_of(const void *raster, int64_t i) {
    const moit_stroke_raster *r = raster;
    moit_screen_stroke s = moit_screen_stroke_of(r, &r->parts[i]);
    if (s.left >= s.right || s.top >= s.bottom) return (moit_tile_box){0};
    return (moit_tile_box){s.left / TILE, s.top / TILE, (s.right - 1) / TILE + 1,
                           (s.bottom - 1) / TILE + 1};
}

/* ---- Tiles ----------------------------------------------------------------------------------- */

/* Of a thread: in each pixel of a tile the layer that its stroke may still add to, and of a closed
 * stroke the one that has its first part; which pixels have one; and where fragments go, or how
 * many there are. */
typedef struct {
    moit_stroke_layer open[TILE_PIXELS], first[TILE_PIXELS];
    bool is_open[TILE_PIXELS], has_first[TILE_PIXELS];
    int touched[TILE_PIXELS], count;
    int64_t next[TILE_PIXELS], place_of_first[TILE_PIXELS];
    float nearest, farthest;
} workspace;

typedef struct {
    const moit_stroke_raster *raster;
    const moit_stages *stages;
    workspace *spaces; /* one a thread */
    int top, bottom;   /* rows that are drawn */
    int first_row;     /* the first tiles that have some */
    int64_t *counts;   /* (pixels + 1): fragments of pixel p in counts[p + 1]; or NULL: draw */
    const double *reached;
    float *depth, *alpha, *color;
} drawing;

static void finish_at(const drawing *d, workspace *w, int64_t at, const moit_stroke_layer *layer) {
    const double *reached = d->reached ? d->reached + at * d->raster->camera.lights.count : NULL;
    if (d->counts) { /* depth is all that is asked */
        moit_stroke_fragment f = moit_fragment_of_stroke(d->raster, layer, NULL);
        w->nearest = fminf(w->nearest, f.depth);
        w->farthest = fmaxf(w->farthest, f.depth);
        return;
    }
    moit_stroke_fragment f = moit_fragment_of_stroke(d->raster, layer, reached);
    d->depth[at] = f.depth;
    d->alpha[at] = f.alpha;
    for (int k = 0; k < 3; ++k) d->color[3 * at + k] = f.color[k];
}

static void finish(const drawing *d, workspace *w, int pixel, const moit_stroke_layer *layer) {
    finish_at(d, w, w->next[pixel]++, layer);
}

/* The pixel's stroke goes on elsewhere. What the last part of a closed one may still join keeps its
 * place among the others. */
static void retire(const drawing *d, workspace *w, int pixel) {
    if (w->open[pixel].opens) {
        w->first[pixel] = w->open[pixel];
        w->has_first[pixel] = true;
        w->place_of_first[pixel] = w->next[pixel]++;
    } else finish(d, w, pixel, &w->open[pixel]);
    w->is_open[pixel] = false;
}

/* All layers of a stroke. */
static void finish_stroke(const drawing *d, workspace *w) {
    for (int i = 0; i < w->count; ++i) {
        int pixel = w->touched[i];
        moit_stroke_layer *first = &w->first[pixel], *open = &w->open[pixel];
        if (w->has_first[pixel] && w->is_open[pixel] && open->closes) {
            moit_join_strokes(first, open);
            w->is_open[pixel] = false;
        }
        if (w->has_first[pixel]) finish_at(d, w, w->place_of_first[pixel], first);
        if (w->is_open[pixel]) finish(d, w, pixel, open);
        w->has_first[pixel] = w->is_open[pixel] = false;
    }
    w->count = 0;
}

/* Another part of the stroke that goes over the tile covers `own` of a pixel at (x, y). */
static void add(const drawing *d, workspace *w, const moit_screen_stroke *s, int pixel, double x,
                double y, moit_stroke_layer *own) {
    moit_stroke_layer *open = &w->open[pixel];
    if (!w->is_open[pixel] && !w->has_first[pixel]) w->touched[w->count++] = pixel;
    bool goes_on = w->is_open[pixel] && open->place == own->place - 1
                   && moit_stroke_goes_on(open, own, s, 0, x, y);
    if (w->is_open[pixel] && !goes_on) retire(d, w, pixel);
    if (s->closes && w->has_first[pixel])
        own->closes = moit_stroke_goes_on(&w->first[pixel], own, s, 1, x, y);
    if (goes_on) moit_join_strokes(open, own);
    else *open = *own;
    w->is_open[pixel] = true;
}

static int least(int a, int b) { return a < b ? a : b; }
static int most(int a, int b) { return a > b ? a : b; }

/* Whether no fragment of a part is nearer or farther than all before, whatever rounding does. */
static bool lies_within(const workspace *w, const moit_screen_stroke *s) {
    double size = fmax(s->size[0], s->size[1]), near = fmin(s->at[2], s->at[5]) - size,
           far = fmax(s->at[2], s->at[5]) + size, rounding = 1e-6 * far;
    return near - rounding > (double)w->nearest && far + rounding < (double)w->farthest;
}

/* A part in the pixels of `all`, those of the tile at (left, top). */
static void draw_part(const drawing *d, workspace *w, const moit_stroke_look *look,
                      const moit_tile_box *all, int left, int top) {
    const moit_screen_stroke *s = look->stroke;
    int from = most(s->left, all->left), to = least(s->right, all->right);
    if (from >= to) return;
    moit_stroke_row row;
    moit_stroke_layer own;
    for (int y = most(s->top, all->top); y < least(s->bottom, all->bottom); ++y) {
        moit_look_at_row(look, from, y, to - from, &row);
        for (int x = from; x < to; ++x) {
            int pixel = (y - top) * TILE + x - left;
            if (!moit_cover_by_stroke(look, &row, x - from, &own)) continue;
            if (look->exists_only) ++w->next[pixel];
            else if (look->alone) finish(d, w, pixel, &own);
            else add(d, w, s, pixel, x, y, &own);
        }
    }
}

static moit_status draw_tile(void *context, int64_t item, int thread) {
    const drawing *d = context;
    const moit_stroke_raster *r = d->raster;
    workspace *w = &d->spaces[thread];
    int64_t tile = (int64_t)d->first_row * r->columns + item;
    int left = (int)(tile % r->columns) * TILE, top = (int)(tile / r->columns) * TILE;
    moit_tile_box all = {left, most(top, d->top), least(left + TILE, r->width),
                         least(top + TILE, d->bottom)};
    int64_t start = d->counts ? 0 : r->offsets[(int64_t)d->top * r->width];
    for (int y = all.top; y < all.bottom; ++y)
        for (int x = all.left; x < all.right; ++x)
            w->next[(y - top) * TILE + x - left] =
                d->counts ? 0 : r->offsets[(int64_t)y * r->width + x] - start;
    for (int64_t k = r->first[tile]; k < r->first[tile + 1]; ++k) {
        const moit_screen_stroke s = moit_screen_stroke_of(r, &r->parts[r->listed[k]]);
        bool begins = k == r->first[tile] || r->parts[r->listed[k - 1]].stroke != s.stroke,
             ends = k + 1 == r->first[tile + 1] || r->parts[r->listed[k + 1]].stroke != s.stroke;
        if (begins) finish_stroke(d, w);
        bool alone = begins && ends;
        const moit_stroke_look look = {.raster = r,
                                       .stages = d->stages,
                                       .stroke = &s,
                                       .alone = alone,
                                       .depth_only = d->counts,
                                       .exists_only = d->counts && alone && lies_within(w, &s)};
        draw_part(d, w, &look, &all, left, top);
    }
    finish_stroke(d, w);
    for (int y = all.top; d->counts && y < all.bottom; ++y)
        for (int x = all.left; x < all.right; ++x)
            d->counts[(int64_t)y * r->width + x + 1] = w->next[(y - top) * TILE + x - left];
    return MOIT_OK;
}

static moit_status for_tiles(drawing *d, float range[2], const moit_run *run) {
    const moit_stroke_raster *r = d->raster;
    d->first_row = d->top / TILE;
    d->stages = moit_stages_of(MOIT_FLOAT64, run->isa);
    int64_t tiles = (int64_t)r->columns * ((d->bottom + TILE - 1) / TILE - d->first_row);
    int threads = (int)(run->threads < tiles ? run->threads : tiles);
    d->spaces = calloc((size_t)threads, sizeof *d->spaces);
    if (!d->spaces) return MOIT_NO_MEMORY;
    for (int t = 0; t < threads; ++t) {
        d->spaces[t].nearest = INFINITY;
        d->spaces[t].farthest = -INFINITY;
    }
    moit_status status = moit_parallel_for(run, tiles, draw_tile, d);
    for (int t = 0; t < threads && range; ++t) {
        range[0] = fminf(range[0], d->spaces[t].nearest);
        range[1] = fmaxf(range[1], d->spaces[t].farthest);
    }
    free(d->spaces);
    return status;
}

/* ---- The whole ------------------------------------------------------------------------------- */

moit_status moit_begin_strokes(const moit_strokes *strokes, const moit_stroking *how,
                               const moit_camera *camera, int width, int height, int64_t *offsets,
                               float range[2], moit_stroke_raster **raster, const moit_run *run) {
    moit_stroke_raster *r = calloc(1, sizeof *r);
    *raster = r;
    if (!r) return MOIT_NO_MEMORY;
    *r = moit_stroke_raster_of(how, camera, width, height);
    r->columns = (width + TILE - 1) / TILE;
    r->rows = (height + TILE - 1) / TILE;
    r->offsets = offsets;
    range[0] = INFINITY;
    range[1] = -INFINITY;
    moit_status status = moit_stroke_parts(r, strokes);
    if (status == MOIT_OK)
        status =
            moit_list_by_tile(r->columns, r->rows, r->count, tiles_of, r, &r->first, &r->listed);
    drawing count = {.raster = r, .bottom = height, .counts = offsets};
    if (status == MOIT_OK) status = for_tiles(&count, range, run);
    if (status != MOIT_OK) {
        moit_end_strokes(r);
        *raster = NULL;
        return status;
    }
    moit_offsets_of_counts(offsets, (int64_t)width * height);
    return MOIT_OK;
}

moit_status moit_draw_strokes(const moit_stroke_raster *raster, int top, int bottom,
                              const double *reached, float *depth, float *alpha, float *color,
                              const moit_run *run) {
    drawing d = {.raster = raster,
                 .top = top,
                 .bottom = bottom,
                 .reached = reached,
                 .depth = depth,
                 .alpha = alpha,
                 .color = color};
    return for_tiles(&d, NULL, run);
}

void moit_end_strokes(moit_stroke_raster *raster) {
    if (!raster) return;
    free(raster->parts);
    free(raster->first);
    free(raster->listed);
    free(raster);
}

/* The most opacity of each stroke, and of closed ones where their first and last parts are. */
static void know_strokes(moit_screen_stroke *parts, int64_t count) {
    for (int64_t from = 0, to; from < count; from = to) {
        float most_alpha = 0.0f;
        for (to = from; to < count && parts[to].stroke == parts[from].stroke; ++to)
            most_alpha = fmaxf(most_alpha, parts[to].alpha);
        for (int64_t i = from; i < to; ++i) parts[i].alpha = most_alpha;
        if (!parts[from].opens || !parts[to - 1].closes) continue;
        parts[from].other = (int32_t)(to - 1);
        parts[to - 1].other = (int32_t)from;
    }
}

moit_status moit_find_screen_strokes(const moit_strokes *strokes, const moit_stroking *how,
                                     const moit_camera *camera, int width, int height,
                                     moit_screen_stroke **parts, int64_t *count) {
    moit_stroke_raster r = moit_stroke_raster_of(how, camera, width, height);
    *count = 0;
    *parts = NULL;
    moit_status status = moit_stroke_parts(&r, strokes);
    if (status != MOIT_OK) return status;
    moit_screen_stroke *seen = *parts = malloc((size_t)(r.count + 1) * sizeof *seen);
    for (int64_t i = 0; seen && i < r.count; ++i) {
        seen[*count] = moit_screen_stroke_of(&r, &r.parts[i]);
        *count += seen[*count].left < seen[*count].right && seen[*count].top < seen[*count].bottom;
    }
    if (seen) know_strokes(seen, *count);
    free(r.parts);
    return seen ? MOIT_OK : MOIT_NO_MEMORY;
}
