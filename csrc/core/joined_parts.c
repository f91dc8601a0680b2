/* Parts of pixels that triangles cover, joined to surfaces: what neighbours cover of a pixel adds
 * up, so that no edge between two triangles is seen. */
#include "moit_geometry.h"

#include <stdlib.h>
#include <string.h>

/* Shares that add up to as much cover all of a pixel. */
static const double WHOLE = 1.0 - 1e-7;

/* ---- Corners by position --------------------------------------------------------------------- */

typedef struct {
    float at[3];
    int32_t vertex;
} corner;

static int by_place(const void *a, const void *b) {
    const corner *p = a, *q = b;
    for (int k = 0; k < 3; ++k)
        if (p->at[k] != q->at[k]) return p->at[k] < q->at[k] ? -1 : 1;
    return p->vertex < q->vertex ? -1 : p->vertex > q->vertex;
}

/* Of each vertex the first that is where it is; NULL: no memory. */
static int32_t *first_there(const moit_mesh *m) {
    int32_t *first = malloc((size_t)(m->vertices + 1) * sizeof *first);
    corner *corners = malloc((size_t)(m->vertices + 1) * sizeof *corners);
    if (first && corners) {
        for (int64_t v = 0; v < m->vertices; ++v) {
            corners[v].vertex = (int32_t)v;
            memcpy(corners[v].at, m->position + 3 * v, sizeof corners[v].at);
        }
        qsort(corners, (size_t)m->vertices, sizeof *corners, by_place);
        for (int64_t v = 0; v < m->vertices; ++v) {
            bool same = v > 0;
            for (int k = 0; k < 3 && same; ++k) same = corners[v].at[k] == corners[v - 1].at[k];
            first[corners[v].vertex] = same ? first[corners[v - 1].vertex] : corners[v].vertex;
        }
    } else {
        free(first);
        first = NULL;
    }
    free(corners);
    return first;
}

/* ---- Surfaces of a pixel --------------------------------------------------------------------- */

/* What two parts that have the same of are one surface by. */
typedef struct {
    int32_t a, b, turn, part;
} link;

static int by_key(const void *a, const void *b) {
    const link *p = a, *q = b;
    if (p->a != q->a) return p->a < q->a ? -1 : 1;
    if (p->b != q->b) return p->b < q->b ? -1 : 1;
    if (p->turn != q->turn) return p->turn < q->turn ? -1 : 1;
    return p->part < q->part ? -1 : p->part > q->part;
}

static int32_t top_of(int32_t *above, int32_t part) {
    while (above[part] != part) part = above[part] = above[above[part]];
    return part;
}

/* The surface is named by its first part. */
static void unite(int32_t *above, int32_t a, int32_t b) {
    a = top_of(above, a);
    b = top_of(above, b);
    if (a < b) above[b] = a;
    else above[a] = b;
}

/* Sums over the parts of a surface, of each number times the share. */
typedef struct {
    double share, depth, alpha, color[3], painted[3]; /* painted: color times alpha */
} surface;

typedef struct {
    link *links;
    int32_t *above;    /* (parts) */
    surface *surfaces; /* by their first parts */
    int64_t room;
} workspace;

static void let_go(workspace *w) {
    free(w->links);
    free(w->above);
    free(w->surfaces);
}

static bool has_room(workspace *w, int64_t parts) {
    if (parts <= w->room) return true;
    let_go(w);
    w->room = 2 * parts;
    w->links = malloc(3 * (size_t)w->room * sizeof *w->links);
    w->above = malloc((size_t)w->room * sizeof *w->above);
    w->surfaces = malloc((size_t)w->room * sizeof *w->surfaces);
    return w->links && w->above && w->surfaces;
}

static int64_t triangle_of(int32_t source) { return source < 0 ? -1 - (int64_t)source : source; }

/* Parts that share a corner and turn the same way; then those on two sides of an edge: one goes
 * along it and the other back, as the screen sees them. */
