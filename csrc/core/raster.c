/* Triangles to fragments: to tiles on one thread, the tiles on several. Each tile lists its
 * triangles in their order, so no result depends on the number of threads. */
#include "core/offsets.h"
#include "core/projection.h"
#include "core/stages/stages.h"
#include "core/threads.h"
#include "core/tile_lists.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- To tiles -------------------------------------------------------------------------------- */

typedef struct {
    int left, top, right, bottom; /* [left, right), [top, bottom) */
} rectangle;

static int least_of(const int32_t x[3]) {
    int least = x[0] < x[1] ? x[0] : x[1];
    return least < x[2] ? least : x[2];
}

static int most_of(const int32_t x[3]) {
    int most = x[0] > x[1] ? x[0] : x[1];
    return most > x[2] ? most : x[2];
}

static int limited(int x, int most) { return x < 0 ? 0 : x > most ? most : x; }

/* The pixels whose middles may be inside, by floors of x / 256 beyond the middles. */
static rectangle bounds_of(const moit_raster *r, const moit_projected_triangle *t) {
    /* by areas the pixels that it touches, whose far sides are beyond its least x */
    int before = r->by_area ? 0 : MOIT_SUBPIXELS / 2 - 1,
        behind = r->by_area ? 1 : MOIT_SUBPIXELS / 2;
    return (rectangle){
        .left = limited((least_of(t->x) + before) >> 8, r->width),
        .top = limited((least_of(t->y) + before) >> 8, r->height),
        .right = limited(((most_of(t->x) - behind) >> 8) + 1, r->width),
        .bottom = limited(((most_of(t->y) - behind) >> 8) + 1, r->height),
    };
}

static moit_tile_box tiles_of(const void *raster, int64_t i) {
    const moit_raster *r = raster;
    rectangle b = bounds_of(r, &r->triangles[i]);
    if (b.left >= b.right || b.top >= b.bottom) return (moit_tile_box){0};
    return (moit_tile_box){b.left / MOIT_RASTER_TILE, b.top / MOIT_RASTER_TILE,
                           (b.right - 1) / MOIT_RASTER_TILE + 1,
                           (b.bottom - 1) / MOIT_RASTER_TILE + 1};
}

/* ---- Tiles ----------------------------------------------------------------------------------- */

enum { TILE = MOIT_RASTER_TILE, TILE_PIXELS = TILE * TILE };

typedef struct {
    moit_covered covered;
    double occluder[TILE_PIXELS]; /* z of the nearest opaque surface, or infinity */
    int32_t opaque[TILE_PIXELS];  /* its triangle, -1: none */
    int64_t next[TILE_PIXELS];    /* where the pixel's next fragment goes, or how many there are */
    int64_t place[TILE_PIXELS];   /* of a covered pixel that is drawn */
    bool occluded;                /* some have an opaque surface */
    double color[3][MOIT_REACHED], alpha[MOIT_REACHED];
    double image_color[3][MOIT_REACHED], image_alpha[MOIT_REACHED]; /* stages->sample */
    double reached[MOIT_MOST_LIGHTS][MOIT_REACHED]; /* what of each light comes there */
} workspace;

typedef struct {
    const moit_raster *raster;
    const moit_stages *stages;
    workspace *spaces; /* one a thread */
    int64_t *counts;   /* (pixels + 1): fragments of pixel p in counts[p + 1]; or NULL: draw */
    float *depth, *alpha, *color;
    const double *reached; /* (fragments, lights); NULL: all */
    double *share;         /* by areas only */
    int32_t *source;
} drawing;

static rectangle tile_bounds(const moit_raster *r, int64_t tile) {
    int left = (int)(tile % r->columns) * TILE, top = (int)(tile / r->columns) * TILE;
    return (rectangle){left, top, left + TILE < r->width ? left + TILE : r->width,
                       top + TILE < r->height ? top + TILE : r->height};
}

/* What the mesh's corners count at the k-th of a triangle's own; room: for where no row has it. */
static const double *weights_of(const moit_raster *r, const moit_projected_triangle *t, int k,
                                double room[3]) {
    if (t->clipped >= 0) return r->weights[t->clipped][k];
    for (int from = 0; from < 3; ++from) room[from] = 0.0;
    room[t->turned && k ? 3 - k : k] = 1.0;
    return room;
}

