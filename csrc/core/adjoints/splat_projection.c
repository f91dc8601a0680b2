/* From splats as the screen has them back to their numbers: csrc/core/splat_projection.c read
 * backwards. `by_x` is the derivative of the loss by x. */
#include "core/splats.h"
#include "core/threads.h"
#include "moit_gradients.h"

#include <float.h>
#include <math.h>
#include <string.h>

static double dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* ---- As an ellipse --------------------------------------------------------------------------- */

/* By the inverse matrix of the covariance S, which `square` has as (a, 2 b, c), to that by S:
 * -inverse G inverse; by (S00, S01, S11). */
static void pull_inverse(const float square[3], const double by_square[3], double by[3]) {
    double a = (double)square[0], b = 0.5 * (double)square[1], c = (double)square[2];
    const double *g = by_square;
    by[0] = -(a * a * g[0] + 2.0 * a * b * g[1] + b * b * g[2]);
    by[1] = -2.0 * (a * b * g[0] + (a * c + b * b) * g[1] + b * c * g[2]);
    by[2] = -(b * b * g[0] + 2.0 * b * c * g[1] + c * c * g[2]);
}

/* opacity: the splat's own. The share of it that is seen. */
static double pull_flat(const moit_splat_raster *r, const moit_screen_splat *s, double opacity,
                        const moit_splat_sums *sums, const double at[3], const double axis[3][3],
                        double by_at[3], double by_axis[3][3]) {
    moit_flat_splat flat;
    double by[3], by_limited[2] = {0.0, 0.0}, z = at[2];
    moit_flatten_splat(r, at, axis, &flat);
    pull_inverse(s->square, sums->square, by);
    double share = 1.0;
    if (r->splatting & MOIT_FILTERED) {
        double own[3] = {0.0}, by_own[3];
        for (int k = 0; k < 3; ++k) {
            own[0] += flat.on[k][0] * flat.on[k][0];
            own[1] += flat.on[k][0] * flat.on[k][1];
            own[2] += flat.on[k][1] * flat.on[k][1];
        }
        share = moit_filtered_share(own, by_own);
        for (int k = 0; k < 3; ++k) by[k] += sums->opacity * opacity * by_own[k];
    }
    by_at[2] += sums->depth[0];
    for (int k = 0; k < 3; ++k)
        for (int c = 0; c < 2; ++c) {
            double scale = (c ? -1.0 : 1.0) * flat.pixels[c] / z;
            double by_on = 2.0 * by[2 * c] * flat.on[k][c] + by[1] * flat.on[k][1 - c];
            by_axis[k][c] += scale * by_on;
            by_axis[k][2] -= scale * flat.limited[c] * by_on;
            by_limited[c] -= scale * axis[k][2] * by_on;
            by_at[2] -= flat.on[k][c] / z * by_on;
        }
    for (int c = 0; c < 2; ++c) {
        if (flat.limited[c] != flat.slope[c]) continue;
        by_at[c] += by_limited[c] / z;
        by_at[2] -= by_limited[c] * flat.slope[c] / z;
    }
    return share;
}

/* ---- Along rays ------------------------------------------------------------------------------ */

static void add_cross(const double a[3], const double b[3], double out[3]) {
    for (int k = 0; k < 3; ++k)
        out[k] += a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
}

static void pull_round(const moit_splat_raster *r, const moit_splat_sums *sums, const double at[3],
                       const double axis[3][3], double by_at[3], double by_axis[3][3]) {
    moit_round_splat round;
    if (!moit_round_splat_of(r, at, axis, &round)) return;
    const double *by_square = sums->square, *by_along = sums->along, *by_depth = sums->depth,
                 *u = round.u, *d = round.d, (*step)[3] = round.step, (*turned)[3] = round.turned;
    double scaled = 1.0 / round.over, by_u[3] = {0.0}, by_d[3] = {0.0}, by_step[2][3] = {{0.0}};
    /* all but the distance is over |A m / z|^2 */
    double by_over =
        by_along[4] * 2.0 * dot(step[0], step[1]) + by_square[1] * 2.0 * dot(turned[0], turned[1]);
    for (int c = 0; c < 2; ++c) {
        const double *other = turned[1 - c];
        double by_turned[3];
        by_over +=
            by_square[2 * c] * dot(turned[c], turned[c]) + by_along[1 + c] * 2.0 * dot(d, step[c])
            + by_along[3 + 2 * c] * dot(step[c], step[c]) + by_depth[1 + c] * dot(u, step[c]);
        for (int k = 0; k < 3; ++k) {
            by_turned[k] =
                2.0 * scaled * (by_square[2 * c] * turned[c][k] + by_square[1] * other[k]);
            by_d[k] += 2.0 * scaled * by_along[1 + c] * step[c][k];
            by_u[k] += scaled * by_depth[1 + c] * step[c][k];
            by_step[c][k] += 2.0 * scaled
                                 * (by_along[1 + c] * d[k] + by_along[3 + 2 * c] * step[c][k]
                                    + by_along[4] * step[1 - c][k])
                             + scaled * by_depth[1 + c] * u[k];
        }
        add_cross(by_turned, u, by_step[c]);
        add_cross(step[c], by_turned, by_u);
    }
    by_over *= -scaled * scaled;
    by_at[2] += sums->depth[0];
    for (int k = 0; k < 3; ++k) {
        by_d[k] += 2.0 * d[k] * by_over;
        by_u[k] += by_d[k] / at[2];
        by_at[2] -= by_d[k] * d[k] / at[2];
    }
    for (int k = 0; k < 3; ++k) {
        double by_sphere[3];
        for (int c = 0; c < 3; ++c) {
            by_sphere[c] = by_u[k] * at[c] + (c < 2 ? by_step[c][k] * round.pixel[c] : 0.0);
            by_at[c] += by_u[k] * round.sphere[k][c];
        }
        double along = 2.0 * dot(by_sphere, round.sphere[k]);
        for (int c = 0; c < 3; ++c)
            by_axis[k][c] += (by_sphere[c] - along * axis[k][c]) / round.size[k];
    }
}

