/* Volumes on regular grids, marched along rays cell by cell. */
#include "core/elementary.h"
#include "core/offsets.h"
#include "core/threads.h"
#include "moit_geometry.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { NUMBERS = 6 };

/* What a row of pixels has found. */
typedef struct {
    float *numbers;
    int64_t count, room;
} found;

typedef struct {
    const moit_grid *grid;
    const moit_camera *camera;
    double step;
    int width, height, top; /* the first row that is wanted */
    int64_t *offsets;
    found *rows;
} marching;

/* Light and absorbance of a unit of length. */
typedef struct {
    double color[3], absorbance;
} medium;

/* A ray from the eye, by depth: at depth z it is in cells of the grid at start + z along. */
typedef struct {
    double start[3], along[3], length; /* of the ray in the scene, from depth 0 to 1 */
} ray;

/* ---- The medium ------------------------------------------------------------------------------ */

static medium of_row(const float *row) {
    return (medium){{(double)row[0], (double)row[1], (double)row[2]}, (double)row[3]};
}

static medium between(medium a, medium b, double t) {
    medium o = {.absorbance = a.absorbance + t * (b.absorbance - a.absorbance)};
    for (int k = 0; k < 3; ++k) o.color[k] = a.color[k] + t * (b.color[k] - a.color[k]);
    return o;
}

static medium of_number(const moit_grid *g, double value) {
    double place = (value - g->low) / (g->high - g->low) * (g->rows - 1);
    if (!(place > 0.0)) return of_row(g->table);
    if (place >= g->rows - 1) return of_row(g->table + 4 * (g->rows - 1));
    int row = (int)place;
    return between(of_row(g->table + 4 * row), of_row(g->table + 4 * (row + 1)), place - row);
}

/* A channel of the grid at a place of a cell, which is from 0 to 1 along each axis. */
static double value_in(const moit_grid *g, const int cell[3], const double at[3], int channel) {
    double sum = 0.0;
    for (int corner = 0; corner < 8; ++corner) {
        double weight = 1.0;
        int64_t index = 0;
        for (int k = 0; k < 3; ++k) {
            int far = corner >> k & 1;
            weight *= far ? at[k] : 1.0 - at[k];
            index = index * g->size[k] + cell[k] + far;
        }
        sum += weight * (double)g->values[index * g->channels + channel];
    }
    return sum;
}

static medium medium_at(const moit_grid *g, const ray *r, const int cell[3], double z) {
    double at[3];
    for (int k = 0; k < 3; ++k) {
        double place = r->start[k] + z * r->along[k] - cell[k];
        at[k] = fmin(fmax(place, 0.0), 1.0);
    }
    if (g->channels == 1) return of_number(g, value_in(g, cell, at, 0));
    float row[4];
    for (int c = 0; c < 4; ++c) row[c] = (float)value_in(g, cell, at, c);
    return of_row(row);
}

/* ---- Rays ------------------------------------------------------------------------------------ */

static ray ray_of(const marching *m, int x, int y) {
    const moit_camera *c = m->camera;
    double right = (2.0 * (x + 0.5) / m->width - 1.0) / c->scale[0],
           up = (1.0 - 2.0 * (y + 0.5) / m->height) / c->scale[1];
    ray r = {.length = sqrt(right * right + up * up + 1.0)};
    for (int k = 0; k < 3; ++k) {
        double along = right * c->right[k] + up * c->up[k] + c->forward[k];
        r.start[k] = (c->eye[k] - m->grid->origin[k]) / m->grid->spacing[k];
        r.along[k] = along / m->grid->spacing[k];
    }
    return r;
}

/* Between which depths it is in the grid. */
static bool inside_of(const marching *m, const ray *r, double *near, double *far) {
    *near = m->camera->near;
    *far = m->camera->far;
    for (int k = 0; k < 3; ++k) {
        double last = m->grid->size[k] - 1;
        if (r->along[k] == 0.0) {
            if (!(r->start[k] >= 0.0 && r->start[k] <= last)) return false;
            continue;
        }
        double a = -r->start[k] / r->along[k], b = (last - r->start[k]) / r->along[k];
        *near = fmax(*near, fmin(a, b));
        *far = fmin(*far, fmax(a, b));
    }
    return *near < *far;
}

/* Where the next plane of grid points is, behind depth z; at least a little farther. */
static double next_plane(const ray *r, double z, double far) {
    double nearest = far;
    for (int k = 0; k < 3; ++k) {
        if (r->along[k] == 0.0) continue;
        double place = r->start[k] + z * r->along[k];
        double plane = r->along[k] > 0.0 ? floor(place) + 1.0 : ceil(place) - 1.0;
        double at = (plane - r->start[k]) / r->along[k];
        /* rounding may find the plane that z lies on */
        if (!(at > z * (1.0 + 1e-12)))
            at = (plane + (r->along[k] > 0.0 ? 1.0 : -1.0) - r->start[k]) / r->along[k];
        if (at < nearest) nearest = at;
    }
    return nearest;
}

/* A fragment that is being made: from front to back, what it absorbs, and what light is seen. */
typedef struct {
    double front, back, absorbance, color[3];
} slab;

