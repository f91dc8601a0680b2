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
#include "engine/four_moments.glsl"

// Added up: moments times absorbance; absorbance.
struct sums { vec4 target0; float target1; };

sums accumulate(float z, float alpha) {
    float a = absorbance(alpha);
    sums o;
    o.target0 = powers_of(z) * a;
    o.target1 = a;
    return o;
}

// a0, what rounding took of it, half of u and s2; s1, h, -b0 log2(e), b0.
struct factors { vec4 factor0; vec4 factor1; };

factors factor(sums t) {
    recurrence2 r = recurrence_of_sums(t.target0, t.target1);
    factors o;
    o.factor0 = held_of(r);
    o.factor1 = vec4(r.s1, r.h, -1.44269504 * t.target1, t.target1);
    return o;
}

float transmittance(factors f, float z, float alpha) {
    vec2 m = mass2_at(recurrence_held(f.factor0, f.factor1.x, f.factor1.y), z);
    return transmittance_through(m.x, m.y, f.factor1.z, BETA, alpha);
}

// Both at once, for pixels of few fragments: no pass for factors.
float transmittance_of_sums(sums t, float z, float alpha) {
    return transmittance(factor(t), z, alpha);
}

vec4 resolve(vec4 shaded_sum, sums t) { return covered(shaded_sum, t.target1); }
