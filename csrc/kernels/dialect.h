/* C's reading of the dialect spoken in this folder (README.md has it on a page).
 *
 * Included once per translation unit, after the unit has said what a number is:
 *   SCALAR   float or double
 *   LANES    how many of them a `real` holds
 * Lanes are GCC and Clang vector types: the compiler spells each operation for the target that
 * the unit asked for. Only what it spells badly (square root, select) is written by hand. */
#ifndef MOIT_DIALECT_H
#define MOIT_DIALECT_H

#include <stdint.h>
#include <string.h>

#define PRECISE /* C keeps the order of operations anyway */
#define FN static inline __attribute__((always_inline, unused))
#define STRUCT(name) \
    typedef struct name name; \
    struct name
#define JOIN_(a, b) a##b
#define JOIN(a, b) JOIN_(a, b)

/* A truth is all ones or all zeros, as wide as a number. */
typedef __typeof__(_Generic((SCALAR)0, float : (int32_t)0, double : (int64_t)0)) bits;
typedef SCALAR real __attribute__((vector_size(LANES * sizeof(SCALAR))));
typedef real number; /* in results and members: there GLSL has no `precise` */
typedef bits truth __attribute__((vector_size(LANES * sizeof(SCALAR))));

enum {
    DOUBLE = sizeof(SCALAR) == 8,
    MANTISSA = DOUBLE ? 52 : 23,
    EXPONENT_BIAS = DOUBLE ? 1023 : 127,
};

#define K(x) ((real){0} + (SCALAR)(x))
/* A constant with a value for each precision: what float needs, what double needs. */
#define BY_PRECISION(single, twice) (DOUBLE ? (twice) : (single))

#define BOTH(s, t) ((s) & (t)) /* of two truths */

FN real select(truth t, real a, real b) { return (real)((t & (truth)a) | (~t & (truth)b)); }
FN real real_abs(real x) {
    const bits all_but_sign = (bits)(((uint64_t)1 << (8 * sizeof(bits) - 1)) - 1);
    return (real)((truth)x & ((truth){0} + all_but_sign));
}
FN real real_min(real a, real b) { return select(b < a, b, a); }
FN real real_max(real a, real b) { return select(a < b, b, a); }
FN real real_clamp(real x, real lo, real hi) { return real_min(real_max(x, lo), hi); }

FN real real_sqrt(real x) {
#if defined(__AVX512F__)
    if (sizeof(real) == 64) {
        if (DOUBLE) {
            typedef double wide __attribute__((vector_size(64)));
            return (real)__builtin_ia32_sqrtpd512_mask((wide)x, (wide)x, -1, 4);
        }
        typedef float wide __attribute__((vector_size(64)));
        return (real)__builtin_ia32_sqrtps512_mask((wide)x, (wide)x, -1, 4);
    }
#endif
    for (int i = 0; i < LANES; ++i)
        x[i] = _Generic((SCALAR)0, float : __builtin_sqrtf, double : __builtin_sqrt)(x[i]);
    return x;
}

/* The integer n for which x / 2^n lies in [sqrt(1/2), sqrt(2)), for positive normal x. */
FN real exponent_of(real x) {
    truth half = (truth)K(0.70710678118654752);
    truth n = ((truth)x - half) >> MANTISSA;
    return __builtin_convertvector(n, real);
}

/* x 2^n for an integer n; x and the result must be normal numbers. */
FN real times_power_of_two(real x, real n) {
    return (real)((truth)x + (__builtin_convertvector(n, truth) << MANTISSA));
}

/* The integer nearest to x, for |x| below 2^22: adding 1.5 2^MANTISSA leaves no room for a fraction. */
FN real nearest_integer(real x) {
    const real shift = K(1.5 * (double)(1LL << MANTISSA));
    return (x + shift) - shift;
}

/* From here on a text may use GLSL's own names. */
#define abs real_abs
#define clamp real_clamp
#define max real_max
#define min real_min
#define sqrt real_sqrt

#endif
