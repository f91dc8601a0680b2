// Of GLSL's reading of the dialect what there is of each precision: dialect.glsl includes it, and a
// pass of floats may once more for doubles (shaders/arrays/begin_double.glsl).

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

// What a float holds of a number, and that float's bits.
FN number rounded_to_float(real x) { return number(float(x)); }
FN uint float_bits(real x) { return floatBitsToUint(float(x)); }

// A number's bits from the lowest, and those above: none of a float.
FN uint low_bits(real x) {
#if DOUBLE
    return unpackDouble2x32(x).x;
#else
    return floatBitsToUint(x);
#endif
}
FN uint high_bits(real x) {
#if DOUBLE
    return unpackDouble2x32(x).y;
#else
    return 0u;
#endif
}
