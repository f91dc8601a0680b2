// Four moments as Moment Transparency packs them once a pixel (its section 4.2 and supplement 1.3),
// in words of 16 bits, which targets round to; SYMMETRIC as there.

// Four words; total absorbance.
struct factors { vec4 factor0; float factor1; };

#if STORAGE == 1
// Non-linearly quantised (Peters 2017): the nodes of the Gauss rule in the unit range of depth, the
// weight of the second, and the eighth root of what the fourth moment exceeds theirs by, of 64ths.
#if SYMMETRIC
const float EXTENT = 2.0;
const float LOW = -1.0;
#else
const float EXTENT = 1.0;
const float LOW = 0.0;
#endif

factors factor(sums t) {
    recurrence2 r = recurrence_of_sums(t.target0, t.target1);
    float R = sqrt(r.half_u * r.half_u + r.s1), first = r.half_u - R, second = r.half_u + R;
    float square = EXTENT * EXTENT, share = max(r.h, 0.0) * 64.0 / (square * square);
    vec2 places = (vec2(first, second) + (r.a0 - LOW)) / EXTENT;
    factors o;
    vec4 words = vec4(places, -0.5 * first / max(R, 1e-12), sqrt(sqrt(sqrt(share))));
    o.factor0 = clamp(words, vec4(0.0), vec4(1.0));
    o.factor1 = min(t.target1, 65504.0);
    return o;
}

// Nodes at one depth, a weight and an offset of 0 are kept from making the rule degenerate.
recurrence2 recurrence_packed(vec4 f) {
    float apart = max((f.y - f.x) * EXTENT, 1e-6), weight = clamp(f.z, 1e-6, 1.0 - 1e-6);
    float root = f.w * f.w, most = EXTENT * EXTENT * 0.125, share = root * root;
    recurrence2 r;
    r.a0 = apart * weight + (f.x * EXTENT + LOW);
    r.low = 0.0;
    r.half_u = (0.5 - weight) * apart;
    r.s1 = weight * (1.0 - weight) * (apart * apart);
    r.h = max(share * share * (most * most), 1e-24);
    r.half_s2 = 0.5 * r.h / r.s1;
    return r;
}
#else
// Linear in moments, so that surfaces fill the range of words (Peters and Klein 2015, of depth in
// [0, 1]; Peters et al. 2017, of [-1, 1]).
#include "engine/dialect.glsl"
#undef unorm16_word
#undef unorm16_value
#define unorm16_word(x) clamp(x, 0.0, 1.0)
#define unorm16_value(x) (x)
#include "kernels/moment_transparency.h"

factors factor(sums t) {
    vec4 b = t.target0 / max(t.target1, 1e-12);
    four m;
    m.x[0] = b.x;
    m.x[1] = b.y;
    m.x[2] = b.z;
    m.x[3] = b.w;
#if SYMMETRIC
    four w = symmetric_words(m);
#else
    four w = unit_words(m);
#endif
    factors o;
    o.factor0 = vec4(w.x[0], w.x[1], w.x[2], w.x[3]);
    o.factor1 = min(t.target1, 65504.0);
    return o;
}

recurrence2 recurrence_packed(vec4 f) {
    four w;
    w.x[0] = f.x;
    w.x[1] = f.y;
    w.x[2] = f.z;
    w.x[3] = f.w;
#if SYMMETRIC
    four m = symmetric_moments(w);
    vec2 safe = vec2(0.0, 0.628);
#else
    four m = unit_moments(w);
    vec2 safe = vec2(0.5, 0.5);
#endif
    float g = BIAS / (1.0 - BIAS);
    return recurrence2_of(pivot_of(vec2(1.0, g), 0.0), vec2(m.x[0], g * safe.x),
                          vec2(m.x[1], g * safe.y), vec2(m.x[2], g * safe.x),
                          vec2(m.x[3], g * safe.y), 1e-15, 1.0);
}
#endif

// What reaches z of depth as moments have it; beta: the share of what is there that counts.
float transmittance_at(factors f, float z, float beta, float alpha) {
    vec2 m = mass2_at(recurrence_packed(f.factor0), z);
    return transmittance_through(m.x, m.y, -1.44269504 * f.factor1, beta, alpha);
}
