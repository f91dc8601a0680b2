/* One number at a time of what elementary_lanes.h does in lanes. */
#include "core/elementary.h"

#include <math.h>

#define SCALAR double
#define LANES 2 /* of which the first is used: what pairs are made of is a vector */
#include "kernels/dialect.h"
#include "kernels/pairs.h"
#include "core/elementary_lanes.h"
#undef abs
#undef sqrt

/* ---- exp ------------------------------------------------------------------------------------ */

double moit_exp(double x) {
    if (x != x) return x;
    if (x > 710.0) return HUGE_VAL;
    if (x < -746.0) return 0.0;
    real n;
    pair whole = power_of(K(x), 1.0, &n);
    double scaled = whole.high[0] + whole.low[0];
    if (n[0] < -1000.0 || n[0] > 1000.0) return ldexp(scaled, (int)n[0]);
    return scaled * times_power_of_two(K(1.0), n)[0];
}

double moit_expm1(double x) {
    if (fabs(x) < 0x1p-54) return x;
    if (!(x < 700.0)) return moit_exp(x);
    if (x < -40.0) return -1.0;
    return power_less_one(K(x))[0];
}

/* ---- log ------------------------------------------------------------------------------------ */

static double logarithm(double x, double low) {
    /* neither it nor what makes it about 1 may be another than a normal number */
    double scale = x < 0x1p-1000 ? 0x1p200 : x > 0x1p1000 ? 0x1p-200 : 1.0;
    double away = x < 0x1p-1000 ? -200.0 : x > 0x1p1000 ? 200.0 : 0.0;
    return logarithm_of(K(x * scale), K(low * scale), K(away))[0];
}

double moit_log(double x) {
    if (!(x > 0.0)) return x == 0.0 ? -HUGE_VAL : x < 0.0 ? (double)NAN : x;
    return x == HUGE_VAL ? x : logarithm(x, 0.0);
}

double moit_log1p(double x) {
    if (!(x > -1.0)) return x == -1.0 ? -HUGE_VAL : x < -1.0 ? (double)NAN : x;
    if (fabs(x) < 0x1p-54 || x == HUGE_VAL) return x;
    if (x > 0x1p100) return logarithm(x, 0.0);
    pair sum = exact_sum(K(1.0), K(x));
    return logarithm(sum.high[0], sum.low[0]);
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
