// Four power moments: Muenstermann, Krumpen, Klein and Peters, "Moment-Based Order-Independent
// Transparency", 2018 (MBOIT), in floats alone.
//
// Pass 1 adds up absorbance times 1, z .. z^4. The factors, once a pixel, are the recurrence
// coefficients a0, a1, s1, s2 of the orthogonal polynomials of these moments: L D L^T of the matrix
// of central moments, in pairs of floats. With d = z - a0, u = a1 - a0, h = s1 s2 and
// p = s1 - d (d - u) = -p2(z), the distribution with a node at z has there the weight
// w = h / (h + s2 d^2 + p^2) (Christoffel). Where p > 0, one node lies on each side of z, at
// (B -+ R) / p from it with B = (u p + s2 d) / 2, R^2 = B^2 + p (p s1 + h). As weights sum to 1 and
// their mean is a0, in front of z are ((1 - w) + ((1 - w) B + w p d) / R) / 2: no root is taken.
// Elsewhere p counts as 0 there, which gives 0 or 1 - w.
#include "engine/common.glsl"
#include "engine/pairs.glsl"

// How far moments move toward those of a safe distribution, V2 and V4 (MBOIT 4.1; its supplement:
// bias 5e-7); less is measured to be enough where factors are exact.
#ifndef BIAS
#define BIAS 5e-8
#endif
// Between the bounds of absorbance in front of a fragment: 0 is the lower, 1 the upper (MBOIT 3.2).
#ifndef BETA
#define BETA 0.25
#endif

const float PUBLISHED_BIAS = 5e-7;
const float V2 = 0.375;
const float V4 = 0.375;

// Added up: moments times absorbance; absorbance.
struct sums { vec4 target0; float target1; };

sums accumulate(float z, float alpha) {
    float a = absorbance(alpha);
    float z2 = z * z;
    sums o;
    o.target0 = vec4(z, z2, z2 * z, z2 * z2) * a;
    o.target1 = a;
    return o;
}

// a0, what rounding took of it, u / 2, s2 / 2; s1, h, -b0 log2(e), b0.
struct factors { vec4 factor0; vec4 factor1; };

factors factor(sums t) {
    float b0 = max(t.target1, 1e-12);
    float g = BIAS / (1.0 - BIAS) * b0;
    float least = max(1.1920929e-7 * (1.0 - BIAS / PUBLISHED_BIAS), 1e-15) * b0;
    float_pair m0 = normal_pair(pair_of(b0, g));
    float_pair m1 = pair_of(t.target0.x, 0.0);
    float_pair m2 = pair_of(t.target0.y, g * V2);
    float_pair m3 = pair_of(t.target0.z, 0.0);
    float_pair m4 = pair_of(t.target0.w, g * V4);
    float r0 = 1.0 / m0.h;
    float_pair k1 = ratio(m1, m0, r0);
    float_pair k2 = ratio(m2, m0, r0);
    float_pair found11 = normal_pair(reduced_even(m2, m1, k1));
    float_pair c21 = reduced(m3, m1, k2);
    float_pair c22 = reduced_even(m4, m2, k2);
    // as many nodes as pivots are above rounding
    bool one = !(found11.h > least);
    float_pair c11 = pair_of(one ? least : found11.h, one ? 0.0 : found11.l);
    float_pair l2 = ratio(c21, c11, 1.0 / c11.h);
    float_pair rest = reduced_even(c22, c21, l2);
    precise float found_u = (l2.h - 2.0 * k1.h) + (l2.l - 2.0 * k1.l);
    // |a1| <= 1, whatever rounding did
    float u = one ? -k1.h : clamp(found_u, -1.0 - k1.h, 1.0 - k1.h);
    float s1 = c11.h * r0;
    float h = one ? 0.25 * s1 : clamp((rest.h + rest.l) * r0, least * r0, s1);
    factors o;
    o.factor0 = vec4(k1.h, k1.l, 0.5 * u, 0.5 * h / s1);
    o.factor1 = vec4(s1, h, -1.44269504 * t.target1, t.target1);
    return o;
}

float transmittance(factors f, float z, float alpha) {
    precise float d = (z - f.factor0.x) - f.factor0.y;
    float p = (2.0 * f.factor0.z - d) * d + f.factor1.x;
    float e = f.factor0.w * d;
    float w = f.factor1.y / (p * p + (e * (2.0 * d) + f.factor1.y));
    float q = max(p, 0.0);
    float B = f.factor0.z * q + e;
    float per = inversesqrt(B * B + q * (q * f.factor1.x + f.factor1.y));
    float sides = (w * (q * d - B) + B) * per; // of 1 - w: in front less behind
#if EXCLUDE_SELF
    float own = min(log2(1.0 - min(alpha, MAX_ALPHA)) / min(f.factor1.z, -1e-12), 1.0);
    float share = 0.5 * ((1.0 - w) + sides) + BETA * max(w - own, 0.0);
    share = clamp(share, 0.0, 1.0 - own);
#else
    float share = clamp(0.5 * sides + ((BETA - 0.5) * w + 0.5), 0.0, 1.0);
#endif
    return exp2(f.factor1.z * share);
}

// Both at once, for pixels of few fragments: no pass for factors.
float transmittance_of_sums(sums t, float z, float alpha) {
    return transmittance(factor(t), z, alpha);
}

vec4 resolve(vec4 shaded_sum, sums t) { return covered(shaded_sum, t.target1); }
