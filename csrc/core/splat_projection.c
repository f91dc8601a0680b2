/* Splats on the screen: ellipses by the projection's derivative, or what rays meet. */
#include "core/elementary.h"
#include "core/splats.h"
#include "core/threads.h"

#include <math.h>
#include <string.h>

enum { TILE = MOIT_SPLAT_TILE };

/* Numbers of the reference rasteriser: what is nearer is not drawn; what middles are limited to, in
 * halves of the picture, where the projection is taken to be linear. */
static const double NEAREST = 0.2, LIMIT = 1.3;

/* The same where it is asked to leave opacity over areas as it is (Yu et al., "Mip-Splatting:
 * Alias-free 3D Gaussian Splatting", 2024): of areas of ellipses, squared. */
static const double LEAST_SHARE = 0.000025;

static double dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static int harmonics_of(int degree) { return (degree + 1) * (degree + 1); }

int moit_harmonics_at(int degree, const double d[3], double value[16]) {
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
    int count = moit_harmonics_at(s->degree, direction, value);
    const float *own = s->harmonics + 3 * i * count;
    for (int c = 0; c < 3; ++c) {
        double sum = 0.5;
        for (int k = 0; k < count; ++k) sum += value[k] * (double)own[3 * k + c];
        color[c] = (float)(sum > 0.0 ? sum : 0.0);
    }
}

void moit_splat_middle(const moit_splat_raster *r, const moit_splats *s, int64_t i, double away[3],
                       double at[3]) {
    for (int k = 0; k < 3; ++k) away[k] = (double)s->mean[3 * i + k] - r->camera.eye[k];
    at[0] = dot(r->camera.right, away);
    at[1] = dot(r->camera.up, away);
    at[2] = dot(r->camera.forward, away);
}

void moit_splat_columns(const float *q, double column[3][3]) {
    double w = (double)q[0], x = (double)q[1], y = (double)q[2], z = (double)q[3];
    const double turned[3][3] = {
        {1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)},
        {2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x)},
        {2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)}};
    memcpy(column, turned, sizeof turned);
}

/* What makes a disc a sphere has to be a number. */
double moit_least_scale(const moit_splat_raster *r, const moit_splats *s, int64_t i) {
    double longest = 0.0;
    for (int k = 0; k < 3; ++k) longest = fmax(longest, (double)s->scale[3 * i + k]);
    return r->splatting == MOIT_ALONG_RAYS ? MOIT_THINNEST_SPLAT * longest : 0.0;
}

