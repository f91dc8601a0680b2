// Numbers as unevaluated sums h + l of two floats, where small differences of large numbers are
// wanted. l may come to be as large as h, or all there is; what is divided by is made normal first.
// Dekker, "A floating-point technique for extending the available precision", 1971; Knuth, TAOCP 2.
//
// `precise` is on every local whose rounding another line takes up: compilers may neither regroup
// it nor drop it. No fused() takes another, or a product, with a factor in common: glslang does not
// say of fma that it is precise, and Mesa makes fma(a, b, fma(a, c, d)) of it fma(a, b + c, d).
#include "engine/storage.glsl"

// PLAIN  1: a pair is one float, and what is below is written out (storage.glsl).
#if PLAIN
#define pair float
#define HEAD(p) p
#define TAIL(p) 0.0
#define PAIR(h, l) h + l
#define ALONE(h) h
#define AS_WRITTEN
#define less_twice(a, b) a - 2.0 * b
#define less_both(a, b, c) a - b - c
#define pivot_of(x, least) max(x, least)
#define ratio(a, b, r) a * r
#define reduced(c, x, y) c - x * y
#define reduced_even(c, x, y) c - x * y
#define low_of(c, x, y, taken) c - x * y
#else
#define pair vec2
#define HEAD(p) p.x
#define TAIL(p) p.y
#define PAIR(h, l) vec2(h, l)
#define ALONE(h) vec2(h, 0.0)
#define AS_WRITTEN precise
#define less_twice(a, b) fused(-2.0, b.x, a.x) + fused(-2.0, b.y, a.y)
#define less_both(a, b, c) ((a.x - b.x) - c.x) + ((a.y - b.y) - c.y)

// NOT_FUSED  1 where fma(a, b, c) rounds twice, which GLSL allows: ask at start whether
//            fma(x, x, -x * x) is 0 for x = 1 + 2^-12 from a buffer (see probe.glsl).
#ifndef NOT_FUSED
#define NOT_FUSED 0
#endif

// What is divided by, made normal: not less than `least`, which is rounding alone.
vec2 pivot_of(vec2 x, float least) {
    precise float s = x.x + x.y, kept = s - x.x, lost = x.y - kept;
    return vec2(max(s, least), lost);
}

float fused(float a, float b, float c) { return fma(a, b, c); }

#if NOT_FUSED
// x cut off to 12 digits, which leaves 12: products of such halves are exact. No compiler sees
// through it, and it takes one instruction where rounding to 12 digits (x * 4097) takes three.
float upper_half(float x) { return uintBitsToFloat(floatBitsToUint(x) & 4294963200u); }

// a - q b, where that is small beside a.
float left_of(float a, float q, float b) {
    precise float x = upper_half(q), y = upper_half(b), c = q - x, d = b - y, h = q * b;
    precise float e = x * y - h, o = a - h;
    e = e + x * d;
    e = e + c * y;
    e = e + c * d;
    o = o - e;
    return o;
}
#else
float left_of(float a, float q, float b) {
    precise float o = fused(-q, b, a);
    return o;
}
#endif

// a / b for a normal b; r is 1 / b.h.
vec2 ratio(vec2 a, vec2 b, float r) {
    precise float q = a.x * r, left = left_of(a.x, q, b.x), of_low = fused(-q, b.y, a.y);
    left = left + of_low;
    precise float l = left * r;
    return vec2(q, l);
}

// What is left of c - x y beside s = c.h - h, h being x.h y.h rounded; taken: c.h - s. Where
// that is c.h: all of c - x y, as a float, to its last digits.
float low_of(vec2 c, vec2 x, vec2 y, float taken) {
    precise float both = y.x + y.y, t = fused(-x.y, both, c.y), l = left_of(taken, x.x, y.x);
    t = fused(-x.x, y.y, t);
    l = l + t;
    return l;
}

// c - x y.
vec2 reduced(vec2 c, vec2 x, vec2 y) {
    precise float h = x.x * y.x, s = c.x - h, taken = c.x - s, kept = s + taken, lost = c.x - kept;
    precise float l = lost + low_of(c, x, y, taken);
    return vec2(s, l);
}

// c - x y where |c| >= |x y|, as it is for moments c of even order (Lyapunov's inequality).
vec2 reduced_even(vec2 c, vec2 x, vec2 y) {
    precise float h = x.x * y.x, s = c.x - h, taken = c.x - s;
    return vec2(s, low_of(c, x, y, taken));
}
#endif
