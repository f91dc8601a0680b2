/* From fragments of splats back to splats as the screen has them. */
#include "core/splats.h"
#include "core/threads.h"
#include "moit_gradients.h"

#include <stdlib.h>

enum { MOST_PLACES = 1 << 19 }; /* whose sums are held at once, but for one row of tiles */

typedef struct {
    const float *depth, *alpha, *color;
    moit_splat_sums *places; /* sums of each place in the raster's lists, from `first` */
    int64_t first;
} pulling;

/* alpha = min(opacity exp(-q / 2), .99), q = square / over, and depth the same over the same. */
static void pull_fragment(void *context, int64_t listed, const moit_screen_splat *s, int x, int y,
                          float alpha, int64_t at) {
    const pulling *p = context;
    moit_splat_sums *sums = &p->places[listed - p->first];
    const float *q = s->square, *a = s->along, *z = s->depth;
    double dx = x - s->x, dy = y - s->y, powers[6] = {1.0, dx, dy, dx * dx, dx * dy, dy * dy};
    double square = 0.0, over = 0.0, depth = 0.0, by_depth = (double)p->depth[at],
           by_alpha = alpha < (float)MOIT_MOST_SPLAT_ALPHA ? (double)p->alpha[at] : 0.0;
    for (int k = 0; k < 3; ++k) square += powers[3 + k] * (double)q[k];
    for (int k = 0; k < 6; ++k) over += powers[k] * (double)a[k];
    for (int k = 0; k < 3; ++k) depth += powers[k] * (double)z[k];
    double by_q = square > 0.0 ? -0.5 * (double)alpha * by_alpha / over : 0.0,
           by_z = by_depth / over, by_over = -(by_q * square + by_z * depth) / over;
    sums->opacity += by_alpha * (double)alpha / (double)s->opacity;
    for (int k = 0; k < 3; ++k) {
        sums->square[k] += by_q * powers[3 + k];
        sums->depth[k] += by_z * powers[k];
        sums->color[k] += (double)p->color[3 * at + k];
    }
    for (int k = 1; k < 6; ++k) sums->along[k] += by_over * powers[k];
    sums->x -= by_q * (2.0 * (double)q[0] * dx + (double)q[1] * dy) + by_z * (double)z[1]
               + by_over * ((double)a[1] + 2.0 * (double)a[3] * dx + (double)a[4] * dy);
    sums->y -= by_q * ((double)q[1] * dx + 2.0 * (double)q[2] * dy) + by_z * (double)z[2]
               + by_over * ((double)a[2] + (double)a[4] * dx + 2.0 * (double)a[5] * dy);
}

static void add(moit_splat_sums *to, const moit_splat_sums *from) {
    double *out = &to->x;
    const double *in = &from->x;
    for (size_t k = 0; k < sizeof *to / sizeof *out; ++k) out[k] += in[k];
}

/* The first row of tiles after `row` before which there are too many places, or `end`. */
static int rows_at_once(const moit_splat_raster *r, int row, int end) {
    int next = row + 1;
    while (next < end
           && r->first[(int64_t)(next + 1) * r->columns] - r->first[(int64_t)row * r->columns]
                  <= MOST_PLACES)
        ++next;
    return next;
}

moit_status moit_pull_splat_fragments(const moit_splat_raster *r, int top, int bottom,
                                      const float *depth, const float *alpha, const float *color,
                                      moit_splat_sums *sums, const moit_run *run) {
    int last = (bottom + MOIT_SPLAT_TILE - 1) / MOIT_SPLAT_TILE;
    int64_t start = r->offsets[(int64_t)top * r->width];
    for (int row = top / MOIT_SPLAT_TILE, next; row < last; row = next) {
        next = rows_at_once(r, row, last);
        int from = row * MOIT_SPLAT_TILE, to = next * MOIT_SPLAT_TILE;
        from = from < top ? top : from;
        to = to > bottom ? bottom : to;
        int64_t before = r->offsets[(int64_t)from * r->width] - start,
                first = r->first[(int64_t)row * r->columns],
                count = r->first[(int64_t)next * r->columns] - first;
        pulling p = {depth + before, alpha + before, color + 3 * before,
                     calloc((size_t)count + 1, sizeof *p.places), first};
        if (!p.places) return MOIT_NO_MEMORY;
        moit_status status = moit_visit_splats(r, from, to, pull_fragment, &p, run);
        /* by one thread, in the order of tiles: each sum has one order */
        for (int64_t k = 0; k < count && status == MOIT_OK; ++k)
            add(&sums[r->listed[first + k]], &p.places[k]);
        free(p.places);
        if (status != MOIT_OK) return status;
    }
    return MOIT_OK;
}
