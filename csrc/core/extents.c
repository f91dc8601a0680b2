#include "core/extents.h"
#include "core/elementary.h"
#include "core/parts.h"
#include "core/tile.h"

#include <math.h>

static double number(const moit_fragments *f, const void *array, int64_t i) {
    return moit_number(f->precision, array, i);
}

static const double root_half = 0.70710678118654752, normal_density = 0.39894228040143268;

/* Of the standard normal distribution, between a and b that are close. */
static double normal_near(double a, double b) {
    double middle = 0.5 * (a + b), square = (b - a) * (b - a);
    return (b - a) * normal_density * moit_exp(-0.5 * middle * middle)
           * (1.0 + square * (middle * middle - 1.0) / 24.0);
}

static bool are_close(double a, double b) { return b - a < 1e-3; }

/* Between any two: nothing cancels in the distribution's tails, nor where the two are close. */
static double normal_between(double a, double b) {
    if (are_close(a, b)) return normal_near(a, b);
    if (a > 0.0) return 0.5 * (moit_erfc(a * root_half) - moit_erfc(b * root_half));
    if (b < 0.0) return 0.5 * (moit_erfc(-b * root_half) - moit_erfc(-a * root_half));
    return 0.5 * (moit_erf(b * root_half) - moit_erf(a * root_half));
}

/* Differences of any two depths are finite so. */
static double deviations_to(const moit_extent *e, double depth) {
    return (0.25 * depth - 0.25 * e->mean) / (0.25 * e->deviation);
}

moit_extent moit_extent_of(const moit_fragments *f, int64_t i) {
    double depth = number(f, f->depth, i), deviation = 0.0;
    moit_extent e = {.front = depth, .back = f->back ? number(f, f->back, i) : depth};
    if (f->deviation) deviation = number(f, f->deviation, i);
    if (deviation < 0x1p-1000 || moit_is_opaque(f, i)) return e;
    e.mean = depth;
    e.deviation = deviation;
    e.front = fmin(depth, fmax(f->near, depth - MOIT_DEVIATIONS * deviation));
    e.back = fmax(depth, fmin(f->far, depth + MOIT_DEVIATIONS * deviation));
    if (!(e.front < e.back)) return e;
    e.mass = normal_between(deviations_to(&e, e.front), deviations_to(&e, e.back));
    e.is_gaussian = e.mass > 0.0; /* else so wide that numbers do not tell it from what is even */
    return e;
}

double moit_share_between(const moit_extent *e, double near, double far) {
    if (e->is_gaussian) {
        double share = normal_between(deviations_to(e, near), deviations_to(e, far)) / e->mass;
        return fmin(1.0, fmax(0.0, share));
    }
    double whole = e->back - e->front;
    if (isfinite(whole)) return (far - near) / whole;
    return (0.25 * far - 0.25 * near) / (0.25 * e->back - 0.25 * e->front);
}

double moit_share_passed(const moit_extent *e, double near, double far, moit_tail *last) {
    double a = deviations_to(e, near), b = deviations_to(e, far);
    if (!e->is_gaussian || are_close(a, b)) {
        last->known = false;
        return moit_share_between(e, near, far);
    }
    bool is_known = last->known && last->depth == near;
    double before = is_known ? last->tail : moit_erfc(fabs(a) * root_half);
    double behind = moit_erfc(fabs(b) * root_half);
    *last = (moit_tail){true, far, behind};
    double twice = a >= 0.0   ? before - behind
                   : b <= 0.0 ? behind - before
                              : 2.0 - (before + behind);
    return fmin(1.0, fmax(0.0, 0.5 * twice / e->mass));
}

void moit_shares_at(const moit_extent *e, int points, const double *depth, double near, double far,
                    double *share) {
    double length = 0.25 * far - 0.25 * near;
    double even = e->is_gaussian ? 0.0 : length / (0.25 * e->back - 0.25 * e->front);
    for (int j = 0; j < points; ++j) share[j] = even;
    if (!e->is_gaussian) return;
    for (int j = 0; j < points; ++j) {
        double x = deviations_to(e, depth[j]);
        share[j] = -0.5 * x * x;
    }
    moit_exps(points, share, share);
    for (int j = 0; j < points; ++j)
        share[j] = normal_density * share[j] * (length / (0.25 * e->deviation)) / e->mass;
}
