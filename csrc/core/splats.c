/* Splats to fragments: all to the screen, then to tiles, the tiles on several threads. Each tile
 * lists its splats in their order, so no result depends on the number of threads. */
#include "core/splats.h"
#include "core/stages/stages.h"
#include "core/threads.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct moit_splat_raster {
    moit_splatting splatting;
    moit_camera camera;
    int width, height;            /* pixels */
    int columns, rows;            /* tiles */
    int64_t count;                /* splats */
    moit_screen_splat *on_screen; /* (count) */
    int64_t *first;               /* (tiles + 1) */
    int32_t *listed;              /* splats of each tile, in order */
    int32_t *order;               /* where front to back each stands among them; or NULL */
    int64_t most_listed;          /* of a tile */
    const int64_t *offsets;
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
static void axes_of(const moit_splat_raster *r, const moit_splats *s, int64_t i, double thinnest,
                    double axis[3][3]) {
    const float *q = s->rotation + 4 * i;
    double w = (double)q[0], x = (double)q[1], y = (double)q[2], z = (double)q[3];
    const double column[3][3] = {
        {1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)},
        {2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x)},
        {2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)}};
    double longest = 0.0;
    for (int k = 0; k < 3; ++k) longest = fmax(longest, (double)s->scale[3 * i + k]);
    for (int k = 0; k < 3; ++k) {
        double scale = fmax((double)s->scale[3 * i + k], thinnest * longest);
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

/* Pixels [low, high] along an axis, as whole numbers; from ends that may be anything. */
static void pixels_between(double low, double high, int32_t ends[2]) {
    const double most = 1 << 24;
    if (low > -most) ends[0] = low < most ? (int32_t)floor(low) : (int32_t)most;
    if (high < most) ends[1] = high > -most ? (int32_t)ceil(high) : (int32_t)-most;
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
                  r->rows, &out->top, &out->bottom);
    /* Where it may have 1/255: with some more for what rounding takes off a square whose parts are
     * as great as they get in its tiles. */
    double away = radius + 2 * TILE, parts = 1.5 * (a + c) / determinant * away * away,
           reach = 2.0 * log(255.0 * (double)out->opacity) + 0.01 + 1e-6 * parts;
    pixels_between(out->x - sqrt(reach * a), out->x + sqrt(reach * a), out->across);
    pixels_between(out->y - sqrt(reach * c), out->y + sqrt(reach * c), out->down);
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
    *low = -HUGE_VAL;
    *high = HUGE_VAL;
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
        tiles_between(floor(from / TILE), floor(to / TILE) + 1.0, c ? r->rows : r->columns,
                      c ? &out->top : &out->left, c ? &out->bottom : &out->right);
        pixels_between(from - 1.0, to + 1.0, c ? out->down : out->across);
    }
    return true;
}

static void project(const moit_splat_raster *r, const moit_splats *s, int64_t i,
                    moit_screen_splat *out) {
    double away[3], at[3], axis[3][3];
    *out = (moit_screen_splat){.opacity = s->opacity[i],
                               .nearest = (float)r->camera.near,
                               .across = {INT32_MIN, INT32_MAX},
                               .down = {INT32_MIN, INT32_MAX}};
    for (int k = 0; k < 3; ++k) away[k] = (double)s->mean[3 * i + k] - r->camera.eye[k];
    at[0] = dot(r->camera.right, away);
    at[1] = dot(r->camera.up, away);
    at[2] = dot(r->camera.forward, away);
    bool near = at[2] < r->camera.near || (r->splatting == MOIT_PROJECTED && at[2] <= NEAREST);
    if (near || !(at[2] <= r->camera.far) || !(out->opacity >= 1.0f / 255.0f)) return;
    axes_of(r, s, i, r->splatting == MOIT_PROJECTED ? 0.0 : THINNEST, axis);
    out->z = (float)at[2];
    out->x = ((r->camera.scale[0] * at[0] / at[2] + 1.0) * r->width - 1.0) / 2.0;
    out->y = ((1.0 - r->camera.scale[1] * at[1] / at[2]) * r->height - 1.0) / 2.0;
    bool seen = r->splatting == MOIT_PROJECTED ? project_flat(r, at, axis, out)
                                               : project_along_rays(r, at, axis, out);
    if (!seen || out->top >= out->bottom) out->left = out->right = 0;
    if (out->left < out->right) color_of(s, i, away, out->color);
}

