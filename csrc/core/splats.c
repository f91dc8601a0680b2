/* Splats to fragments: all to the screen, then to tiles, the tiles on several threads. Each tile
 * lists its splats in their order, so no result depends on the number of threads. */
#include "core/splats.h"
#include "core/stages/stages.h"
#include "core/threads.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct moit_splat_raster {
    const moit_splats *splats;
    moit_splatting splatting;
    moit_camera camera;
    int width, height, top, bottom; /* pixels */
    int columns, rows, first_row;   /* tiles; those of rows [first_row, first_row + rows) */
    moit_screen_splat *on_screen;   /* (count) */
    int64_t *first;                 /* (tiles + 1) */
    int32_t *listed;                /* splats of each tile, in order */
    int64_t most_listed;            /* of a tile */
    int64_t *offsets;
};

enum { TILE = MOIT_SPLAT_TILE, TILE_PIXELS = MOIT_SPLAT_PIXELS };

/* ---- To the screen --------------------------------------------------------------------------- */

/* Numbers of the reference rasteriser: what is nearer is not drawn; what middles are limited to, in
 * halves of the picture, where the projection is taken to be linear; what is added to variances, in
 * pixels squared; and what fragments behind a pixel's last one would have been seen through. */
static const double NEAREST = 0.2, LIMIT = 1.3, DILATION = 0.3;
static const float LEAST_SEEN = 1e-4f;

/* Along rays a disc has some thickness: what makes it a sphere has to be a number. */
static const double THINNEST = 1e-4;

static double dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static int harmonics_of(int degree) { return (degree + 1) * (degree + 1); }

/* Real spherical harmonics, up to degree 3, in the order and with the signs of the reference. */
static int harmonics_at(int degree, const double d[3], double value[16]) {
    double x = d[0], y = d[1], z = d[2], xx = x * x, yy = y * y, zz = z * z;
    value[0] = 0.28209479177387814;
    if (degree > 0) {
        const double c = 0.4886025119029199;
        value[1] = -c * y;
        value[2] = c * z;
        value[3] = -c * x;
    }
    if (degree > 1) {
        value[4] = 1.0925484305920792 * x * y;
        value[5] = -1.0925484305920792 * y * z;
        value[6] = 0.31539156525252005 * (2.0 * zz - xx - yy);
        value[7] = -1.0925484305920792 * x * z;
        value[8] = 0.5462742152960396 * (xx - yy);
    }
    if (degree > 2) {
        value[9] = -0.5900435899266435 * y * (3.0 * xx - yy);
        value[10] = 2.890611442640554 * x * y * z;
        value[11] = -0.4570457994644658 * y * (4.0 * zz - xx - yy);
        value[12] = 0.3731763325901154 * z * (2.0 * zz - 3.0 * xx - 3.0 * yy);
        value[13] = -0.4570457994644658 * x * (4.0 * zz - xx - yy);
        value[14] = 1.445305721320277 * z * (xx - yy);
        value[15] = -0.5900435899266435 * x * (xx - 3.0 * yy);
    }
    return harmonics_of(degree);
}

/* The colour that is seen from the eye, not below 0. */
static void color_of(const moit_splats *s, int64_t i, const double away[3], float color[3]) {
    double length = sqrt(dot(away, away)), value[16], direction[3] = {0.0, 0.0, 0.0};
    for (int k = 0; k < 3 && length > 0.0; ++k) direction[k] = away[k] / length;
    int count = harmonics_at(s->degree, direction, value);
    const float *own = s->harmonics + 3 * i * count;
    for (int c = 0; c < 3; ++c) {
        double sum = 0.5;
        for (int k = 0; k < count; ++k) sum += value[k] * (double)own[3 * k + c];
        color[c] = (float)(sum > 0.0 ? sum : 0.0);
    }
}

/* Its axes as the eye sees them (right, up, away), each as long as the deviation along it, and at
 * least `thinnest` of the longest. */
static void axes_of(const moit_splat_raster *r, int64_t i, double thinnest, double axis[3][3]) {
    const float *q = r->splats->rotation + 4 * i;
    double w = (double)q[0], x = (double)q[1], y = (double)q[2], z = (double)q[3];
    const double column[3][3] = {
        {1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)},
        {2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x)},
        {2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)}};
    double longest = 0.0;
    for (int k = 0; k < 3; ++k) longest = fmax(longest, (double)r->splats->scale[3 * i + k]);
    for (int k = 0; k < 3; ++k) {
        double scale = fmax((double)r->splats->scale[3 * i + k], thinnest * longest);
        axis[k][0] = scale * dot(r->camera.right, column[k]);
        axis[k][1] = scale * dot(r->camera.up, column[k]);
        axis[k][2] = scale * dot(r->camera.forward, column[k]);
    }
}