/* ---- To the world ---------------------------------------------------------------------------- */

/* As a float; beyond the largest, that. */
static float held(double value) {
    if (!(value == value)) return 0.0f;
    return (float)fmin(fmax(value, (double)-FLT_MAX), (double)FLT_MAX);
}

static void pull_axes(const moit_splat_raster *r, const moit_splats *s, int64_t i,
                      const double by_axis[3][3], const moit_splat_gradients *out) {
    const float *q = s->rotation + 4 * i, *scale = s->scale + 3 * i;
    double column[3][3], b[3][3], least = moit_least_scale(r, s, i), by_scale[3], by_longest = 0.0;
    moit_splat_columns(q, column);
    for (int k = 0; k < 3; ++k) {
        double length = fmax((double)scale[k], least);
        for (int c = 0; c < 3; ++c)
            b[k][c] = r->camera.right[c] * by_axis[k][0] + r->camera.up[c] * by_axis[k][1]
                      + r->camera.forward[c] * by_axis[k][2];
        by_scale[k] = dot(b[k], column[k]);
        if ((double)scale[k] < least) {
            by_longest += MOIT_THINNEST_SPLAT * by_scale[k];
            by_scale[k] = 0.0;
        }
        for (int c = 0; c < 3; ++c) b[k][c] *= length;
    }
    int longest = scale[1] > scale[0] ? 1 : 0;
    if (scale[2] > scale[longest]) longest = 2;
    by_scale[longest] += by_longest;
    double w = (double)q[0], x = (double)q[1], y = (double)q[2], z = (double)q[3];
    double by[4] = {
        2.0 * (z * (b[0][1] - b[1][0]) + y * (b[2][0] - b[0][2]) + x * (b[1][2] - b[2][1])),
        2.0
            * (y * (b[0][1] + b[1][0]) + z * (b[0][2] + b[2][0]) + w * (b[1][2] - b[2][1])
               - 2.0 * x * (b[1][1] + b[2][2])),
        2.0
            * (x * (b[0][1] + b[1][0]) + z * (b[1][2] + b[2][1]) + w * (b[2][0] - b[0][2])
               - 2.0 * y * (b[0][0] + b[2][2])),
        2.0
            * (x * (b[0][2] + b[2][0]) + y * (b[1][2] + b[2][1]) + w * (b[0][1] - b[1][0])
               - 2.0 * z * (b[0][0] + b[1][1])),
    };
    double along = by[0] * w + by[1] * x + by[2] * y + by[3] * z;
    for (int k = 0; k < 4; ++k) out->rotation[4 * i + k] = held(by[k] - along * (double)q[k]);
    for (int k = 0; k < 3; ++k) out->scale[3 * i + k] = held(by_scale[k]);
}

/* Of each harmonic by the direction's x, y and z. */
static void slopes_at(const double d[3], double by[16][3]) {
    double x = d[0], y = d[1], z = d[2], xx = x * x, yy = y * y, zz = z * z;
    const double first = 0.4886025119029199, second = 1.0925484305920792;
    const double slopes[16][3] = {
        {0.0, 0.0, 0.0},
        {0.0, -first, 0.0},
        {0.0, 0.0, first},
        {-first, 0.0, 0.0},
        {second * y, second * x, 0.0},
        {0.0, -second * z, -second * y},
        {-0.6307831305050401 * x, -0.6307831305050401 * y, 1.2615662610100802 * z},
        {-second * z, 0.0, -second * x},
        {second * x, -second * y, 0.0},
        {-3.5402615395598609 * x * y, -1.7701307697799304 * (xx - yy), 0.0},
        {2.890611442640554 * y * z, 2.890611442640554 * x * z, 2.890611442640554 * x * y},
        {0.9140915989289316 * x * y, -0.4570457994644658 * (4.0 * zz - xx - 3.0 * yy),
         -3.6563663957157263 * y * z},
        {-2.2390589957806982 * x * z, -2.2390589957806982 * y * z,
         1.1195294978903491 * (2.0 * zz - xx - yy)},
        {-0.4570457994644658 * (4.0 * zz - 3.0 * xx - yy), 0.9140915989289316 * x * y,
         -3.6563663957157263 * x * z},
        {2.890611442640554 * x * z, -2.890611442640554 * y * z, 1.445305721320277 * (xx - yy)},
        {-1.7701307697799304 * (xx - yy), 3.5402615395598609 * x * y, 0.0},
    };
    memcpy(by, slopes, sizeof slopes);
}