static bool finish(found *row, const slab *s) {
    double alpha = -moit_expm1(-s->absorbance);
    if (!((float)alpha > 0.0f)) return true;
    if (row->count == row->room) {
        int64_t room = 2 * row->room + 64;
        float *larger = realloc(row->numbers, (size_t)room * NUMBERS * sizeof *larger);
        if (!larger) return false;
        row->numbers = larger;
        row->room = room;
    }
    float *to = row->numbers + NUMBERS * row->count++;
    to[0] = (float)s->front;
    to[1] = (float)s->back;
    to[2] = (float)alpha;
    for (int k = 0; k < 3; ++k) to[3 + k] = (float)(s->color[k] / alpha);
    return true;
}

/* Of what absorbs a lot in one cell the colour is found in halves, so many times at most: three
   places are enough for half a neper. */
enum { HALVINGS = 4 };
static const double MOST_AT_ONCE = 0.5, UNSEEN = 14.0; /* nepers: a millionth is seen behind */

static void add(const marching *m, const ray *r, double from, double to, int halvings, slab *s) {
    double middle = from + 0.5 * (to - from);
    int cell[3];
    for (int k = 0; k < 3; ++k) {
        double place = r->start[k] + middle * r->along[k], last = m->grid->size[k] - 2;
        cell[k] = place > 0.0 ? (place < last ? (int)place : (int)last) : 0;
    }
    const double depth[3] = {from, middle, to}, weight[3] = {1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0};
    medium here[3];
    double mean = 0.0;
    for (int i = 0; i < 3; ++i) {
        here[i] = medium_at(m->grid, r, cell, depth[i]);
        mean += weight[i] * here[i].absorbance;
    }
    if (!(mean > 0.0)) return;
    double length = (to - from) * r->length, absorbance = mean * length;
    if (absorbance > MOST_AT_ONCE && s->absorbance < UNSEEN && halvings > 0 && from < middle
        && middle < to) {
        add(m, r, from, middle, halvings - 1, s);
        add(m, r, middle, to, halvings - 1, s);
        return;
    }
    /* what is in front within the piece: to the middle, of the parabola through all three */
    double half =
        length / 24.0 * (5.0 * here[0].absorbance + 8.0 * here[1].absorbance - here[2].absorbance);
    const double away[4] = {-fmin(fmax(half, 0.0), absorbance), -absorbance, -s->absorbance, 0.0};
    double share[3], all = 0.0, through[4];
    moit_exps(4, away, through);
    double seen = through[2] * -moit_expm1(-absorbance);
    for (int i = 0; i < 3; ++i)
        all += share[i] = weight[i] * here[i].absorbance * (i ? through[i - 1] : 1.0);
    if (s->absorbance == 0.0) s->front = from;
    s->back = to;
    s->absorbance += absorbance;
    for (int k = 0; k < 3; ++k) {
        double light = 0.0;
        for (int i = 0; i < 3; ++i) light += share[i] * here[i].color[k];
        if (all > 0.0) s->color[k] += seen * light / all;
    }
}

static bool march(const marching *m, int x, int y, found *row) {
    ray r = ray_of(m, x, y);
    double z, far;
    if (!inside_of(m, &r, &z, &far)) return true;
    slab s = {0};
    /* counted, since z / step of a multiple may be rounded to less than its number */
    double number = floor(z / m->step) + 1.0;
    if (!(number * m->step > z)) number += 1.0;
    double end = number * m->step;
    if (!(end > z)) end = far; /* depths are too great for steps to be apart */
    while (z < far) {
        double to = fmin(next_plane(&r, z, far), end);
        if (!(to > z)) to = nextafter(z, far); /* depths are too great for cells to be apart */
        add(m, &r, z, to, HALVINGS, &s);
        z = to;
        if (z < end && z < far) continue;
        if (!finish(row, &s)) return false;
        s = (slab){0};
        number += 1.0;
        end = number * m->step;
        if (!(end > z)) end = far;
    }
    return true;
}

static moit_status march_row(void *context, int64_t item, int thread) {
    const marching *m = context;
    found *row = &m->rows[item];
    for (int x = 0; x < m->width; ++x) {
        int64_t before = row->count;
        if (!march(m, x, m->top + (int)item, row)) return MOIT_NO_MEMORY;
        m->offsets[item * m->width + x + 1] = row->count - before;
    }
    (void)thread;
    return MOIT_OK;
}

moit_status moit_march_grid(const moit_grid *grid, const moit_camera *camera, double step,
                            int width, int height, int top, int bottom, int64_t *offsets,
                            float **numbers, const moit_run *run) {
    int rows = bottom - top;
    marching m = {grid,   camera, step,    width,
                  height, top,    offsets, calloc((size_t)rows + 1, sizeof *m.rows)};
    *numbers = NULL;
    moit_status status = m.rows ? moit_parallel_for(run, rows, march_row, &m) : MOIT_NO_MEMORY;
    if (status == MOIT_OK) {
        int64_t pixels = (int64_t)width * rows, at = 0;
        moit_offsets_of_counts(offsets, pixels);
        *numbers = malloc(((size_t)offsets[pixels] + 1) * NUMBERS * sizeof **numbers);
        if (!*numbers) status = MOIT_NO_MEMORY;
        for (int y = 0; y < rows && *numbers; ++y) {
            const found *row = &m.rows[y];
            if (row->count)
                memcpy(*numbers + NUMBERS * at, row->numbers,
                       (size_t)row->count * NUMBERS * sizeof **numbers);
            at += row->count;
        }
    }
    for (int y = 0; y < rows && m.rows; ++y) free(m.rows[y].numbers);
    free(m.rows);
    return status;
}
