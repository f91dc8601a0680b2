// Eight power moments: Muenstermann, Krumpen, Klein and Peters, "Moment-Based Order-Independent
// Transparency", 2018 (MBOIT), in floats alone; see power6.glsl.
#include "engine/common.glsl"
#include "engine/pairs.glsl"
#include "engine/roots.glsl"
#include "engine/rules4.glsl"

// How far moments move toward those of a safe distribution, V2 .. V8 (MBOIT 4.1; its supplement:
// bias 5e-5); less is measured to be enough where factors are exact.
#ifndef BIAS
#define BIAS 1.5e-7
#endif
// Between the bounds of absorbance in front of a fragment: 0 is the lower, 1 the upper (MBOIT 3.2).
#ifndef BETA
#define BETA 0.25
#endif

const float PUBLISHED_BIAS = 5e-5;
const float V2 = 0.75;
const float V4 = 0.67666667;
const float V6 = 0.63;
const float V8 = 0.60030303;

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
    float least = max(1.1920929e-7 * (1.0 - BIAS / PUBLISHED_BIAS), 1e-15) * b0;
    rule4 r = rule4_of(recurrence4_of(
        normal_pair(pair_of(b0, g)), pair_of(t.target0.x, 0.0), pair_of(t.target0.y, g * V2),
        pair_of(t.target0.z, 0.0), pair_of(t.target0.w, g * V4), pair_of(t.target1.x, 0.0),
        pair_of(t.target1.y, g * V6), pair_of(t.target1.z, 0.0), pair_of(t.target1.w, g * V8),
        least, 1.0));
    factors o;
    o.factor0 = r.g;
    o.factor1 = r.e;
    o.factor2 = vec2(r.d, -1.44269504 * t.target2);
    return o;
}

float transmittance(factors f, float z, float alpha) {
    precise float u0 = f.factor0.x - z; // so that 0 has the right sign below
    precise float u1 = f.factor0.y - z, u2 = f.factor0.z - z, u3 = f.factor0.w - z;
    float d = f.factor2.x;
    float w = weight4(vec4(u0 * u0, u1 * u1, u2 * u2, u3 * u3), f.factor1, d);
    // Where three nodes lie in front of z, the ray is seen from its end. v: distances from z, above
    // 0 in front of it for the first two
    bool mirrored = u2 < 0.0;
    float v0 = mirrored ? u3 : -u0;
    precise float v1 = (mirrored ? u2 : -u1) + 1e-15; // not 0
    float v2 = max(mirrored ? -u1 : u2, 1e-15), v3 = mirrored ? -u0 : u3;
    vec4 e = mirrored ? f.factor1.wzyx : f.factor1;
    bool inside = v0 > 0.0, both = v1 > 0.0;
    float A = e.y / v1, B = e.z / v2, D = e.w / v3, C = e.x / v0;
    float a = v0 - v1; // of the other nodes from the first
    float b = v0 + v2, c = v0 + v3;
    // the outermost node, first from 0, where poles at 0 do not count
    float yb = 1.0 / b, yc = 1.0 / c, tb = B * yb, tc = D * yc;
    float F = tb + tc + 1.0, K = tb * yb + tc * yc;
    float s = min(half_root(F - a * K, 0.5 * (a * F - (A + C)), C * a), 1e4);
    s = outermost4(s, a, b, c, A, B, C, D);
    float sa = s + a, sb = s + b, sc = s + c;
    float outer = weight4(vec4(s * s, sa * sa, sb * sb, sc * sc), e, d);
    // the second
    float p = v1 + v2, q = v1 + v3;
    float E1 = A / sa, E2 = B / sb, E3 = D / sc, E01 = C / s + E1;
    float y = E1 * a / (a * (E2 / p + E3 / q) + E01);
    y = second4(y, a, p, q, E01, E1, E2, E3);
    float d0 = a - y, d2 = y + p, d3 = y + q;
    float second = weight4(vec4(d0 * d0, y * y, d2 * d2, d3 * d3), e, d);
    outer = both ? outer + second : outer;
    outer = inside ? outer : 0.0;
    mass m;
    m.at = w;
    m.in_front = mirrored ? (1.0 - w) - outer : outer;
    return transmittance_through(m, f.factor2.y, BETA, alpha);
}

// Both at once, for pixels of few fragments: no pass for factors.
float transmittance_of_sums(sums t, float z, float alpha) {
    return transmittance(factor(t), z, alpha);
}

vec4 resolve(vec4 shaded_sum, sums t) { return covered(shaded_sum, t.target2); }
