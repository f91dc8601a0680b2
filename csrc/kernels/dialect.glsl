// GLSL's reading of the dialect spoken in this folder (README.md has it on a page).
//
// A pass is compiled with DOUBLE defined as 0 or 1: whether `real` is float or double. Where it is
// double, moit.gpu.texts.source has written the suffix of doubles behind every literal, as GLSL has
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
#define quad PRECISE double // whatever numbers are
#define quad_number double
#define QUAD(x) double(x) // of an int, or a literal that float holds

#define FN
#define STRUCT(name) struct name
#define NAMED(name) name // a shader knows one count of nodes
#define K(x) number(x)
#define U(x) uint(x)
#define EVERYWHERE true
#define BREAK_UNLESS(t) \
    if (!(t)) break
#define BOTH(s, t) ((s) && (t))
#define select(t, a, b) ((t) ? (a) : (b))

#include "kernels/dialect_numbers.glsl"

// 1 where t holds, else 0.
FN uint one_where(truth t) { return t ? 1u : 0u; }

// h / 2^32, of 24 bits in both precisions: below 1.
FN number share_of(uint h) { return number(int(h >> 8)) * K(5.9604644775390625e-8); }

// Where weights of networks lie in the buffer `network`, and the i-th from there.
#define address int
#define NETWORK_NUMBER(from, i) number(network[(from) + (i)])
