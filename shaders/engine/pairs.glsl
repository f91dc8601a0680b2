// Numbers as unevaluated sums h + l of two floats, where small differences of large numbers are
// wanted. l may come to be as large as h, or all there is; what is divided by is made normal first.
// Dekker, "A floating-point technique for extending the available precision", 1971; Knuth, TAOCP 2.
//
// `precise` is on every local whose rounding another line takes up: compilers may neither regroup
// it nor drop it. No fused() takes another, or a product, with a factor in common: glslang does not
// say of fma that it is precise, and Mesa makes fma(a, b, fma(a, c, d)) of it fma(a, b + c, d).
//
// NOT_FUSED  1 where fma(a, b, c) rounds twice, which GLSL allows: ask at start whether
//            fma(x, x, -x * x) is 0 for x = 1 + 2^-12 from a buffer (see probe.glsl).
#ifndef NOT_FUSED
#define NOT_FUSED 0
#endif

struct float_pair { float h; float l; };

float_pair pair_of(float h, float l) {
    float_pair o;
    o.h = h;
    o.l = l;
    return o;
}

float_pair normal_pair(float_pair x) {
    precise float s = x.h + x.l, kept = s - x.h, lost = x.l - kept;
    return pair_of(s, lost);
}

float fused(float a, float b, float c) { return fma(a, b, c); }

#if NOT_FUSED
float upper_half(float x) {
    precise float much = x * 4097.0, rest = much - x, o = much - rest;
    return o;
}

// a - q b, where that is small beside a.
float remainder_of(float a, float q, float b) {
    precise float x = upper_half(q), y = upper_half(b), c = q - x, d = b - y, h = q * b;
    precise float e = x * y - h, o = a - h;
    e = e + x * d;
    e = e + c * y;
    e = e + c * d;
    o = o - e;
    return o;
}
#else
float remainder_of(float a, float q, float b) {
    precise float o = fused(-q, b, a);
    return o;
}
#endif

// a / b for a normal b; r is 1 / b.h.
float_pair ratio(float_pair a, float_pair b, float r) {
    precise float q = a.h * r, left = remainder_of(a.h, q, b.h), of_low = fused(-q, b.l, a.l);
    left = left + of_low;
    precise float l = left * r;
    return pair_of(q, l);
}

// What is left of c - x y beside s = c.h - h, h being x.h y.h rounded; taken: c.h - s.
float low_of(float_pair c, float_pair x, float_pair y, float taken) {
    precise float both = y.h + y.l, t = fused(-x.l, both, c.l), l = remainder_of(taken, x.h, y.h);
    t = fused(-x.h, y.l, t);
    l = l + t;
    return l;
}

// c - x y.
float_pair reduced(float_pair c, float_pair x, float_pair y) {
    precise float h = x.h * y.h, s = c.h - h, taken = c.h - s, kept = s + taken, lost = c.h - kept;
    precise float l = lost + low_of(c, x, y, taken);
    return pair_of(s, l);
}

// c - x y where |c| >= |x y|, as it is for moments c of even order (Lyapunov's inequality).
float_pair reduced_even(float_pair c, float_pair x, float_pair y) {
    precise float h = x.h * y.h, s = c.h - h, taken = c.h - s;
    return pair_of(s, low_of(c, x, y, taken));
}

// The same as a float, to its last digits.
float reduced_last(float_pair c, float_pair x, float_pair y) { return low_of(c, x, y, c.h); }