static void load_corners(const moit_raster *r, const moit_projected_triangle *t,
                         moit_corners *out) {
    const moit_mesh *m = r->mesh;
    const int32_t *vertex = m->corners + 3 * t->source;
    const moit_material *material = moit_material_of(r, t->source);
    bool masked = material && material->masked; /* then alpha is asked all the same */
    moit_corners own;
    double place[3][3], facet[3] = {0};
    for (int k = 0; k < 3; ++k) {
        int64_t v = vertex[k];
        for (int c = 0; c < 3; ++c) {
            own.color[k][c] = (double)m->color[3 * v + c];
            place[k][c] = (double)m->position[3 * v + c];
        }
        own.alpha[k] = (double)m->alpha[v];
    }
    for (int c = 0; c < 3; ++c) {
        int y = (c + 1) % 3, z = (c + 2) % 3;
        facet[c] = (place[1][y] - place[0][y]) * (place[2][z] - place[0][z])
                   - (place[1][z] - place[0][z]) * (place[2][y] - place[0][y]);
    }
    for (int k = 0; k < 3; ++k) {
        double n[3];
        for (int c = 0; c < 3; ++c)
            n[c] = m->normal ? (double)m->normal[3 * (int64_t)vertex[k] + c] : facet[c];
        own.normal[k][0] = moit_dot(r->camera.right, n);
        own.normal[k][1] = moit_dot(r->camera.up, n);
        own.normal[k][2] = moit_dot(r->camera.forward, n);
    }
    for (int k = 0; k < 3; ++k) {
        double turn[3];
        const double *weight = weights_of(r, t, k, turn);
        out->alpha[k] = 0.0;
        for (int c = 0; c < 3; ++c) out->color[k][c] = out->normal[k][c] = 0.0;
        for (int from = 0; from < 3; ++from) {
            out->alpha[k] += weight[from] * own.alpha[from];
            for (int c = 0; c < 3; ++c) {
                out->color[k][c] += weight[from] * own.color[from][c];
                out->normal[k][c] += weight[from] * own.normal[from][c];
            }
        }
        if (t->opaque && !masked) out->alpha[k] = 1.0;
    }
}

static void load_sampling(const moit_raster *r, const moit_projected_triangle *t,
                          const moit_material *material, moit_sampling *out) {
    const moit_mesh *m = r->mesh;
    const int32_t *vertex = m->corners + 3 * t->source;
    *out = (moit_sampling){.material = material, .texels = material->texels};
    for (int k = 0; k < 3; ++k) {
        double turn[3];
        const double *weight = weights_of(r, t, k, turn);
        for (int from = 0; from < 3; ++from) {
            out->u[k] += weight[from] * (double)m->uv[2 * (int64_t)vertex[from]];
            out->v[k] += weight[from] * (double)m->uv[2 * (int64_t)vertex[from] + 1];
        }
    }
    memcpy(out->inverse_z, t->inverse_z, sizeof out->inverse_z);
    double area = (double)(t->x[1] - t->x[0]) * (t->y[2] - t->y[0])
                  - (double)(t->y[1] - t->y[0]) * (t->x[2] - t->x[0]);
    double pixel = MOIT_SUBPIXELS / area;
    out->step[0][0] = (t->y[2] - t->y[0]) * pixel;
    out->step[0][1] = (t->y[0] - t->y[1]) * pixel;
    out->step[1][0] = (t->x[0] - t->x[2]) * pixel;
    out->step[1][1] = (t->x[1] - t->x[0]) * pixel;
}

/* What covered pixels have of the triangle's image, in w->image_color and w->image_alpha. */
static void read_image(const drawing *d, workspace *w, const moit_projected_triangle *t,
                       const moit_material *material, const moit_corners *corners, int count) {
    moit_sampling sampling;
    load_sampling(d->raster, t, material, &sampling);
    d->stages->sample(count, corners, &w->covered, &sampling, w->image_color[0], w->image_alpha);
}

static void move_covered(moit_covered *c, int from, int to) {
    c->x[to] = c->x[from];
    c->y[to] = c->y[from];
    c->second[to] = c->second[from];
    c->third[to] = c->third[from];
    c->z[to] = c->z[from];
    c->share[to] = c->share[from];
    c->place[to] = c->place[from];
}

/* Of so many covered pixels those that are no hole of the image, moved together. */
static int without_holes(const drawing *d, workspace *w, const moit_projected_triangle *t,
                         const moit_material *material, int count) {
    moit_corners corners;
    load_corners(d->raster, t, &corners);
    read_image(d, w, t, material, &corners, count);
    int kept = 0;
    for (int i = 0; i < count; ++i)
        if (w->image_alpha[i] >= (double)material->cutoff) move_covered(&w->covered, i, kept++);
    return kept;
}

