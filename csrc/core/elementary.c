/* What is large of a series is summed in pairs of doubles, so that little but the last rounding is
 * left to be wrong; the reductions are those of the kernels' `elementary.h`. */
#include "core/elementary.h"

#include <math.h>

#define SCALAR double
#define LANES 2 /* of which the first is used: what pairs are made of is a vector */
#include "kernels/dialect.h"
#include "kernels/pairs.h"
#undef abs
#undef sqrt

static const double ln2_high = 0.69314718036912381649, ln2_low = 1.90821492927058770e-10;

/* ---- exp ------------------------------------------------------------------------------------ */

/* exp(x) = 2^n (1 + rest), |rest| below 0.42. */
typedef struct {
    int n;
    pair rest;
} power_of_two;

static power_of_two power_of(double x) {
    enum { DEGREE = 15 };
    double n = rint(x * 1.4426950408889634);
    pair r = pair_difference(pair_of(K(x - n * ln2_high)), exact_product(K(n), K(ln2_low)));
    pair square = pair_product(r, r), half_square;
    half_square.high = 0.5 * square.high;
    half_square.low = 0.5 * square.low;
    /* 1/3! + r/4! + r^2/5! + ... */
    real series = K(1.0);
    for (int k = DEGREE; k > 3; --k) series = 1.0 + series * r.high * K(1.0 / k);
    real cube = square.high * r.high * K(1.0 / 6.0);
    return (power_of_two){(int)n, pair_sum(pair_sum(r, half_square), pair_of(cube * series))};
}

double moit_exp(double x) {
    if (x != x) return x;
    if (x > 710.0) return HUGE_VAL;
    if (x < -746.0) return 0.0;
    power_of_two power = power_of(x);
    return ldexp(pair_sum(pair_of(K(1.0)), power.rest).high[0], power.n);
}

double moit_expm1(double x) {
    if (fabs(x) < 0x1p-54) return x;
    if (!(x < 700.0)) return moit_exp(x);
    if (x < -40.0) return -1.0;
    power_of_two power = power_of(x);
    real scale = K(ldexp(1.0, power.n));
    pair scaled;
    scaled.high = scale * power.rest.high;
    scaled.low = scale * power.rest.low;
    return pair_sum(exact_sum(scale, K(-1.0)), scaled).high[0];
}

/* ---- log ------------------------------------------------------------------------------------ */

/* ln(x + low), for positive x and a low that is little beside it: with 2^n (1 + f) and
 * s = f / (2 + f) it is n ln 2 + 2 s + 2 s^3 / 3 + 2 s^5 / 5 + ... */
static double logarithm_of(double x, double low) {
    enum { TERMS = 12 };
    int n;
    double fraction = frexp(x, &n);
    if (fraction < 0.70710678118654752) {
        fraction *= 2.0;
        --n;
    }
    pair f = exact_sum(K(fraction - 1.0), K(ldexp(low, -n)));
    pair s = pair_quotient(f, pair_sum(pair_of(K(2.0)), f)), twice;
    twice.high = s.high + s.high;
    twice.low = s.low + s.low;
    real square = s.high * s.high, series = K(0.0);
    for (int k = TERMS; k > 0; --k) series = square * (K(1.0 / (2 * k + 1)) + series);
    pair of_two = pair_sum(pair_of(K(n * ln2_high)), exact_product(K(n), K(ln2_low)));
    pair of_fraction = pair_sum(twice, pair_of(twice.high * series));
    return pair_sum(of_two, of_fraction).high[0];
}

double moit_log(double x) {
    if (!(x > 0.0)) return x == 0.0 ? -HUGE_VAL : x < 0.0 ? (double)NAN : x;
    return x == HUGE_VAL ? x : logarithm_of(x, 0.0);
}

double moit_log1p(double x) {
    if (!(x > -1.0)) return x == -1.0 ? -HUGE_VAL : x < -1.0 ? (double)NAN : x;
    if (fabs(x) < 0x1p-54 || x == HUGE_VAL) return x;
    if (x > 0x1p100) return logarithm_of(x, 0.0);
    pair sum = exact_sum(K(1.0), K(x));
    return logarithm_of(sum.high[0], sum.low[0]);
}

/* ---- sine and cosine ------------------------------------------------------------------------- */

typedef struct {
    pair sine, cosine;
} circle_pairs;

/* They are asked for constants only: the whole series is of pairs. */
static circle_pairs circle_of(double x) {
    enum { TERMS = 12 };
    const double high = 1.57079632673412561417, low = 6.07710050650619224932e-11;
    double quarters = rint(x * 0.63661977236758134308);
    pair r = pair_difference(pair_of(K(x - quarters * high)), exact_product(K(quarters), K(low)));
    pair square = pair_product(r, r), one = pair_of(K(1.0)), sine = one, cosine = one;
    for (int k = TERMS; k > 0; --k) {
        pair of_sine = pair_quotient(square, pair_of(K(2.0 * k * (2 * k + 1))));
        pair of_cosine = pair_quotient(square, pair_of(K(2.0 * k * (2 * k - 1))));
        sine = pair_difference(one, pair_product(sine, of_sine));
        cosine = pair_difference(one, pair_product(cosine, of_cosine));
    }
    sine = pair_product(sine, r);
    pair zero = pair_of(K(0.0)), minus_sine = pair_difference(zero, sine),
         minus_cosine = pair_difference(zero, cosine);
    switch ((int)quarters & 3) {
    case 0: return (circle_pairs){sine, cosine};
    case 1: return (circle_pairs){cosine, minus_sine};
    case 2: return (circle_pairs){minus_sine, minus_cosine};
    default: return (circle_pairs){minus_cosine, sine};
    }
}

double moit_sin(double x) { return circle_of(x).sine.high[0]; }

double moit_cos(double x) { return circle_of(x).cosine.high[0]; }

double moit_tan(double x) {
    circle_pairs p = circle_of(x);
    return pair_quotient(p.sine, p.cosine).high[0];
}
