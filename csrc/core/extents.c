#include "core/extents.h"
#include "core/parts.h"
#include "core/tile.h"

#include <math.h>

static double number(const moit_fragments *f, const void *array, int64_t i) {
    return moit_number(f->precision, array, i);
}

/* Of the standard normal distribution, between a and b: nothing cancels in its tails, nor where
 * the two are close. */
static double normal_between(double a, double b) {
    const double root_half = 0.70710678118654752, density = 0.39894228040143268;
    if (b - a < 1e-3) {
        double middle = 0.5 * (a + b), square = (b - a) * (b - a);
        return (b - a) * density * exp(-0.5 * middle * middle)
               * (1.0 + square * (middle * middle - 1.0) / 24.0);
    }
    if (a > 0.0) return 0.5 * (erfc(a * root_half) - erfc(b * root_half));
    if (b < 0.0) return 0.5 * (erfc(-b * root_half) - erfc(-a * root_half));
    return 0.5 * (erf(b * root_half) - erf(a * root_half));
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

double moit_share_at(const moit_extent *e, double depth, double near, double far) {
    double length = 0.25 * far - 0.25 * near;
    if (!e->is_gaussian) return length / (0.25 * e->back - 0.25 * e->front);
    double x = deviations_to(e, depth);
    return 0.39894228040143268 * exp(-0.5 * x * x) * (length / (0.25 * e->deviation)) / e->mass;
}
