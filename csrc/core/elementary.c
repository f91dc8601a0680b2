/* Exponentials, logarithms and error functions, one number at a time and by tables: a whole number
 * of small steps, and a short series of what is left (Tang, Table-driven implementation of the
 * exponential function in IEEE floating-point arithmetic, 1989; of the logarithm function, 1990).
 * Lanes have their own, kernels/elementary.h. */
#include "core/elementary.h"
#include "core/elementary_tables.h"

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

enum { MANTISSA_BITS = 52, STEP_BITS = MANTISSA_BITS - 7 }; /* an octave has 2^7 INTERVALS */

static uint64_t bits_of(double x) {
    uint64_t bits;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}

static double of_bits(uint64_t bits) {
    double x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

/* x 2^n; x and the result must be normal numbers. */
static double scaled(double x, int64_t n) {
    return of_bits(bits_of(x) + ((uint64_t)n << MANTISSA_BITS));
}

/* a + b less what it is rounded to. */
static double lost_by_sum(double a, double b) {
    double sum = a + b, of_b = sum - a;
    return (a - (sum - of_b)) + (b - of_b);
}

/* ---- exp ------------------------------------------------------------------------------------ */

/* 2^n power (1 + rest), |rest| below 0.003. */
typedef struct {
    int64_t n;
    double power, rest;
} split_power;

/* Of so many steps of ln 2 / 128, and exp(r) - 1. */
static split_power power_of_steps(int64_t steps, double r) {
    double square = r * r;
    double series = (0.5 + r * (1.0 / 6.0)) + square * (1.0 / 24.0 + r * (1.0 / 120.0));
    int64_t k = steps & (INTERVALS - 1);
    return (split_power){(steps - k) / INTERVALS, powers[k].power,
                         r + (powers[k].rest + square * series)};
}

/* The integer nearest to x, |x| below 2^51, as both. */
typedef struct {
    int64_t whole;
    double number;
} integer;

static integer nearest(double x) {
    const double shift = 0x1.8p52; /* leaves no room for a fraction */
    double shifted = x + shift;
    return (integer){(int64_t)(bits_of(shifted) - bits_of(shift)), shifted - shift};
}

static split_power exp_in_parts(double x) {
    integer steps = nearest(x * steps_of_1);
    return power_of_steps(steps.whole, (x - steps.number * step_high) - steps.number * step_low);
}

static double joined(split_power p) {
    double power = scaled(p.power, p.n); /* does not wait for the rest */
    return power + power * p.rest;
}

/* Where 2^n may be no normal number. */
static double joined_far(split_power p) { return ldexp(p.power + p.power * p.rest, (int)p.n); }

static double exp_far(double x) {
    if (x != x) return x;
    if (x > 710.0) return HUGE_VAL;
    return x < -746.0 ? 0.0 : joined_far(exp_in_parts(x));
}

static inline double exp_of(double x) {
    return fabs(x) < 700.0 ? joined(exp_in_parts(x)) : exp_far(x);
}

double moit_exp(double x) { return exp_of(x); }

void moit_exps(int n, const double *x, double *out) {
    for (int i = 0; i < n; ++i) out[i] = exp_of(x[i]);
}

double moit_exp2(double x) {
    if (!(fabs(x) < 3000.0)) return exp_far(x);
    integer steps = nearest(x * INTERVALS);
    double beyond = x * INTERVALS - steps.number;
    split_power p = power_of_steps(steps.whole, beyond * (step_high + step_low));
    return fabs(x) < 1000.0 ? joined(p) : joined_far(p);
}

/* exp(x) - 1 of few: by their series. */
static double series_less_one(double x) {
    double square = x * x, fourth = square * square;
    double low = (1.0 / 2.0 + x * (1.0 / 6.0)) + square * (1.0 / 24.0 + x * (1.0 / 120.0));
    double high = (1.0 / 720.0 + x * (1.0 / 5040.0))
                  + square * (1.0 / 40320.0 + x * (1.0 / 362880.0 + x * (1.0 / 3628800.0)));
    return x + square * (low + fourth * high);
}

double moit_expm1(double x) {
    if (fabs(x) < 0x1p-4) return x == 0.0 ? x : series_less_one(x);
    if (!(x < 700.0)) return exp_far(x);
    if (x < -40.0) return -1.0;
    split_power p = exp_in_parts(x);
    double power = scaled(p.power, p.n);
    return (power - 1.0) + (lost_by_sum(power, -1.0) + power * p.rest);
}

/* ---- log ------------------------------------------------------------------------------------ */

/* ln(1 + r) - r for |r| below 2^-7. */
static double series_beyond_first(double r) {
    double square = r * r;
    double low = (-1.0 / 2.0 + r * (1.0 / 3.0)) + square * (-1.0 / 4.0 + r * (1.0 / 5.0));
    double high = (-1.0 / 6.0 + r * (1.0 / 7.0)) + square * (-1.0 / 8.0);
    return square * (low + (square * square) * high);
}

/* ln(x + low) + away ln 2, for positive normal x and a low that is little beside it. x is 2^n z;
 * z is taken in two parts, as products with the few digits of `inverse` are exact then. */
static inline double logarithm(double x, double low, int away) {
    /* where the octave begins: half a step below its lowest whole interval */
    const uint64_t begin =
        bits_of(1.0) - (2 * INTERVALS_BELOW + 1) * ((uint64_t)1 << (STEP_BITS - 1));
    const uint64_t most_digits = ~(uint64_t)0 << 21;
    uint64_t above = bits_of(x) - begin;
    int64_t n = (int64_t)above >> MANTISSA_BITS;
    uint64_t k = (above >> STEP_BITS) & (INTERVALS - 1);
    double z = scaled(x, -n), z_high = of_bits(bits_of(z) & most_digits);
    double inverse = logarithms[k].inverse, whole = (double)(n + away);
    double most = z_high * inverse - 1.0, least = (z - z_high) * inverse;
    double r = most + least, rest = (most - r) + least;
    if (low != 0.0) rest += scaled(low, -n) * inverse * (1.0 - r);
    double first = whole * ln2_high + logarithms[k].high; /* exact, and greater than r or 0 */
    double sum = first + r;
    rest += ((first - sum) + r) + (whole * ln2_low + logarithms[k].low);
    return sum + (rest + series_beyond_first(r));
}

double moit_log(double x) {
    if (!(x > 0.0)) return x == 0.0 ? -HUGE_VAL : x < 0.0 ? (double)NAN : x;
    if (x < 0x1p-1022) return logarithm(x * 0x1p54, 0.0, -54);
    return x == HUGE_VAL ? x : logarithm(x, 0.0, 0);
}

double moit_log1p(double x) {
    if (fabs(x) < 0x1p-8) return x + series_beyond_first(x);
    if (!(x > -1.0)) return x == -1.0 ? -HUGE_VAL : x < -1.0 ? (double)NAN : x;
    if (x > 0x1p54) return moit_log(x);
    double sum = 1.0 + x;
    return logarithm(sum, lost_by_sum(1.0, x), 0);
}

/* ---- the error function ---------------------------------------------------------------------- */

/* erfc(x), x from 1/2 on. */
static double tail_from(double x) {
    if (x >= 28.0) return 0.0;
    const double *row = tails[(bits_of(x) - bits_of(0.5)) >> (MANTISSA_BITS - 3)];
    double h = x - row[0], h2 = h * h, h4 = h2 * h2;
    double low = (row[2] + h * row[3]) + h2 * (row[4] + h * row[5]);
    double high = (row[6] + h * row[7]) + h2 * (row[8] + h * row[9]);
    double all = row[1] + h * (low + h4 * (high + h4 * (row[10] + h * row[11])));
    double x_high = of_bits(bits_of(x) & ~(uint64_t)0 << 27), square = x * x;
    double lost = (x_high * x_high - square) + (x - x_high) * (x + x_high);
    split_power p = exp_in_parts(-square);
    p.power *= all;
    p.rest -= lost;
    return square < 700.0 ? joined(p) : joined_far(p);
}

enum { OF_NEAR = sizeof near / sizeof *near };

double moit_erf(double x) {
    if (x != x) return x;
    if (fabs(x) >= 1.0) return copysign(1.0 - tail_from(fabs(x)), x);
    double square = x * x, fourth = square * square, even = near[OF_NEAR - 1], odd = 0.0;
    for (int k = OF_NEAR - 2; k > 0; k -= 2) {
        odd = near[k] + fourth * odd;
        even = near[k - 1] + fourth * even;
    }
    return x + x * (even + square * odd);
}

double moit_erfc(double x) {
    if (x != x) return x;
    if (fabs(x) < 0.5) return 1.0 - moit_erf(x);
    return x < 0.0 ? 2.0 - tail_from(-x) : tail_from(x);
}
