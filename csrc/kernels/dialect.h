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

/* Four doubles whatever the table, so that sums run in one order for all. */
typedef double quad __attribute__((vector_size(32)));
typedef quad quad_number;
#define QUAD(x) ((quad){0} + (double)(x))

enum {
    DOUBLE = sizeof(SCALAR) == 8,
    MANTISSA = DOUBLE ? 52 : 23,
    EXPONENT_BIAS = DOUBLE ? 1023 : 127,
};

#define K(x) ((real){0} + (SCALAR)(x))
/* A constant with a value for each precision: what float needs, what double needs. */
#define BY_PRECISION(single, twice) (DOUBLE ? (twice) : (single))

#define BOTH(s, t) ((s) & (t)) /* of two truths */
#define EVERYWHERE (K(0.0) == 0.0)

FN real select(truth t, real a, real b) { return (real)((t & (truth)a) | (~t & (truth)b)); }
FN real real_abs(real x) {
    const bits all_but_sign = (bits)(((uint64_t)1 << (8 * sizeof(bits) - 1)) - 1);
    return (real)((truth)x & ((truth){0} + all_but_sign));
}
/* Minimum, maximum and square root are one instruction each, which GCC does not find by itself. A
 * unit for one target says how wide its vectors are with VECTOR_BYTES and gets them spelled out.
 * The second operand comes back where neither is less, as select does. */
/* Leaves a loop once no lane needs another turn. Each lane must keep its result from then on when
 * it needs none itself (select), or its bits would depend on its neighbours. */
#define BREAK_UNLESS(t) \
    if (!any_lane(t)) break
FN int any_lane(truth t) {
#if defined(VECTOR_BYTES) && VECTOR_BYTES == 64 && defined(__GNUC__) && !defined(__clang__)
    typedef int x86_int __attribute__((vector_size(64)));
    typedef long long x86_long __attribute__((vector_size(64)));
    return DOUBLE ? __builtin_ia32_cvtq2mask512((x86_long)t) != 0
                  : __builtin_ia32_cvtd2mask512((x86_int)t) != 0;
#else
    bits lanes[LANES], all = 0;
    memcpy(lanes, &t, sizeof t);
    for (int i = 0; i < LANES; ++i) all |= lanes[i];
    return all != 0;
#endif
}

#if defined(VECTOR_BYTES) && defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
typedef float x86_float __attribute__((vector_size(VECTOR_BYTES)));
typedef double x86_double __attribute__((vector_size(VECTOR_BYTES)));
#if VECTOR_BYTES == 64
#define X86_SPELLED(name, of_float, of_double) \
    FN real name(real a, real b) { \
        x86_float fa = (x86_float)a, fb = (x86_float)b; \
        x86_double da = (x86_double)a, db = (x86_double)b; \
        return DOUBLE ? (real)of_double##512_mask(db, da, da, -1, 4) \
                      : (real)of_float##512_mask(fb, fa, fa, -1, 4); \
    }
FN real real_sqrt(real x) {
    return DOUBLE ? (real)__builtin_ia32_sqrtpd512_mask((x86_double)x, (x86_double)x, -1, 4)
                  : (real)__builtin_ia32_sqrtps512_mask((x86_float)x, (x86_float)x, -1, 4);
}
#else
#if VECTOR_BYTES == 32
#define X86_WIDTH 256
#else
#define X86_WIDTH
#endif
#define X86_SPELLED(name, of_float, of_double) X86_SPELLED_(name, of_float, of_double, X86_WIDTH)
#define X86_SPELLED_(name, of_float, of_double, width) \
    FN real name(real a, real b) { \
        return DOUBLE ? (real)JOIN(of_double, width)((x86_double)b, (x86_double)a) \
                      : (real)JOIN(of_float, width)((x86_float)b, (x86_float)a); \
    }
FN real real_sqrt(real x) {
    return DOUBLE ? (real)JOIN(__builtin_ia32_sqrtpd, X86_WIDTH)((x86_double)x)
                  : (real)JOIN(__builtin_ia32_sqrtps, X86_WIDTH)((x86_float)x);
}
#endif
#ifdef FUSED /* a b - c in doubles, rounded once: for units whose target has it */
#if VECTOR_BYTES == 64
#define FUSED_DIFFERENCE(a, b, c) \
    (real) __builtin_ia32_vfmaddpd512_mask((x86_double)(a), (x86_double)(b), (x86_double)(-(c)), \
                                           -1, 4)
#else
#define FUSED_DIFFERENCE(a, b, c) \
    (real) __builtin_ia32_vfmaddpd256((x86_double)(a), (x86_double)(b), (x86_double)(-(c)))
