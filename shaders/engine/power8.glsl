// Eight power moments of depth: Muenstermann, Krumpen, Klein and Peters, "Moment-Based
// Order-Independent Transparency", 2018 (MBOIT), in floats alone; see power6.glsl.
#include "engine/common.glsl"
#include "engine/pairs.glsl"
#include "engine/storage.glsl"
#include "engine/roots.glsl"
#include "engine/rules4.glsl"

// How much of a safe distribution outweighs rounding (MBOIT 4.1).
// Its even moments are V2 to V8; published biases are 5e-5, in words 2.5e-3. Less is measured to be
// enough where factors are exact.
#ifndef BIAS
#define BIAS 1.5e-7
#endif
// Between the bounds of absorbance in front of a fragment: 0 is the lower, 1 the upper (MBOIT 3.2).
#ifndef BETA
#define BETA 0.25
#endif

const float PUBLISHED_BIAS = BY_WORDS(BY_STORAGE(5e-5, 3e-3), 2.5e-3);
const float V2 = BY_WORDS(0.75, 0.42474916);
const float V4 = BY_WORDS(0.67666667, 0.22407803);
const float V6 = BY_WORDS(0.63, 0.15369231);
const float V8 = BY_WORDS(0.60030303, 0.1290044);

// Added up: moments times absorbance; absorbance.
struct sums { vec4 target0; vec4 target1; float target2; };

sums accumulate(float z, float alpha) {
    float a = absorbance(alpha), z2 = z * z, z4 = z2 * z2;
    vec4 low = vec4(z, z2, z2 * z, z4) * a;
    sums o;
    o.target0 = low;
    o.target1 = low * z4;
    o.target2 = a;
    return o;
}

// Nodes; residues; d, -b0 log2(e).
struct factors { vec4 factor0; vec4 factor1; vec2 factor2; };

factors factor(sums t) {
    float b0 = max(t.target2, 1e-12), g = BIAS / (1.0 - BIAS) * b0;
    float least = max(ROUNDING * (1.0 - BIAS / PUBLISHED_BIAS), 1e-15) * BY_STORAGE(b0, (b0 + g));
    rule4 r = rule4_of(recurrence4_of(
        pivot_of(PAIR(b0, g), 0.0), ALONE(SUM_WITHIN(t.target0.x, b0)),
        PAIR(SUM_WITHIN(t.target0.y, b0), g * V2), ALONE(SUM_WITHIN(t.target0.z, b0)),
        PAIR(SUM_WITHIN(t.target0.w, b0), g * V4), ALONE(SUM_WITHIN(t.target1.x, b0)),
        PAIR(SUM_WITHIN(t.target1.y, b0), g * V6), ALONE(SUM_WITHIN(t.target1.z, b0)),
        PAIR(SUM_WITHIN(t.target1.w, b0), g * V8), least, 1.0));
    factors o;
    o.factor0 = r.g;
    o.factor1 = r.e;
    o.factor2 = vec2(r.d, -1.44269504 * t.target2);
    return o;
}

float transmittance(factors f, float z, float alpha) {
    vec4 u = f.factor0 - z;
    float d = f.factor2.x, w = weight4(u * u, f.factor1, d);
    // seen from the ray's end where three nodes lie in front of z; v, behind: distances from it
    bool mirrored = u.z < 0.0;
    precise float v1 = (mirrored ? u.z : -u.y) + 1e-15;
    float v0 = mirrored ? u.w : -u.x, a = v0 - v1;
    vec2 behind = max(mirrored ? -u.yx : u.zw, vec2(1e-15)), gaps = v0 + behind, p = v1 + behind;
    vec4 e = mirrored ? f.factor1.wzyx : f.factor1;
    float C = e.x / v0, A = e.y / v1;
    vec2 B = e.zw / behind;
    float s = min(outermost4_nearly(a, gaps, C, A, B), 1e4);
    s = outermost4(s, a, gaps, C, A, B);
    float sa = s + a;
    vec2 sb = s + gaps;
    float outer = weight4(vec4(s * s, sa * sa, sb * sb), e, d);
    // the second node
    float E1 = A / sa, E01 = C / s + E1;
    vec2 E = B / sb;
    float y = second4(E1 * a / (E.x * a / p.x + E01), a, p, E01, E1, E), rest = a - y;
    vec2 yp = y + p;
    float second = weight4(vec4(rest * rest, y * y, yp * yp), e, d);
    outer = v1 > 0.0 ? outer + second : outer;
    outer = v0 > 0.0 ? outer : 0.0;
    float in_front = mirrored ? (1.0 - w) - outer : outer;
    return transmittance_through(w, in_front, f.factor2.y, BETA, alpha);
}

#include "engine/both_at_once.glsl"

#ifndef MEANS_OF_BLOCKS
vec4 resolve(vec4 shaded_sum, sums t) { return covered(shaded_sum, t.target2); }
#endif