static void pull_color(const moit_splats *s, int64_t i, const moit_screen_splat *on_screen,
                       const double by_color[3], const double away[3], double by_away[3],
                       float *by_harmonics) {
    double length = sqrt(dot(away, away)), value[16], slope[16][3], direction[3] = {0.0},
           by_direction[3] = {0.0};
    for (int k = 0; k < 3 && length > 0.0; ++k) direction[k] = away[k] / length;
    int count = moit_harmonics_at(s->degree, direction, value);
    slopes_at(direction, slope);
    for (int c = 0; c < 3; ++c) {
        double by = on_screen->color[c] > 0.0f ? by_color[c] : 0.0;
        for (int k = 0; k < count; ++k) {
            by_harmonics[3 * k + c] = held(by * value[k]);
            for (int j = 0; j < 3; ++j)
                by_direction[j] += by * (double)s->harmonics[3 * (i * count + k) + c] * slope[k][j];
        }
    }
    double along = dot(by_direction, direction);
    for (int k = 0; k < 3 && length > 0.0; ++k)
        by_away[k] += (by_direction[k] - along * direction[k]) / length;
}

static void pull_splat(const moit_splat_raster *r, const moit_splats *s, int64_t i,
                       const moit_splat_sums *sums, const moit_splat_gradients *out) {
    const moit_screen_splat *on_screen = &r->on_screen[i];
    int harmonics = (s->degree + 1) * (s->degree + 1);
    memset(out->mean + 3 * i, 0, 3 * sizeof *out->mean);
    memset(out->scale + 3 * i, 0, 3 * sizeof *out->scale);
    memset(out->rotation + 4 * i, 0, 4 * sizeof *out->rotation);
    memset(out->harmonics + 3 * i * harmonics, 0, (size_t)(3 * harmonics) * sizeof(float));
    out->opacity[i] = held(sums->opacity);
    if (on_screen->left >= on_screen->right) return;
    double away[3], at[3], axis[3][3], by_away[3] = {0.0}, by_at[3] = {0.0},
                                       by_axis[3][3] = {{0.0}};
    moit_splat_middle(r, s, i, away, at);
    moit_splat_axes(r, s, i, axis);
    for (int c = 0; c < 2; ++c) {
        double by = (c ? -0.5 * r->height * sums->y : 0.5 * r->width * sums->x) * r->camera.scale[c]
                    / at[2];
        by_at[c] += by;
        by_at[2] -= by * at[c] / at[2];
    }
    if (on_screen->flat) {
        double share =
            pull_flat(r, on_screen, (double)s->opacity[i], sums, at, axis, by_at, by_axis);
        out->opacity[i] = held(share * sums->opacity);
    } else pull_round(r, sums, at, axis, by_at, by_axis);
    pull_axes(r, s, i, by_axis, out);
    pull_color(s, i, on_screen, sums->color, away, by_away, out->harmonics + 3 * i * harmonics);
    for (int k = 0; k < 3; ++k)
        out->mean[3 * i + k] = held(by_away[k] + r->camera.right[k] * by_at[0]
                                    + r->camera.up[k] * by_at[1] + r->camera.forward[k] * by_at[2]);
}

enum { PULLED_AT_ONCE = 4096 };

typedef struct {
    const moit_splat_raster *raster;
    const moit_splats *splats;
    const moit_splat_sums *sums;
    const moit_splat_gradients *out;
} pulling;

static moit_status pull_some(void *context, int64_t item, int thread) {
    const pulling *p = context;
    int64_t end = (item + 1) * PULLED_AT_ONCE;
    if (end > p->splats->count) end = p->splats->count;
    for (int64_t i = item * PULLED_AT_ONCE; i < end; ++i)
        pull_splat(p->raster, p->splats, i, &p->sums[i], p->out);
    (void)thread;
    return MOIT_OK;
}

moit_status moit_pull_splat_projection(const moit_splat_raster *raster, const moit_splats *splats,
                                       const moit_splat_sums *sums, const moit_splat_gradients *out,
                                       const moit_run *run) {
    int64_t items = (splats->count + PULLED_AT_ONCE - 1) / PULLED_AT_ONCE;
    pulling p = {raster, splats, sums, out};
    return moit_parallel_for(run, items, pull_some, &p);
}