/* What of the triangle lies in the tile and is not too far to be seen, moved together. */
static int visible(const drawing *d, workspace *w, const moit_projected_triangle *t,
                   rectangle tile) {
    rectangle b = bounds_of(d->raster, t);
    moit_covered *c = &w->covered;
    int (*cover)(const moit_projected_triangle *, int, int, int, int, moit_covered *) =
        d->raster->by_area ? moit_cover_areas : d->stages->cover;
    int count =
        cover(t, b.left > tile.left ? b.left : tile.left, b.top > tile.top ? b.top : tile.top,
              b.right < tile.right ? b.right : tile.right,
              b.bottom < tile.bottom ? b.bottom : tile.bottom, c);
    const double near = d->raster->camera.near * (1.0 - 1e-12), far = d->raster->camera.far;
    int kept = 0, outside = 0;
    for (int i = 0; i < count; ++i) outside |= !(c->z[i] >= near) | !(c->z[i] <= far);
    if (!outside) kept = count;
    for (int i = 0; outside && i < count; ++i)
        if (c->z[i] >= near && c->z[i] <= far) move_covered(c, i, kept++);
    const moit_material *material = moit_material_of(d->raster, t->source);
    return material && material->masked && kept ? without_holes(d, w, t, material, kept) : kept;
}

/* Of what is drawn by areas it is known only when all is drawn which of it hides something. */
static bool hides(const moit_raster *r, const moit_projected_triangle *t) {
    return t->opaque && !r->by_area;
}

/* As numbers of the fragments have it, so that nothing changes sides when it is rounded. */
static double rounded(double z) { return (double)(float)z; }

static void find_occluders(const drawing *d, workspace *w, int64_t tile, rectangle bounds) {
    const moit_raster *r = d->raster;
    for (int p = 0; p < TILE_PIXELS; ++p) {
        w->occluder[p] = __builtin_inf();
        w->opaque[p] = -1;
    }
    w->occluded = false;
    for (int64_t k = r->first[tile]; k < r->first[tile + 1]; ++k) {
        const moit_projected_triangle *t = &r->triangles[r->listed[k]];
        if (!hides(r, t)) continue;
        int count = visible(d, w, t, bounds);
        w->occluded |= count > 0;
        for (int i = 0; i < count; ++i) {
            int p = w->covered.place[i];
            if (rounded(w->covered.z[i]) >= w->occluder[p]) continue;
            w->occluder[p] = rounded(w->covered.z[i]);
            w->opaque[p] = r->listed[k];
        }
    }
}

/* The covered pixels of which w->place says where they go, -1: nowhere. */
static void put(const drawing *d, workspace *w, const moit_projected_triangle *t, int count) {
    const moit_camera *c = &d->raster->camera;
    const double view[4] = {2.0 / (d->raster->width * c->scale[0]), -1.0 / c->scale[0],
                            -2.0 / (d->raster->height * c->scale[1]), 1.0 / c->scale[1]};
    moit_corners corners;
    load_corners(d->raster, t, &corners);
    int lights = c->lights.count;
    for (int i = 0; d->reached && i < count; ++i)
        for (int l = 0; l < lights && w->place[i] >= 0; ++l)
            w->reached[l][i] = d->reached[w->place[i] * lights + l];
    const moit_material *material = moit_material_of(d->raster, t->source);
    if (!material || material->lit)
        d->stages->shade(count, &corners, &w->covered, view, &c->lights,
                         d->reached ? w->reached[0] : NULL, w->color[0], w->alpha);
    if (material) {
        read_image(d, w, t, material, &corners, count);
        for (int i = 0; i < count; ++i) w->alpha[i] = material->masked ? 1.0 : w->image_alpha[i];
        for (int k = 0; k < 3; ++k)
            for (int i = 0; i < count; ++i)
                w->color[k][i] =
                    material->lit ? w->color[k][i] * w->image_color[k][i] : w->image_color[k][i];
    }
    for (int i = 0; i < count; ++i) {
        int64_t at = w->place[i];
        if (at < 0) continue;
        d->depth[at] = (float)w->covered.z[i];
        d->alpha[at] = (float)w->alpha[i];
        for (int k = 0; k < 3; ++k) d->color[3 * at + k] = (float)w->color[k][i];
        if (!d->share) continue;
        d->share[at] = w->covered.share[i];
        d->source[at] = (int32_t)(t->turned ? -1 - t->source : t->source);
    }
}

