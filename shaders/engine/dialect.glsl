// The dialect of the kernels (csrc/kernels/README.md) in floats alone: those that need no digits
// beyond floats are read as they stand.
#define number float
#define real float
#define truth bool
#define FN
#define PRECISE
#define STRUCT(name) struct name
#define K(x) float(x)
#define U(x) uint(x)
#define BY_PRECISION(single, twice) single
#define BOTH(s, t) (s && t)
#define select(t, a, b) (t ? a : b)

#define nearest_integer(x) floor(x + 0.5)
#define whole_below(x) floor(x)
#define exponential(x) exp2(1.44269504 * (x))
#define logarithm(x) (log2(x) * 0.69314718)
#define within(x, most) clamp(x, 0.0, most)
#define float_bits(x) floatBitsToUint(x)
#define low_bits(x) floatBitsToUint(x)
#define high_bits(x) 0u
#define rounded_to_float(x) x
#define one_where(t) (t ? 1u : 0u)
#define share_of(h) (float(h >> 8) * 5.9604644775390625e-8)
#define rounded_to_half(value) unpackHalf2x16(packHalf2x16(vec2(value, 0.0))).x
#define unorm16_word(x) floor((x) * 65535.0 + 0.5)
#define unorm16_value(word) ((word) / 65535.0)
