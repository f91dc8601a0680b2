// GLSL's reading of the dialect spoken in this folder (README.md has it on a page).
//
// A pass is compiled with DOUBLE defined as 0 or 1: whether `real` is float or double. Where it is
// double, moit.shaders.source has written the suffix of doubles behind every literal, as GLSL has
// no other way to spell them.

#ifndef DOUBLE
#error DOUBLE must be 0 or 1
#endif
#if DOUBLE
#define number double
#define BY_PRECISION(single, twice) (twice)
#else
#define number float
#define BY_PRECISION(single, twice) (single)
#endif
#define PRECISE precise // no order of operations but that which is written
#define real PRECISE number
#define truth bool

#define FN
#define STRUCT(name) struct name
#define NAMED(name) name // a shader knows one count of nodes
#define K(x) number(x)
#define EVERYWHERE true
#define BREAK_UNLESS(t) \
    if (!(t)) break
#define BOTH(s, t) ((s) && (t))
#define select(t, a, b) ((t) ? (a) : (b))

// The functions that look into a number, bit by bit as C does.

// The integer n for which x / 2^n lies in [sqrt(1/2), sqrt(2)), for positive normal x.
FN number exponent_of(real x) {
#if DOUBLE
    uvec2 word = unpackDouble2x32(x);
    int borrow = word.x < 0x667f3bcdu ? 1 : 0;
    return number((int(word.y) - 0x3fe6a09e - borrow) >> 20);
#else
    return number((floatBitsToInt(x) - 0x3f3504f3) >> 23);
#endif
}

// x 2^n for an integer n; x and the result must be normal numbers.
FN number times_power_of_two(real x, real n) {
#if DOUBLE
    uvec2 word = unpackDouble2x32(x);
    return packDouble2x32(uvec2(word.x, word.y + (uint(int(n)) << 20)));
#else
    return intBitsToFloat(floatBitsToInt(x) + (int(n) << 23));
#endif
}

// 2^n for the integer n with 2^n <= |x| < 2^(n + 1); 0 where x is 0 or not a normal number.
FN number leading_power(real x) {
#if DOUBLE
    return packDouble2x32(uvec2(0u, unpackDouble2x32(x).y & 0x7ff00000u));
#else
    return uintBitsToFloat(floatBitsToUint(x) & 0x7f800000u);
#endif
}

// As C has it: llvmpipe's roundEven takes the double just below 0.5 for 1.
FN number nearest_integer(real x) {
    real shift = number(BY_PRECISION(12582912.0, 6755399441055744.0)); // 1.5 2^23, 1.5 2^52
    real shifted = x + shift;
    return shifted - shift;
}
