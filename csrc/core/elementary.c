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

/* 2^n, a normal number. */
static double power(int n) {
    uint64_t bits_of = (uint64_t)(1023 + n) << 52;
    double x;
    memcpy(&x, &bits_of, sizeof x);
    return x;
}

/* r^3 (1/3! + r/4! + r^2/5! + ...): two chains, of even and of odd powers, do not wait for each
 * other. */
static double terms_from_third(double r, double square) {
    enum { PAIRS = 7 };
    static const double even[PAIRS] = {1.0 / 6.0,         1.0 / 120.0,      1.0 / 5040.0,
                                       1.0 / 362880.0,    1.0 / 39916800.0, 1.0 / 6227020800.0,
                                       1.0 / 1307674368e3},
                        odd[PAIRS] = {1.0 / 24.0,         1.0 / 720.0,       1.0 / 40320.0,
                                      1.0 / 3628800.0,    1.0 / 479001600.0, 1.0 / 87178291200.0,
                                      1.0 / 20922789888e3};
    double of_even = even[PAIRS - 1], of_odd = odd[PAIRS - 1];
    for (int k = PAIRS - 2; k >= 0; --k) {
        of_even = even[k] + square * of_even;
        of_odd = odd[k] + square * of_odd;
    }
    return square * r * (of_even + r * of_odd);
}

/* first + r + half + rest, each part smaller than the one before unless `first` is 0. */
static double sum_of(double first, double r, double half, double rest, double *low) {
    double sum = first + r, both = sum + half;
    *low = (r - (sum - first)) + ((half - (both - sum)) + rest);
    return both;
}

/* exp(x) = 2^n (1 + rest) by its n, with high + low = first + rest; |rest| is below 0.42. */
static int power_of(double x, double first, double *high, double *low) {
    double n = rint(x * 1.4426950408889634), most = x - n * ln2_high, away = n * ln2_low;
    double r = most - away, r_low = (most - r) - away;
    pair square = exact_product(K(r), K(r));
    double rest = r_low + r * r_low + 0.5 * square.low[0] + terms_from_third(r, square.high[0]);
    *high = sum_of(first, r, 0.5 * square.high[0], rest, low);
    return (int)n;
}

double moit_exp(double x) {
    if (x != x) return x;
    if (x > 710.0) return HUGE_VAL;
    if (x < -746.0) return 0.0;
    double high, low;
    int n = power_of(x, 1.0, &high, &low);
    double scaled = high + low;
    return n > -1000 && n < 1000 ? scaled * power(n) : ldexp(scaled, n);
}

double moit_expm1(double x) {
    if (fabs(x) < 0x1p-54) return x;
    if (!(x < 700.0)) return moit_exp(x);
    if (x < -40.0) return -1.0;
    double high, low;
    int n = power_of(x, 0.0, &high, &low);
    real scale = K(power(n));
    pair rest;
    rest.high = scale * high;
    rest.low = scale * low;
    return pair_sum(exact_sum(scale, K(-1.0)), rest).high[0];
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