static void draw_occluders(const drawing *d, workspace *w, int64_t tile, rectangle bounds) {
    const moit_raster *r = d->raster;
    for (int64_t k = r->first[tile]; k < r->first[tile + 1]; ++k) {
        const moit_projected_triangle *t = &r->triangles[r->listed[k]];
        if (!hides(r, t)) continue;
        int count = visible(d, w, t, bounds);
        for (int i = 0; i < count; ++i) {
            int p = w->covered.place[i];
            w->place[i] = w->opaque[p] == r->listed[k] ? w->next[p]++ : -1;
        }
        put(d, w, t, count);
    }
}

static moit_status draw_tile(void *context, int64_t tile, int thread) {
    const drawing *d = context;
    const moit_raster *r = d->raster;
    workspace *w = &d->spaces[thread];
    rectangle bounds = tile_bounds(r, tile);
    find_occluders(d, w, tile, bounds);
    for (int y = bounds.top; y < bounds.bottom; ++y)
        for (int x = bounds.left; x < bounds.right; ++x) {
            int p = (y - bounds.top) * TILE + x - bounds.left;
            int64_t pixel = (int64_t)y * r->width + x;
            w->next[p] = d->counts ? w->opaque[p] >= 0 : r->offsets[pixel];
        }
    if (!d->counts) draw_occluders(d, w, tile, bounds);
    for (int64_t k = r->first[tile]; k < r->first[tile + 1]; ++k) {
        const moit_projected_triangle *t = &r->triangles[r->listed[k]];
        if (hides(r, t)) continue;
        int count = visible(d, w, t, bounds), seen = w->occluded ? 0 : count;
        for (int i = 0; !w->occluded && i < count; ++i)
            w->place[i] = w->next[w->covered.place[i]]++;
        for (int i = 0; w->occluded && i < count; ++i) {
            int p = w->covered.place[i];
            bool hidden = rounded(w->covered.z[i]) > w->occluder[p];
            w->place[i] = hidden ? -1 : w->next[p]++;
            seen += !hidden;
        }
        if (seen && !d->counts) put(d, w, t, count);
    }
    for (int y = bounds.top; d->counts && y < bounds.bottom; ++y)
        for (int x = bounds.left; x < bounds.right; ++x)
            d->counts[(int64_t)y * r->width + x + 1] =
                w->next[(y - bounds.top) * TILE + x - bounds.left];
    return MOIT_OK;
}

static moit_status for_tiles(drawing *d, const moit_run *run) {
    int64_t tiles = (int64_t)d->raster->columns * d->raster->rows;
    int64_t threads = run->threads < tiles ? run->threads : tiles;
    d->stages = moit_stages_of(MOIT_FLOAT64, run->isa);
    d->spaces = malloc((size_t)threads * sizeof *d->spaces);
    if (!d->spaces) return MOIT_NO_MEMORY;
    moit_status status = moit_parallel_for(run, tiles, draw_tile, d);
    free(d->spaces);
    return status;
}

/* ---- The whole ------------------------------------------------------------------------------- */

static moit_status begin(const moit_mesh *mesh, const moit_camera *camera, int width, int height,
                         bool by_area, int64_t *offsets, moit_raster **raster,
                         const moit_run *run) {
    moit_raster *r = calloc(1, sizeof *r);
    *raster = r;
    if (!r) return MOIT_NO_MEMORY;
    *r = (moit_raster){.mesh = mesh,
                       .camera = *camera,
                       .width = width,
                       .height = height,
                       .columns = (width + TILE - 1) / TILE,
                       .rows = (height + TILE - 1) / TILE,
                       .by_area = by_area,
                       .offsets = offsets};
    int64_t pixels = (int64_t)width * height;
    moit_status status = moit_project(r, run);
    if (status == MOIT_OK && offsets)
        status =
            moit_list_by_tile(r->columns, r->rows, r->count, tiles_of, r, &r->first, &r->listed);
    drawing count = {.raster = r, .counts = offsets};
    if (status == MOIT_OK && offsets) status = for_tiles(&count, run);
    if (status != MOIT_OK) {
        moit_end_raster(r);
        *raster = NULL;
        return status;
    }
    if (!offsets) return MOIT_OK;
    moit_offsets_of_counts(offsets, pixels);
    return MOIT_OK;
}