#endif
#endif
X86_SPELLED(real_min, __builtin_ia32_minps, __builtin_ia32_minpd)
X86_SPELLED(real_max, __builtin_ia32_maxps, __builtin_ia32_maxpd)
#else
FN real real_min(real a, real b) { return select(b < a, b, a); }
FN real real_max(real a, real b) { return select(a < b, b, a); }
FN real real_sqrt(real x) {
    for (int i = 0; i < LANES; ++i)
        x[i] = _Generic((SCALAR)0, float : __builtin_sqrtf, double : __builtin_sqrt)(x[i]);
    return x;
}
#endif
FN real real_clamp(real x, real lo, real hi) { return real_min(real_max(x, lo), hi); }

/* Bits to count with: what no lane should hold, as numbers were changed meanwhile, wraps. */
typedef __typeof__(_Generic((bits)0, int32_t : (uint32_t)0, int64_t : (uint64_t)0)) plain_bits;
typedef plain_bits plain_lanes __attribute__((vector_size(LANES * sizeof(SCALAR))));

/* The integer n for which x / 2^n lies in [sqrt(1/2), sqrt(2)), for positive normal x. */
FN real exponent_of(real x) {
    plain_lanes half = (plain_lanes)K(0.70710678118654752);
    truth n = (truth)((plain_lanes)x - half) >> MANTISSA;
    return __builtin_convertvector(n, real);
}

/* x 2^n for an integer n; x and the result must be normal numbers. */
FN real times_power_of_two(real x, real n) {
    return (real)((plain_lanes)x + ((plain_lanes) __builtin_convertvector(n, truth) << MANTISSA));
}

/* The integer nearest to x, for |x| below 2^22: adding 1.5 2^MANTISSA leaves no room for a
 * fraction. */
FN real nearest_integer(real x) {
    const real shift = K(1.5 * (double)(1LL << MANTISSA));
    return (x + shift) - shift;
}

/* 2^n for the integer n with 2^n <= |x| < 2^(n + 1); 0 where x is 0 or not a normal number. */
FN real leading_power(real x) {
    const bits exponent = (bits)(((uint64_t)(DOUBLE ? 0x7ff : 0xff)) << MANTISSA);
    return (real)((truth)x & ((truth){0} + exponent));
}

/* Unsigned integers of 32 bits, in both precisions: as many as a `real` has lanes. */
typedef uint32_t uint_lanes __attribute__((vector_size(LANES * sizeof(uint32_t))));
typedef int32_t int_lanes __attribute__((vector_size(LANES * sizeof(int32_t))));
#define U(x) ((uint_lanes){0} + (uint32_t)(x))

FN uint_lanes one_where(truth t) { return (uint_lanes) __builtin_convertvector(t, int_lanes) & 1u; }

/* What a float holds of a number, and that float's bits. */
typedef float float_lanes __attribute__((vector_size(LANES * sizeof(float))));
FN real rounded_to_float(real x) {
    return __builtin_convertvector(__builtin_convertvector(x, float_lanes), real);
}
FN uint_lanes float_bits(real x) { return (uint_lanes) __builtin_convertvector(x, float_lanes); }

/* A number's bits from the lowest, and those above: none of a float. */
FN uint_lanes low_bits(real x) { return __builtin_convertvector((truth)x, uint_lanes); }
FN uint_lanes high_bits(real x) {
    return DOUBLE ? __builtin_convertvector((truth)x >> (DOUBLE ? 32 : 0), uint_lanes) : U(0u);
}

/* h / 2^32, of 24 bits in both precisions: below 1. */
FN real share_of(uint_lanes h) {
    return __builtin_convertvector((int_lanes)(h >> 8), real) * (SCALAR)0x1p-24;
}

/* Where weights of networks lie in memory, floats in both precisions, and the i-th from there. */
typedef const float *address;
#define NETWORK_NUMBER(from, i) ((SCALAR)(from)[i] - (real){0}) /* adding to 0 would be done */

/* A number of the at-th of texels of four floats, lane by lane. */
FN real texel_number(address from, real at, int channel) {
    real x;
    for (int i = 0; i < LANES; ++i) x[i] = (SCALAR)from[4 * (int64_t)at[i] + channel];
    return x;
}
#define TEXEL_NUMBER(from, at, channel) texel_number(from, at, channel)

/* From here on a text may use GLSL's own names. */
#define abs real_abs
#define clamp real_clamp
#define max real_max
#define min real_min
#define sqrt real_sqrt
#define uint uint_lanes

#endif
