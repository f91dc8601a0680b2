/* The core's own elementary functions against long doubles', which have more digits. */
#include "core/elementary.h"
#include "expect.h"

enum { TRIES = 20000 };
/* Of a nearest double half a unit in the last place; the rest is what the functions may lose. */
#define UNITS 0.512
#define UNITS_OF_EXPM1 0.6
#define UNITS_OF_CIRCLE 0.65
#define UNITS_OF_ERF 1.7
#define UNITS_OF_ERFC 3.3

typedef double function(double);
typedef long double reference(long double);

static double units_off(double found, long double exact) {
    double unit = ldexp(1.0, ilogb((double)exact) - 52);
    return (double)(fabsl((long double)found - exact) / (long double)unit);
}

/* x from `low` to `high`, and, `small`, those that are 1 to 2^-64 of that. */
static double worst_of(function *ours, reference *exact, double low, double high, bool small) {
    uint64_t state = 3;
    double worst = 0.0;
    for (int i = 0; i < TRIES; ++i) {
        double x = low + (high - low) * next_random(&state);
        if (small) x = ldexp(x, -(i % 64));
        if (x != 0.0 && exact((long double)x) != 0.0L)
            worst = fmax(worst, units_off(ours(x), exact((long double)x)));
    }
    return worst;
}

static void is_near(function *ours, reference *exact, double low, double high, bool small) {
    EXPECT_NEAR(worst_of(ours, exact, low, high, small), 0.0, UNITS);
}

static void powers_of_two_are_exact(void) {
    for (int n = -1074; n <= 1023; ++n) EXPECT(moit_exp2(n) == ldexp(1.0, n));
}

static void several_are_each(void) {
    double x[] = {0.0, -0.5, -800.0, 800.0, 3.0, NOT_A_NUMBER}, all[6];
    moit_exps(6, x, all);
    for (int i = 0; i < 6; ++i) {
        double one = moit_exp(x[i]);
        EXPECT(all[i] == one || (isnan(all[i]) && isnan(one)));
    }
}

static void limits_are_those_of_the_standard(void) {
    static const double x[] = {0.0,       -0.0,     1.0,       -1.0,        -2.0,  1e-310,
                               0x1p-1074, 1e300,    -1e300,    -745.2,      709.7, 710.0,
                               -750.0,    INFINITE, -INFINITE, NOT_A_NUMBER};
    static function *const ours[] = {moit_exp,  moit_expm1, moit_log, moit_log1p,
                                     moit_exp2, moit_erf,   moit_erfc},
                           *const theirs[] = {exp, expm1, log, log1p, exp2, erf, erfc};
    for (size_t i = 0; i < sizeof x / sizeof *x; ++i)
        for (size_t f = 0; f < sizeof ours / sizeof *ours; ++f) {
            double found = ours[f](x[i]), needed = theirs[f](x[i]);
            bool is_same = isnan(needed)
                               ? isnan(found)
                               : found == needed || units_off(found, (long double)needed) <= 1.0;
            EXPECT(is_same && (isnan(needed) || signbit(found) == signbit(needed)));
        }
}

/* Where one interval of a table, or one series, leaves off and the next begins. */
static void ends_of_intervals_are_near(void) {
    for (int k = -81; k <= 48; ++k) {
        double end = 1.0 + (k + 0.5) / (k < 0 ? 256.0 : 128.0), part = 0x1p-12;
        is_near(moit_log, logl, end - part, end + part, false);
        is_near(moit_log1p, log1pl, end - 1.0 - part, end - 1.0 + part, false);
    }
    for (int sign = -1; sign <= 1; sign += 2) {
        is_near(moit_log1p, log1pl, sign * 0x1.fp-9, sign * 0x1.1p-8, false);
        EXPECT_NEAR(worst_of(moit_expm1, expm1l, sign * 0x1.fp-5, sign * 0x1.1p-4, false), 0.0,
                    UNITS_OF_EXPM1);
        is_near(moit_exp, expl, sign * 699.0, sign * 701.0, false);
        is_near(moit_exp, expl, sign * 0.0026, sign * 0.0028, false);
    }
}

int main(void) {
    is_near(moit_exp, expl, -700.0, 700.0, false);
    is_near(moit_exp, expl, -40.0, 0.0, true);
    is_near(moit_exp2, exp2l, -40.0, 40.0, true);
    is_near(moit_log, logl, 0.0, 2.0, false);
    is_near(moit_log, logl, 0.0, 1e300, true);
    is_near(moit_log1p, log1pl, -1.0, 0.0, true);
    is_near(moit_log1p, log1pl, 0.0, 1e20, true);
    EXPECT_NEAR(worst_of(moit_expm1, expm1l, -40.0, 40.0, true), 0.0, UNITS_OF_EXPM1);
    EXPECT_NEAR(worst_of(moit_expm1, expm1l, -2.0, 2.0, false), 0.0, UNITS_OF_EXPM1);
    EXPECT_NEAR(worst_of(moit_sin, sinl, -13.0, 13.0, false), 0.0, UNITS_OF_CIRCLE);
    EXPECT_NEAR(worst_of(moit_cos, cosl, -13.0, 13.0, false), 0.0, UNITS_OF_CIRCLE);
    EXPECT_NEAR(worst_of(moit_tan, tanl, 0.0, 1.0, true), 0.0, UNITS_OF_CIRCLE);
    EXPECT_NEAR(worst_of(moit_erf, erfl, -6.0, 6.0, false), 0.0, UNITS_OF_ERF);
    EXPECT_NEAR(worst_of(moit_erf, erfl, -1.0, 1.0, true), 0.0, UNITS_OF_ERF);
    EXPECT_NEAR(worst_of(moit_erfc, erfcl, -6.0, 26.0, false), 0.0, UNITS_OF_ERFC);
    EXPECT_NEAR(worst_of(moit_erfc, erfcl, -1.0, 1.0, true), 0.0, UNITS_OF_ERFC);
    ends_of_intervals_are_near();
    powers_of_two_are_exact();
    several_are_each();
    limits_are_those_of_the_standard();
    return verdict();
}