enum { PROJECTED_AT_ONCE = 4096 };

typedef struct {
    const moit_splat_raster *raster;
    const moit_splats *splats;
} projection;

static moit_status project_some(void *context, int64_t item, int thread) {
    const projection *p = context;
    int64_t end = (item + 1) * PROJECTED_AT_ONCE;
    if (end > p->splats->count) end = p->splats->count;
    for (int64_t i = item * PROJECTED_AT_ONCE; i < end; ++i)
        project(p->raster, p->splats, i, &p->raster->on_screen[i]);
    (void)thread;
    return MOIT_OK;
}

/* ---- To tiles -------------------------------------------------------------------------------- */

/* Counts the splats of each tile in first[tile + 1], or lists them from first[tile] on. */
static void visit_tiles(moit_splat_raster *r, int32_t *listed) {
    for (int64_t i = 0; i < r->count; ++i) {
        const moit_screen_splat *s = &r->on_screen[i];
        if (s->left >= s->right) continue;
        for (int y = s->top; y < s->bottom; ++y)
            for (int x = s->left; x < s->right; ++x) {
                int64_t *next = &r->first[(int64_t)y * r->columns + x + 1];
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
    size_t pairs = (size_t)r->first[tiles] + 1;
    r->listed = malloc(pairs * sizeof *r->listed);
    if (!r->listed) return MOIT_NO_MEMORY;
    if (r->splatting == MOIT_PROJECTED) {
        r->order = malloc(pairs * sizeof *r->order);
        if (!r->order) return MOIT_NO_MEMORY;
    }
    /* listing moves each tile's start to its end, which is where the next one starts */
    memmove(r->first + 1, r->first, (size_t)tiles * sizeof *r->first);
    r->first[0] = 0;
    visit_tiles(r, r->listed);
    return MOIT_OK;
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
    int64_t *counts;   /* (pixels + 1): fragments of pixel p in counts[p + 1]; or NULL: draw */
    float *depth, *alpha, *color;
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

/* Counts the fragments of the tile's pixels, and finds how far away they are. */
static void count_tile(const drawing *d, workspace *w, const int32_t *listed, int count, int left,
                       int top, const int32_t *order, const moit_tile_pixels *all) {
    memset(w->count, 0, sizeof w->count);
    let_all_through(w, all);
    float least = order ? LEAST_SEEN : -1.0f;
    for (int n = 0; n < count; ++n) {
        if (order && n % BETWEEN_LOOKS == BETWEEN_LOOKS - 1 && !something_is_seen(w)) break;
        const moit_screen_splat *s = &d->raster->on_screen[listed[order ? order[n] : n]];
        moit_tile_pixels r = covered(s, left, top, all);
        if (r.left >= r.right || r.top >= r.bottom) continue;
        d->stages->splat(s, left, top, &r, least, w->through, w->alpha, order ? NULL : w->depth);
        int seen = 0;
        for (int y = r.top; y < r.bottom; ++y)
            for (int k = y * TILE + r.left; k < y * TILE + r.right; ++k) {
                int one = w->alpha[k] > 0.0f;
                w->count[k] += one;
                seen |= one;
                if (order || !one) continue;
                if (w->depth[k] < w->nearest) w->nearest = w->depth[k];
                if (w->depth[k] > w->farthest) w->farthest = w->depth[k];
            }
        if (!order || !seen) continue;
        if (s->z < w->nearest) w->nearest = s->z;
        if (s->z > w->farthest) w->farthest = s->z;
    }
    for (int y = all->top; y < all->bottom; ++y)
        for (int x = all->left; x < all->right; ++x)
            d->counts[(int64_t)(top + y) * d->raster->width + left + x + 1] =
                w->count[y * TILE + x];
}

static void put(const drawing *d, workspace *w, const moit_screen_splat *s, int pixel, float depth,
                float alpha) {
    int64_t at = w->next[pixel]++;
    d->depth[at] = depth;
    d->alpha[at] = alpha;
    for (int c = 0; c < 3; ++c) d->color[3 * at + c] = s->color[c];
}

/* Front to back until nothing more is seen; then again, in the order in which they stand. */
static void draw_front_to_back(const drawing *d, workspace *w, const int32_t *listed, int count,
                               int left, int top, const int32_t *order,
                               const moit_tile_pixels *all) {
    const moit_screen_splat *on_screen = d->raster->on_screen;
    int64_t found = 0;
    int32_t *length = w->rank;
    memset(length, 0, (size_t)count * sizeof *length);
    for (int n = 0; n < count; ++n) {
        if (n % BETWEEN_LOOKS == BETWEEN_LOOKS - 1 && !something_is_seen(w)) break;
        const moit_screen_splat *s = &on_screen[listed[order[n]]];
        moit_tile_pixels r = covered(s, left, top, all);
        if (r.left >= r.right || r.top >= r.bottom) continue;
        d->stages->splat(s, left, top, &r, LEAST_SEEN, w->through, w->alpha, NULL);
        w->begin[order[n]] = found;
        for (int y = r.top; y < r.bottom; ++y)
            for (int k = y * TILE + r.left; k < y * TILE + r.right; ++k)
                if (w->alpha[k] > 0.0f) {
                    w->pixel[found] = (uint8_t)k;
                    w->kept[found++] = w->alpha[k];
                }
        length[order[n]] = (int32_t)(found - w->begin[order[n]]);
    }
    for (int i = 0; i < count; ++i) {
        const moit_screen_splat *s = &on_screen[listed[i]];
        for (int64_t k = w->begin[i]; length[i] > 0; ++k, --length[i])
            put(d, w, s, w->pixel[k], s->z, w->kept[k]);
    }
}

static void draw_as_listed(const drawing *d, workspace *w, const int32_t *listed, int count,
                           int left, int top, const moit_tile_pixels *all) {
    for (int i = 0; i < count; ++i) {
        const moit_screen_splat *s = &d->raster->on_screen[listed[i]];
        moit_tile_pixels r = covered(s, left, top, all);
        if (r.left >= r.right || r.top >= r.bottom) continue;
        d->stages->splat(s, left, top, &r, -1.0f, w->through, w->alpha, w->depth);
        for (int y = r.top; y < r.bottom; ++y)
            for (int k = y * TILE + r.left; k < y * TILE + r.right; ++k)
                if (w->alpha[k] > 0.0f) put(d, w, s, k, w->depth[k], w->alpha[k]);
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
    if (d->counts) {
        if (order) order_tile(d, w, listed, count, order);
        count_tile(d, w, listed, count, left, top, order, &all);
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
           kept = r->order && !d->counts ? (size_t)most_of_a_tile(d, tiles) + 1 : 1;
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

moit_status moit_begin_splats(const moit_splats *splats, moit_splatting splatting,
                              const moit_camera *camera, int width, int height, int64_t *offsets,
                              float range[2], moit_splat_raster **raster, const moit_run *run) {
    moit_splat_raster *r = calloc(1, sizeof *r);
    *raster = r;
    if (!r) return MOIT_NO_MEMORY;
    *r = (moit_splat_raster){.splatting = splatting,
                             .camera = *camera,
                             .width = width,
                             .height = height,
                             .columns = (width + TILE - 1) / TILE,
                             .rows = (height + TILE - 1) / TILE,
                             .count = splats->count,
                             .offsets = offsets};
    r->on_screen = malloc((size_t)(splats->count + 1) * sizeof *r->on_screen);
    moit_status status = r->on_screen ? MOIT_OK : MOIT_NO_MEMORY;
    int64_t items = (splats->count + PROJECTED_AT_ONCE - 1) / PROJECTED_AT_ONCE;
    projection seen = {.raster = r, .splats = splats};
    if (status == MOIT_OK) status = moit_parallel_for(run, items, project_some, &seen);
    if (status == MOIT_OK) status = list_by_tile(r);
    drawing count = {.raster = r, .bottom = height, .counts = offsets};
    range[0] = INFINITY;
    range[1] = -INFINITY;
    if (status == MOIT_OK) status = for_tiles(&count, range, run);
    if (status != MOIT_OK) {
        moit_end_splats(r);
        *raster = NULL;
        return status;
    }
    offsets[0] = 0;
    for (int64_t p = 0; p < (int64_t)width * height; ++p) offsets[p + 1] += offsets[p];
    return MOIT_OK;
}

moit_status moit_draw_splats(const moit_splat_raster *raster, int top, int bottom, float *depth,
                             float *alpha, float *color, const moit_run *run) {
    drawing d = {.raster = raster,
                 .top = top,
                 .bottom = bottom,
                 .depth = depth,
                 .alpha = alpha,
                 .color = color};
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