void moit_splat_axes(const moit_splat_raster *r, const moit_splats *s, int64_t i,
                     double axis[3][3]) {
    double column[3][3], least = moit_least_scale(r, s, i);
    moit_splat_columns(s->rotation + 4 * i, column);
    for (int k = 0; k < 3; ++k) {
        double scale = fmax((double)s->scale[3 * i + k], least);
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

void moit_flatten_splat(const moit_splat_raster *r, const double at[3], const double axis[3][3],
                        moit_flat_splat *flat) {
    double z = at[2];
    for (int k = 0; k < 2; ++k) {
        double limit = LIMIT / r->camera.scale[k], slope = at[k] / z;
        flat->pixels[k] = r->camera.scale[k] * (k ? r->height : r->width) / 2.0;
        flat->limit[k] = limit;
        flat->slope[k] = slope;
        flat->limited[k] = slope < -limit ? -limit : slope > limit ? limit : slope;
    }
    for (int k = 0; k < 3; ++k)
        for (int c = 0; c < 2; ++c)
            flat->on[k][c] = (c ? -1.0 : 1.0) * flat->pixels[c] / z
                             * (axis[k][c] - flat->limited[c] * axis[k][2]);
}

double moit_filtered_share(const double own[3], double by[3]) {
    double a = own[0] + MOIT_SPLAT_DILATION, b = own[1], c = own[2] + MOIT_SPLAT_DILATION,
           before = own[0] * own[2] - b * b, after = a * c - b * b, square = before / after,
           share = sqrt(fmax(LEAST_SHARE, square));
    if (!by) return share;
    bool changes = square > LEAST_SHARE;
    by[0] = changes ? 0.5 * share * (own[2] / before - c / after) : 0.0;
    by[1] = changes ? share * (b / after - b / before) : 0.0;
    by[2] = changes ? 0.5 * share * (own[0] / before - a / after) : 0.0;
    return share;
}

/* As an ellipse: its covariance by the projection's derivative in its middle. */
static bool project_flat(const moit_splat_raster *r, const double at[3], const double axis[3][3],
                         moit_screen_splat *out) {
    moit_flat_splat flat;
    double z = at[2], covariance[2][2] = {{0.0}};
    moit_flatten_splat(r, at, axis, &flat);
    for (int k = 0; k < 3; ++k)
        for (int c = 0; c < 2; ++c)
            for (int d = 0; d < 2; ++d) covariance[c][d] += flat.on[k][c] * flat.on[k][d];
    double a = covariance[0][0] + MOIT_SPLAT_DILATION, b = covariance[0][1],
           c = covariance[1][1] + MOIT_SPLAT_DILATION;
    double determinant = a * c - b * b, middle = 0.5 * (a + c),
           apart = middle * middle - determinant;
    if (!(determinant > 0.0)) return false;
    if (r->splatting & MOIT_FILTERED) {
        const double own[3] = {covariance[0][0], b, covariance[1][1]};
        out->opacity = (float)((double)out->opacity * moit_filtered_share(own, NULL));
        if (!(out->opacity >= 1.0f / 255.0f)) return false;
    }
    double radius = ceil(3.0 * sqrt(middle + sqrt(apart > 0.1 ? apart : 0.1)));
    out->square[0] = (float)(c / determinant);
    out->square[1] = (float)(-2.0 * b / determinant);
    out->square[2] = (float)(a / determinant);
    out->along[0] = 1.0f;
    out->depth[0] = (float)z;
    out->flat = 1;
    tiles_between(floor((out->x - radius) / TILE), floor((out->x + radius + TILE - 1) / TILE),
                  r->columns, &out->left, &out->right);
    tiles_between(floor((out->y - radius) / TILE), floor((out->y + radius + TILE - 1) / TILE),
                  r->rows, &out->top, &out->bottom);
    /* Where it may have 1/255: with some more for what rounding takes off a square whose parts are
     * as great as they get in its tiles. */
    double away = radius + 2 * TILE, parts = 1.5 * (a + c) / determinant * away * away,
           reach = 2.0 * moit_log(255.0 * (double)out->opacity) + 0.01 + 1e-6 * parts;
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

bool moit_round_splat_of(const moit_splat_raster *r, const double at[3], const double axis[3][3],
                         moit_round_splat *round) {
    for (int k = 0; k < 3; ++k) {
        double size = round->size[k] = dot(axis[k], axis[k]);
        if (!(size > 0.0)) return false;
        for (int c = 0; c < 3; ++c) round->sphere[k][c] = axis[k][c] / size;
        round->u[k] = dot(round->sphere[k], at);
        round->d[k] = round->u[k] / at[2];
    }
    for (int c = 0; c < 2; ++c) {
        round->pixel[c] = 2.0 / (r->camera.scale[c] * (c ? -r->height : r->width));
        for (int k = 0; k < 3; ++k) round->step[c][k] = round->sphere[k][c] * round->pixel[c];
        cross(round->u, round->step[c], round->turned[c]);
    }
    round->over = dot(round->d, round->d);
    return round->over > 0.0 && isfinite(round->over);
}

static bool project_along_rays(const moit_splat_raster *r, const double at[3],
                               const double axis[3][3], moit_screen_splat *out) {
    moit_round_splat round;
    if (!moit_round_splat_of(r, at, axis, &round)) return false;
    const double *u = round.u, *d = round.d, (*step)[3] = round.step, (*turned)[3] = round.turned;
    double over = round.over, z = at[2];
    out->spread = 1.0 / sqrt(over);
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
    double reach = 2.0 * moit_log(255.0 * (double)out->opacity), low, high;
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
    bool projected = r->splatting != MOIT_ALONG_RAYS;
    *out = (moit_screen_splat){.index = (int32_t)i,
                               .opacity = s->opacity[i],
                               .nearest = (float)r->camera.near,
                               .across = {INT32_MIN, INT32_MAX},
                               .down = {INT32_MIN, INT32_MAX}};
    moit_splat_middle(r, s, i, away, at);
    bool near = at[2] < r->camera.near || (projected && at[2] <= NEAREST);
    if (near || !(at[2] <= r->camera.far) || !(out->opacity >= 1.0f / 255.0f)) return;
    moit_splat_axes(r, s, i, axis);
    out->z = (float)at[2];
    out->x = ((r->camera.scale[0] * at[0] / at[2] + 1.0) * r->width - 1.0) / 2.0;
    out->y = ((1.0 - r->camera.scale[1] * at[1] / at[2]) * r->height - 1.0) / 2.0;
    bool seen = projected ? project_flat(r, at, axis, out) : project_along_rays(r, at, axis, out);
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

moit_status moit_project_splats(const moit_splat_raster *r, const moit_splats *splats,
                                const moit_run *run) {
    int64_t items = (splats->count + PROJECTED_AT_ONCE - 1) / PROJECTED_AT_ONCE;
    projection seen = {.raster = r, .splats = splats};
    return moit_parallel_for(run, items, project_some, &seen);
}
