// Four power moments: Muenstermann, Krumpen, Klein and Peters, "Moment-Based Order-Independent
// Transparency", 2018 (MBOIT), in floats alone.
//
// Pass 1 adds up absorbance times 1, z .. z^4. The factors, once a pixel, are the recurrence
// coefficients of the orthogonal polynomials of these moments; pass 2 takes no root (rules2.glsl).
#include "engine/common.glsl"
#include "engine/pairs.glsl"
#include "engine/rules2.glsl"

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
    float a = absorbance(alpha), z2 = z * z;
    sums o;
    o.target0 = vec4(z, z2, z2 * z, z2 * z2) * a;
    o.target1 = a;
    return o;
}

// a0, what rounding took of it, half of u and s2; s1, h, -b0 log2(e), b0.
struct factors { vec4 factor0; vec4 factor1; };

factors factor(sums t) {
    float b0 = max(t.target1, 1e-12), g = BIAS / (1.0 - BIAS) * b0;
    float least = max(1.1920929e-7 * (1.0 - BIAS / PUBLISHED_BIAS), 1e-15) * b0;
    recurrence2 r = recurrence2_of(
        normal_pair(pair_of(b0, g)), pair_of(t.target0.x, 0.0), pair_of(t.target0.y, g * V2),
        pair_of(t.target0.z, 0.0), pair_of(t.target0.w, g * V4), least, 1.0);
    factors o;
    o.factor0 = vec4(r.a0, r.low, r.half_u, r.half_s2);
    o.factor1 = vec4(r.s1, r.h, -1.44269504 * t.target1, t.target1);
    return o;
}

recurrence2 recurrence_of(factors f) {
    recurrence2 r;
    r.a0 = f.factor0.x;
    r.low = f.factor0.y;
    r.half_u = f.factor0.z;
    r.half_s2 = f.factor0.w;
    r.s1 = f.factor1.x;
    r.h = f.factor1.y;
    return r;
}

float transmittance(factors f, float z, float alpha) {
    mass m = mass2_at(recurrence_of(f), z);
    return transmittance_through(m, f.factor1.z, BETA, alpha);
}

// Both at once, for pixels of few fragments: no pass for factors.
float transmittance_of_sums(sums t, float z, float alpha) {
    return transmittance(factor(t), z, alpha);
}

vec4 resolve(vec4 shaded_sum, sums t) { return covered(shaded_sum, t.target1); }