/* The tiles of [low, high) of so many, from ends in tiles that may be anything. */
static void tiles_between(double low, double high, int count, int32_t *first, int32_t *end) {
    /* what is not a number is compared with nothing, and is then no tile at all */
    *first = low >= 0.0 ? (low < count ? (int32_t)low : count) : 0;
    *end = high < count ? (high > 0.0 ? (int32_t)high : 0) : count;
    if (!(low == low && high == high)) *first = *end = 0;
}

/* As an ellipse: its covariance by the projection's derivative in its middle. */
static bool project_flat(const moit_splat_raster *r, const double at[3], double axis[3][3],
                         moit_screen_splat *out) {
    double z = at[2], pixels[2], limited[2], covariance[2][2] = {{0.0}};
    for (int k = 0; k < 2; ++k) {
        double limit = LIMIT / r->camera.scale[k], slope = at[k] / z;
        pixels[k] = r->camera.scale[k] * (k ? r->height : r->width) / 2.0;
        limited[k] = slope < -limit ? -limit : slope > limit ? limit : slope;
    }
    for (int k = 0; k < 3; ++k) {
        double on[2];
        for (int c = 0; c < 2; ++c)
            on[c] = (c ? -1.0 : 1.0) * pixels[c] / z * (axis[k][c] - limited[c] * axis[k][2]);
        for (int c = 0; c < 2; ++c)
            for (int d = 0; d < 2; ++d) covariance[c][d] += on[c] * on[d];
    }
    double a = covariance[0][0] + DILATION, b = covariance[0][1], c = covariance[1][1] + DILATION;
    double determinant = a * c - b * b, middle = 0.5 * (a + c),
           apart = middle * middle - determinant;
    if (!(determinant > 0.0)) return false;
    double radius = ceil(3.0 * sqrt(middle + sqrt(apart > 0.1 ? apart : 0.1)));
    out->square[0] = (float)(c / determinant);
    out->square[1] = (float)(-2.0 * b / determinant);
    out->square[2] = (float)(a / determinant);
    out->along[0] = 1.0f;
    out->depth[0] = (float)z;
    out->flat = true;
    tiles_between(floor((out->x - radius) / TILE), floor((out->x + radius + TILE - 1) / TILE),
                  r->columns, &out->left, &out->right);
    tiles_between(floor((out->y - radius) / TILE), floor((out->y + radius + TILE - 1) / TILE),
                  (r->height + TILE - 1) / TILE, &out->top, &out->bottom);
    return true;
}

