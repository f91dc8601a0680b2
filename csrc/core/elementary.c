/* One number at a time of what elementary_lanes.h does in lanes. */
#include "core/elementary.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

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

void moit_exps(int n, const double *x, double *out) {
    int i = 0;
    for (; i + LANES <= n; i += LANES) {
        bool are_usual = true;
        for (int k = 0; k < LANES; ++k) are_usual &= fabs(x[i + k]) < 690.0;
        if (!are_usual) {
            for (int k = 0; k < LANES; ++k) out[i + k] = moit_exp(x[i + k]);
            continue;
        }
        real both, exponent;
        memcpy(&both, x + i, sizeof both);
        pair whole = power_of(both, 1.0, &exponent);
        both = (whole.high + whole.low) * times_power_of_two(K(1.0), exponent);
        memcpy(out + i, &both, sizeof both);
    }
    for (; i < n; ++i) out[i] = moit_exp(x[i]);
}

double moit_exp2(double x) {
    if (!(fabs(x) < 3000.0)) return moit_exp(x);
    double whole = rint(x);
    const double ln2 = 0.69314718055994530942, ln2_rest = 2.3190468138462996e-17;
    pair of_two = exact_product(K(x - whole), K(ln2));
    double power = moit_exp(of_two.high[0]);
    return ldexp(power + power * (of_two.low[0] + (x - whole) * ln2_rest), (int)whole);
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

/* ---- the error function ---------------------------------------------------------------------- */

/* (1 + 2 x) exp(x^2) erfc(x) for x >= 0 is smooth in t = (x - 3.75) / (x + 3.75) (Shepherd and
 * Laframboise, Chebyshev approximation of (1 + 2x) exp(x^2) erfc(x) in 0 <= x < infinity, 1981, who
 * chose 3.75): its series of Chebyshev polynomials up to the 25th, which mpmath gave, as a
 * polynomial, by even and odd powers. */
static const double even_powers[] = {
    1.23751263083782758,      0.00358541548546442937,    -0.108803930141748857,
    -0.0586933985896367741,   -0.00974657955802927553,   0.00029371366559134482,
    0.0000516490988926824034, -0.0000114441462377005234, 1.75163764884906214e-6,
    -2.58668507161558854e-7,  3.86753342422223568e-8,    -5.17399021401130963e-9,
    4.25147144479638978e-10,
};
static const double odd_powers[] = {
    -0.140240598585547018,    0.082276738490151024,    0.0923043211601983343,
    0.0283622774215155971,    0.00175562583242175281,  -0.00029015397928986766,
    0.0000223839120365506791, -9.72849582211122029e-7, -5.82628107880077709e-8,
    2.42897629254887074e-8,   -4.38928415998632839e-9, 5.45715730470468791e-10,
    -3.75315827795962034e-11,
};

/* erfc(x), x >= 0. */
static double tail_from(double x) {
    enum { PAIRS = sizeof even_powers / sizeof *even_powers };
    if (x > 28.0) return 0.0;
    double t = (x - 3.75) / (x + 3.75), t_square = t * t;
    double of_even = even_powers[PAIRS - 1], of_odd = odd_powers[PAIRS - 1];
    for (int k = PAIRS - 2; k >= 0; --k) {
        of_even = even_powers[k] + t_square * of_even;
        of_odd = odd_powers[k] + t_square * of_odd;
    }
    double scaled = of_even + t * of_odd;
    pair square = exact_product(K(x), K(x));
    return moit_exp(-square.high[0]) * (scaled - square.low[0] * scaled) / (1.0 + 2.0 * x);
}

/* Near 0 by 2 / sqrt(pi) x exp(-x^2) (1 + 2 x^2 / 3 + (2 x^2)^2 / (3 5) + ...). */
double moit_erf(double x) {
    enum { TERMS = 20 };
    if (x != x) return x;
    if (fabs(x) >= 1.0) return copysign(1.0 - tail_from(fabs(x)), x);
    double square = x * x, series = 1.0;
    for (int k = TERMS; k > 0; --k) series = 1.0 + series * (square * (2.0 / (2 * k + 1)));
    return 1.12837916709551257390 * x * moit_exp(-square) * series;
}

double moit_erfc(double x) {
    if (x != x) return x;
    if (fabs(x) < 0.5) return 1.0 - moit_erf(x);
    return x < 0.0 ? 2.0 - tail_from(-x) : tail_from(x);
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
