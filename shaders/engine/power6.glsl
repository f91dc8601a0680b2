// Six power moments: Muenstermann, Krumpen, Klein and Peters, "Moment-Based Order-Independent
// Transparency", 2018 (MBOIT), in floats alone.
//
// Pass 1 adds up absorbance times 1, z .. z^6. The factors, once a pixel, are the Gauss rule of
// three nodes of these moments. Of the distribution with a node at z, the other three nodes lie one
// in each interval that z is not in; only the outermost on the side where there is one is computed.
#include "engine/common.glsl"
#include "engine/pairs.glsl"
#include "engine/roots.glsl"
#include "engine/rules3.glsl"

// How far moments move toward those of a safe distribution, V2, V4 and V6 (MBOIT 4.1; its
// supplement: bias 5e-6); less is measured to be enough where factors are exact.
#ifndef BIAS
#define BIAS 5e-8
#endif
// Between the bounds of absorbance in front of a fragment: 0 is the lower, 1 the upper (MBOIT 3.2).
#ifndef BETA
#define BETA 0.25
#endif

const float PUBLISHED_BIAS = 5e-6;
const float V2 = 0.48;
const float V4 = 0.451;
const float V6 = 0.45;

// Added up: moments times absorbance; absorbance.
struct sums { vec4 target0; vec2 target1; float target2; };

sums accumulate(float z, float alpha) {
    float a = absorbance(alpha), z2 = z * z, z4 = z2 * z2;
    sums o;
    o.target0 = vec4(z, z2, z2 * z, z4) * a;
    o.target1 = vec2(z4 * z, z4 * z2) * a;
    o.target2 = a;
    return o;
}

// Nodes, -b0 log2(e); residues, d.
struct factors { vec4 factor0; vec4 factor1; };

factors factor(sums t) {
    float b0 = max(t.target2, 1e-12), g = BIAS / (1.0 - BIAS) * b0;
    float least = max(1.1920929e-7 * (1.0 - BIAS / PUBLISHED_BIAS), 1e-15) * b0;
    rule3 r = rule3_of(recurrence3_of(
        pivot_of(vec2(b0, g), 0.0), vec2(t.target0.x, 0.0), vec2(t.target0.y, g * V2),
        vec2(t.target0.z, 0.0), vec2(t.target0.w, g * V4), vec2(t.target1.x, 0.0),
        vec2(t.target1.y, g * V6), least, 1.0));
    factors o;
    o.factor0 = vec4(r.g, -1.44269504 * t.target2);
    o.factor1 = vec4(r.e, r.d);
    return o;
}

float transmittance(factors f, float z, float alpha) {
    precise float u0 = f.factor0.x - z; // so that 0 has the right sign below
    precise float u1 = f.factor0.y - z, u2 = f.factor0.z - z;
    float d = f.factor1.w;
    float w = weight3(vec3(u0 * u0, u1 * u1, u2 * u2), f.factor1.xyz, d);
    // Where two nodes lie in front of z, the ray is seen from its end. v: distances from z
    bool mirrored = u1 < 0.0;
    float v0 = mirrored ? u2 : -u0, v1 = max(abs(u1), 1e-15), v2 = mirrored ? -u0 : u2;
    float e0 = mirrored ? f.factor1.z : f.factor1.x, e2 = mirrored ? f.factor1.x : f.factor1.z;
    // The outermost node, s beyond the first of the rule: C / s = 1 + A / (s + a) + B / (s + b),
    // where a < b are the other nodes' distances from the first. A better s than that by the slope
    // at 0: the last pole as a constant and a pole at -a that agree in value and slope
    float a = v0 + v1, b = v0 + v2, A = f.factor1.y / v1, B = e2 / v2, C = e0 / v0;
    float s = min(C / (A / a + (B / b + 1.0)), 1e4), y = 1.0 / (s + b), t = B * y, r = (s + a) * y;
    float fall = t - t * r + 1.0;
    s = half_root(fall, 0.5 * (fall * a - C + (t * r * (s + a) + A)), C * a);
    float sa = s + a, sb = s + b;
    float outer = weight3(vec3(s * s, sa * sa, sb * sb), vec3(e0, f.factor1.y, e2), d);
    outer = v0 > 0.0 ? outer : 0.0; // else z lies outside all nodes
    float in_front = mirrored ? (1.0 - w) - outer : outer;
    return transmittance_through(w, in_front, f.factor0.w, BETA, alpha);
}

#include "engine/both_at_once.glsl"

vec4 resolve(vec4 shaded_sum, sums t) { return covered(shaded_sum, t.target2); }