static void find_surfaces(const moit_mesh *m, const int32_t *first, const int32_t *source,
                          int32_t parts, workspace *w) {
    int32_t *above = w->above;
    for (int32_t i = 0; i < parts; ++i) above[i] = i;
    for (int edges = 0; edges < 2; ++edges) {
        for (int32_t i = 0; i < parts; ++i) {
            const int32_t *corners = m->corners + 3 * triangle_of(source[i]);
            for (int k = 0; k < 3; ++k) {
                int32_t a = first[corners[k]], b = first[corners[(k + 1) % 3]];
                w->links[3 * i + k] =
                    !edges ? (link){a, 0, source[i] < 0, i}
                           : (link){a < b ? a : b, a < b ? b : a, (a < b) != (source[i] < 0), i};
            }
        }
        qsort(w->links, 3 * (size_t)parts, sizeof *w->links, by_key);
        for (int32_t k = 1; k < 3 * parts; ++k) {
            const link *p = &w->links[k - 1], *q = &w->links[k];
            if (p->a == q->a && p->b == q->b && (p->turn == q->turn) != (edges == 1))
                unite(above, p->part, q->part);
        }
    }
}

/* ---- Fragments ------------------------------------------------------------------------------- */

/* Where more is covered than there is of the pixel, parts lie on one another: of n that cover all
 * of it (1 - alpha)^n is let through, and between whole n something between. */
static double alpha_of(const surface *s) {
    double alpha = s->alpha / s->share, through = 1.0, left = s->share;
    if (s->share < WHOLE) return s->alpha;
    if (s->share <= 2.0 - WHOLE || alpha >= 1.0) return alpha < 1.0 ? alpha : 1.0;
    for (; left >= WHOLE; left -= 1.0) through *= 1.0 - alpha;
    return 1.0 - through * (1.0 - (left > 0.0 ? left : 0.0) * alpha);
}

typedef struct {
    float depth, alpha, color[3];
} fragment;

static fragment fragment_of(const surface *s) {
    fragment o = {.depth = (float)(s->depth / s->share), .alpha = (float)alpha_of(s)};
    for (int k = 0; k < 3; ++k)
        o.color[k] = (float)(s->alpha > 0.0 ? s->painted[k] / s->alpha : s->color[k] / s->share);
    return o;
}

moit_status moit_join_parts(const moit_mesh *m, int64_t pixels, int64_t *offsets,
                            const double *share, const int32_t *source, float *depth, float *alpha,
                            float *color, int64_t *which) {
    int32_t *first = first_there(m);
    if (!first) return MOIT_NO_MEMORY;
    workspace w = {.room = 0};
    moit_status status = MOIT_OK;
    int64_t written = 0, begin = offsets[0];
    for (int64_t p = 0; p < pixels && status == MOIT_OK; ++p) {
        int64_t end = offsets[p + 1];
        int32_t parts = (int32_t)(end - begin), nearest = -1;
        if (!has_room(&w, parts)) status = MOIT_NO_MEMORY;
        if (status != MOIT_OK) break;
        if (parts) find_surfaces(m, first, source + begin, parts, &w);
        for (int32_t i = 0; i < parts; ++i) {
            int32_t to = top_of(w.above, i);
            surface *s = &w.surfaces[to];
            int64_t at = begin + i;
            if (to == i) *s = (surface){.share = 0.0};
            s->share += share[at];
            s->depth += share[at] * (double)depth[at];
            s->alpha += share[at] * (double)alpha[at];
            for (int k = 0; k < 3; ++k) {
                s->color[k] += share[at] * (double)color[3 * at + k];
                s->painted[k] += share[at] * (double)alpha[at] * (double)color[3 * at + k];
            }
        }
        for (int32_t i = 0; i < parts; ++i) {
            if (w.above[i] != i) continue;
            fragment f = fragment_of(&w.surfaces[i]);
            bool hides = f.alpha == 1.0f
                         && (nearest < 0 || f.depth < fragment_of(&w.surfaces[nearest]).depth);
            if (hides) nearest = i;
        }
        /* the nearest opaque one, then the others that it does not hide */
        float limit = nearest < 0 ? 0.0f : fragment_of(&w.surfaces[nearest]).depth;
        for (int64_t i = begin; i < end; ++i) which[i] = -1;
        for (int32_t turn = nearest < 0; turn < 2; ++turn)
            for (int32_t i = 0; i < parts; ++i) {
                if (w.above[i] != i || (turn == 0) != (i == nearest)) continue;
                fragment f = fragment_of(&w.surfaces[i]);
                if (turn && nearest >= 0 && (f.alpha == 1.0f || f.depth > limit)) continue;
                which[begin + i] = written;
                depth[written] = f.depth;
                alpha[written] = f.alpha;
                memcpy(color + 3 * written, f.color, sizeof f.color);
                ++written;
            }
        for (int32_t i = 0; i < parts; ++i) which[begin + i] = which[begin + top_of(w.above, i)];
        begin = end;
        offsets[p + 1] = written;
    }
    let_go(&w);
    free(first);
    return status;
}