moit_status moit_begin_raster(const moit_mesh *mesh, const moit_camera *camera, int width,
                              int height, int64_t *offsets, moit_raster **raster,
                              const moit_run *run) {
    return begin(mesh, camera, width, height, false, offsets, raster, run);
}

moit_status moit_begin_parts(const moit_mesh *mesh, const moit_camera *camera, int width,
                             int height, int64_t *offsets, moit_raster **raster,
                             const moit_run *run) {
    return begin(mesh, camera, width, height, true, offsets, raster, run);
}

moit_status moit_draw(const moit_raster *raster, const double *reached, float *depth, float *alpha,
                      float *color, const moit_run *run) {
    drawing d = {
        .raster = raster, .depth = depth, .alpha = alpha, .color = color, .reached = reached};
    return for_tiles(&d, run);
}

moit_status moit_draw_parts(const moit_raster *raster, const double *reached, float *depth,
                            float *alpha, float *color, double *share, int32_t *source,
                            const moit_run *run) {
    drawing d = {.raster = raster,
                 .depth = depth,
                 .alpha = alpha,
                 .color = color,
                 .reached = reached,
                 .share = share,
                 .source = source};
    return for_tiles(&d, run);
}

int64_t moit_screen_triangle_count(const moit_raster *raster) { return raster->count; }

typedef struct {
    const moit_raster *raster;
    moit_screen_triangle *out;
    moit_textured_triangle *textured; /* instead of out */
} listing;

enum { LISTED_AT_ONCE = 4096 };

static void list_textured(const moit_raster *r, const moit_projected_triangle *t,
                          moit_textured_triangle *out) {
    const moit_material *m = moit_material_of(r, t->source);
    assert(m);
    moit_sampling sampling;
    load_sampling(r, t, m, &sampling);
    memcpy(out->u, sampling.u, sizeof out->u);
    memcpy(out->v, sampling.v, sizeof out->v);
    out->cutoff = (double)m->cutoff;
    out->first = m->first;
    out->width = m->width;
    out->height = m->height;
    out->filtering = m->filtering;
    out->wrap_u = m->wrap_u;
    out->wrap_v = m->wrap_v;
    out->lit = m->lit;
    out->masked = m->masked;
}

static moit_status list_triangles(void *context, int64_t item, int thread) {
    const listing *l = context;
    const moit_raster *r = l->raster;
    int64_t end = (item + 1) * LISTED_AT_ONCE < r->count ? (item + 1) * LISTED_AT_ONCE : r->count;
    for (int64_t i = item * LISTED_AT_ONCE; i < end; ++i) {
        const moit_projected_triangle *t = &r->triangles[i];
        moit_screen_triangle *o = l->textured ? &l->textured[i].triangle : &l->out[i];
        moit_corners corners;
        load_corners(r, t, &corners);
        memcpy(o->inverse_z, t->inverse_z, sizeof o->inverse_z);
        memcpy(o->color, corners.color, sizeof o->color);
        memcpy(o->alpha, corners.alpha, sizeof o->alpha);
        memcpy(o->normal, corners.normal, sizeof o->normal);
        memcpy(o->x, t->x, sizeof o->x);
        memcpy(o->y, t->y, sizeof o->y);
        o->opaque = t->opaque;
        o->source = (int32_t)t->source;
        if (l->textured) list_textured(r, t, &l->textured[i]);
    }
    (void)thread;
    return MOIT_OK;
}

moit_status moit_screen_triangles(const moit_raster *raster, moit_screen_triangle *out,
                                  const moit_run *run) {
    listing l = {.raster = raster, .out = out};
    int64_t items = (raster->count + LISTED_AT_ONCE - 1) / LISTED_AT_ONCE;
    return moit_parallel_for(run, items, list_triangles, &l);
}

moit_status moit_textured_triangles(const moit_raster *raster, moit_textured_triangle *out,
                                    const moit_run *run) {
    listing l = {.raster = raster, .textured = out};
    int64_t items = (raster->count + LISTED_AT_ONCE - 1) / LISTED_AT_ONCE;
    return moit_parallel_for(run, items, list_triangles, &l);
}

void moit_end_raster(moit_raster *raster) {
    if (!raster) return;
    free(raster->triangles);
    free(raster->weights);
    free(raster->first);
    free(raster->listed);
    free(raster);
}