static void cross(const double a[3], const double b[3], double out[3]) {
    for (int k = 0; k < 3; ++k)
        out[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
}

/* From where to where it is seen, as slopes along one axis of the screen: where lines of the
 * picture touch the ellipsoid of so many deviations (squared); all where the eye's plane does. */
static void touched(double at, double z, double variance, double mixed, double along, double reach,
                    double *low, double *high) {
    double c = reach * along - z * z, b = reach * mixed - at * z, a = reach * variance - at * at;
    *low = -INFINITY;
    *high = INFINITY;
    if (!(c < 0.0)) return;
    double root = b * b - a * c;
    root = root > 0.0 ? sqrt(root) : 0.0;
    *low = (b + root) / c;
    *high = (b - root) / c;
}

/* By rays: with A what makes the ellipsoid a sphere, a ray of direction d = m / z + e comes nearest
 * to its middle m at the distance |A m x A d| / |A d| = |A m x A e| / |A d|: nothing cancels. */
static bool project_along_rays(const moit_splat_raster *r, const double at[3], double axis[3][3],
                               moit_screen_splat *out) {
    double size[3], sphere[3][3], u[3], d[3], step[2][3], turned[2][3], z = at[2];
    for (int k = 0; k < 3; ++k) {
        size[k] = dot(axis[k], axis[k]);
        if (!(size[k] > 0.0)) return false;
        for (int c = 0; c < 3; ++c) sphere[k][c] = axis[k][c] / size[k];
        u[k] = dot(sphere[k], at);
        d[k] = u[k] / z;
    }
    for (int c = 0; c < 2; ++c) {
        double pixel = 2.0 / (r->camera.scale[c] * (c ? -r->height : r->width));
        for (int k = 0; k < 3; ++k) step[c][k] = sphere[k][c] * pixel;
        cross(u, step[c], turned[c]);
    }
    double over = dot(d, d);
    if (!(over > 0.0 && isfinite(over))) return false;
    double scaled = 1.0 / over; /* so that what the rays of its middle have is 1 */
    for (int c = 0; c < 2; ++c) {
        out->square[2 * c] = (float)(dot(turned[c], turned[c]) * scaled);
        out->along[1 + c] = (float)(2.0 * dot(d, step[c]) * scaled);
        out->along[3 + 2 * c] = (float)(dot(step[c], step[c]) * scaled);
        out->depth[1 + c] = (float)(dot(u, step[c]) * scaled);
    }
    out->square[1] = (float)(2.0 * dot(turned[0], turned[1]) * scaled);
    out->along[0] = 1.0f;
    out->along[4] = (float)(2.0 * dot(step[0], step[1]) * scaled);
    out->depth[0] = (float)z;
    double reach = 2.0 * log(255.0 * (double)out->opacity), low, high;
    if (!(reach > 0.0)) return false;
    double variance[3] = {0.0}, mixed[2] = {0.0};
    for (int k = 0; k < 3; ++k)
        for (int c = 0; c < 3; ++c) {
            variance[c] += axis[k][c] * axis[k][c];
            if (c < 2) mixed[c] += axis[k][c] * axis[k][2];
        }
    for (int c = 0; c < 2; ++c) {
        double half = (c ? r->height : r->width) / 2.0, pixels = r->camera.scale[c] * half;
        touched(at[c], z, variance[c], mixed[c], variance[2], reach, &low, &high);
        double from = half - 0.5 + pixels * (c ? -high : low),
               to = half - 0.5 + pixels * (c ? -low : high);
        tiles_between(floor(from / TILE), floor(to / TILE) + 1.0,
                      c ? (r->height + TILE - 1) / TILE : r->columns, c ? &out->top : &out->left,
                      c ? &out->bottom : &out->right);
    }
    return true;
}

static void project(const moit_splat_raster *r, int64_t i, moit_screen_splat *out) {
    const moit_splats *s = r->splats;
    double away[3], at[3], axis[3][3];
    *out = (moit_screen_splat){.opacity = s->opacity[i], .nearest = (float)r->camera.near};
    for (int k = 0; k < 3; ++k) away[k] = (double)s->mean[3 * i + k] - r->camera.eye[k];
    at[0] = dot(r->camera.right, away);
    at[1] = dot(r->camera.up, away);
    at[2] = dot(r->camera.forward, away);
    bool near = at[2] < r->camera.near || (r->splatting == MOIT_PROJECTED && at[2] <= NEAREST);
    if (near || !(at[2] <= r->camera.far) || !(out->opacity >= 1.0f / 255.0f)) return;
    axes_of(r, i, r->splatting == MOIT_PROJECTED ? 0.0 : THINNEST, axis);
    out->z = (float)at[2];
    out->x = ((r->camera.scale[0] * at[0] / at[2] + 1.0) * r->width - 1.0) / 2.0;
    out->y = ((1.0 - r->camera.scale[1] * at[1] / at[2]) * r->height - 1.0) / 2.0;
    bool seen = r->splatting == MOIT_PROJECTED ? project_flat(r, at, axis, out)
                                               : project_along_rays(r, at, axis, out);
    int last = r->first_row + r->rows;
    if (out->top < r->first_row) out->top = r->first_row;
    if (out->bottom > last) out->bottom = last;
    if (!seen || out->top >= out->bottom) out->left = out->right = 0;
    if (out->left < out->right) color_of(s, i, away, out->color);
}

enum { PROJECTED_AT_ONCE = 4096 };

static moit_status project_some(void *context, int64_t item, int thread) {
    const moit_splat_raster *r = context;
    int64_t end = (item + 1) * PROJECTED_AT_ONCE;
    if (end > r->splats->count) end = r->splats->count;
    for (int64_t i = item * PROJECTED_AT_ONCE; i < end; ++i) project(r, i, &r->on_screen[i]);
    (void)thread;
    return MOIT_OK;
}

/* ---- To tiles -------------------------------------------------------------------------------- */

/* Counts the splats of each tile in first[tile + 1], or lists them from first[tile] on. */
static void visit_tiles(moit_splat_raster *r, int32_t *listed) {
    for (int64_t i = 0; i < r->splats->count; ++i) {
        const moit_screen_splat *s = &r->on_screen[i];
        if (s->left >= s->right) continue;
        for (int y = s->top; y < s->bottom; ++y)
            for (int x = s->left; x < s->right; ++x) {
                int64_t *next = &r->first[(int64_t)(y - r->first_row) * r->columns + x + 1];
                if (listed) listed[*next] = (int32_t)i;
                ++*next;
            }
    }
}

static moit_status list_by_tile(moit_splat_raster *r) {
    int64_t tiles = (int64_t)r->columns * r->rows;
    r->first = calloc((size_t)tiles + 2, sizeof *r->first);
    if (!r->first) return MOIT_NO_MEMORY;
    visit_tiles(r, NULL);
    for (int64_t t = 0; t < tiles; ++t) {
        if (r->first[t + 1] > r->most_listed) r->most_listed = r->first[t + 1];
        r->first[t + 1] += r->first[t];
    }
    r->listed = malloc((size_t)(r->first[tiles] + 1) * sizeof *r->listed);
    if (!r->listed) return MOIT_NO_MEMORY;
    /* listing moves each tile's start to its end, which is where the next one starts */
    memmove(r->first + 1, r->first, (size_t)tiles * sizeof *r->first);
    r->first[0] = 0;
    visit_tiles(r, r->listed);
    return MOIT_OK;
}

/* ---- Tiles ----------------------------------------------------------------------------------- */

/* Of a thread: for each splat of the tile its distance, its rank by it, and which pixels it is kept
 * in, a bit each. */
typedef struct {
    float *z;
    int32_t *rank, *order;
    uint64_t (*kept)[TILE_PIXELS / 64];
    int64_t next[TILE_PIXELS];
    float through[TILE_PIXELS], alpha[TILE_PIXELS], depth[TILE_PIXELS];
} workspace;

typedef struct {
    const moit_splat_raster *raster;
    const moit_stages *stages;
    workspace *spaces; /* one a thread */
    int64_t *counts;   /* (pixels + 1): fragments of pixel p in counts[p + 1]; or NULL: draw */
    float *depth, *alpha, *color;
} drawing;

/* Where the picture has the k-th pixel of a tile among the rows that are drawn; -1: it has not. */
static int64_t pixel_of(const moit_splat_raster *r, int left, int top, int k) {
    int x = left + k % TILE, y = top + k / TILE;
    bool there = x < r->width && y >= r->top && y < r->bottom;
    return there ? (int64_t)(y - r->top) * r->width + x : -1;
}

/* Front to back, which splats are seen where. */
static void keep_those_seen(const drawing *d, workspace *w, const int32_t *listed, int count,
                            int left, int top) {
    const moit_screen_splat *all = d->raster->on_screen;
    const int32_t offsets[2] = {0, count};
    for (int i = 0; i < count; ++i) w->z[i] = all[listed[i]].z;
    d->stages->depth_ranks(1, offsets, w->z, w->rank, w->order);
    for (int i = 0; i < count; ++i) w->order[w->rank[i]] = i;
    for (int k = 0; k < TILE_PIXELS; ++k) w->through[k] = 1.0f;
    for (int n = 0; n < count; ++n) {
        int i = w->order[n];
        d->stages->splat(&all[listed[i]], left, top, LEAST_SEEN, w->through, w->alpha, NULL);
        for (int k = 0; k < TILE_PIXELS / 64; ++k) {
            uint64_t bits = 0;
            for (int b = 0; b < 64; ++b) bits |= (uint64_t)(w->alpha[64 * k + b] > 0.0f) << b;
            w->kept[i][k] = bits;
        }
    }
}

static void count_those_kept(const drawing *d, const workspace *w, int count, int left, int top) {
    for (int k = 0; k < TILE_PIXELS; ++k) {
        int64_t pixel = pixel_of(d->raster, left, top, k), kept = 0;
        for (int i = 0; i < count && pixel >= 0; ++i) kept += w->kept[i][k / 64] >> k % 64 & 1;
        if (pixel >= 0) d->counts[pixel + 1] = kept;
    }
}

static moit_status draw_tile(void *context, int64_t item, int thread) {
    const drawing *d = context;
    const moit_splat_raster *r = d->raster;
    workspace *w = &d->spaces[thread];
    int left = (int)(item % r->columns) * TILE,
        top = (int)(r->first_row + item / r->columns) * TILE;
    const int32_t *listed = r->listed + r->first[item];
    int count = (int)(r->first[item + 1] - r->first[item]);
    bool flat = r->splatting == MOIT_PROJECTED;
    if (flat) keep_those_seen(d, w, listed, count, left, top);
    if (flat && d->counts) {
        count_those_kept(d, w, count, left, top);
        return MOIT_OK;
    }
    for (int k = 0; k < TILE_PIXELS; ++k) {
        int64_t pixel = pixel_of(r, left, top, k);
        w->next[k] = d->counts || pixel < 0 ? 0 : r->offsets[pixel];
    }
    for (int i = 0; i < count; ++i) {
        const moit_screen_splat *s = &r->on_screen[listed[i]];
        for (int k = 0; k < TILE_PIXELS; ++k) w->through[k] = 1.0f;
        d->stages->splat(s, left, top, -1.0f, w->through, w->alpha, d->counts ? NULL : w->depth);
        for (int k = 0; k < TILE_PIXELS; ++k) {
            bool seen = flat ? w->kept[i][k / 64] >> k % 64 & 1 : w->alpha[k] > 0.0f;
            if (!seen || pixel_of(r, left, top, k) < 0) continue;
            int64_t at = w->next[k]++;
            if (d->counts) continue;
            d->depth[at] = w->depth[k];
            d->alpha[at] = w->alpha[k];
            for (int c = 0; c < 3; ++c) d->color[3 * at + c] = s->color[c];
        }
    }
    for (int k = 0; k < TILE_PIXELS && d->counts; ++k) {
        int64_t pixel = pixel_of(r, left, top, k);
        if (pixel >= 0) d->counts[pixel + 1] = w->next[k];
    }
    return MOIT_OK;
}

static moit_status for_tiles(drawing *d, const moit_run *run) {
    const moit_splat_raster *r = d->raster;
    int64_t tiles = (int64_t)r->columns * r->rows;
    int threads = (int)(run->threads < tiles ? run->threads : tiles);
    size_t most = (size_t)r->most_listed + MOIT_PADDING;
    d->stages = moit_stages_of(MOIT_FLOAT32, run->isa);
    d->spaces = calloc((size_t)threads, sizeof *d->spaces);
    moit_status status = d->spaces ? MOIT_OK : MOIT_NO_MEMORY;
    for (int t = 0; t < threads && status == MOIT_OK; ++t) {
        workspace *w = &d->spaces[t];
        w->z = malloc(most * sizeof *w->z);
        w->rank = malloc(most * sizeof *w->rank);
        w->order = malloc(most * sizeof *w->order);
        w->kept = malloc(most * sizeof *w->kept);
        if (!w->z || !w->rank || !w->order || !w->kept) status = MOIT_NO_MEMORY;
    }
    if (status == MOIT_OK) status = moit_parallel_for(run, tiles, draw_tile, d);
    for (int t = 0; t < threads && d->spaces; ++t) {
        free(d->spaces[t].z);
        free(d->spaces[t].rank);
        free(d->spaces[t].order);
        free(d->spaces[t].kept);
    }
    free(d->spaces);
    return status;
}

/* ---- The whole ------------------------------------------------------------------------------- */

moit_status moit_begin_splats(const moit_splats *splats, moit_splatting splatting,
                              const moit_camera *camera, int width, int height, int top, int bottom,
                              int64_t *offsets, moit_splat_raster **raster, const moit_run *run) {
    moit_splat_raster *r = calloc(1, sizeof *r);
    *raster = r;
    if (!r) return MOIT_NO_MEMORY;
    *r = (moit_splat_raster){.splats = splats,
                             .splatting = splatting,
                             .camera = *camera,
                             .width = width,
                             .height = height,
                             .top = top,
                             .bottom = bottom,
                             .columns = (width + TILE - 1) / TILE,
                             .rows = (bottom + TILE - 1) / TILE - top / TILE,
                             .first_row = top / TILE,
                             .offsets = offsets};
    r->on_screen = malloc((size_t)(splats->count + 1) * sizeof *r->on_screen);
    moit_status status = r->on_screen ? MOIT_OK : MOIT_NO_MEMORY;
    int64_t items = (splats->count + PROJECTED_AT_ONCE - 1) / PROJECTED_AT_ONCE;
    if (status == MOIT_OK) status = moit_parallel_for(run, items, project_some, r);
    if (status == MOIT_OK) status = list_by_tile(r);
    drawing count = {.raster = r, .counts = offsets};
    if (status == MOIT_OK) status = for_tiles(&count, run);
    if (status != MOIT_OK) {
        moit_end_splats(r);
        *raster = NULL;
        return status;
    }
    offsets[0] = 0;
    for (int64_t p = 0; p < (int64_t)width * (bottom - top); ++p) offsets[p + 1] += offsets[p];
    return MOIT_OK;
}

moit_status moit_draw_splats(const moit_splat_raster *raster, float *depth, float *alpha,
                             float *color, const moit_run *run) {
    drawing d = {.raster = raster, .depth = depth, .alpha = alpha, .color = color};
    return for_tiles(&d, run);
}

void moit_end_splats(moit_splat_raster *raster) {
    if (!raster) return;
    free(raster->on_screen);
    free(raster->first);
    free(raster->listed);
    free(raster);
}
