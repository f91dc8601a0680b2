// Two power moments: mean depth and deviation, in the way of power4.glsl (MBOIT).
//
// Pass 1 adds up absorbance times 1, z, z^2. Of all distributions with a mean and a variance that
// one lets through most, or least, which has two nodes, z itself and another (Cantelli).
#include "engine/common.glsl"
#include "engine/pairs.glsl"
#include "engine/storage.glsl"

// How much of a safe distribution outweighs rounding (MBOIT 4.1).
// Its moments are 0 and V2.
#ifndef BIAS
#define BIAS BY_STORAGE(5e-8, 1e-4)
#endif
// Between the bounds of absorbance in front of a fragment: 0 is the lower, 1 the upper (MBOIT 3.2).
#ifndef BETA
#define BETA 0.5
#endif

const float PUBLISHED_BIAS = BY_STORAGE(5e-7, 3e-4);
const float V2 = 0.375;

// Added up: absorbance times z and z^2; absorbance.
struct sums { vec2 target0; float target1; };

sums accumulate(float z, float alpha) {
    float a = absorbance(alpha);
    sums o;
    o.target0 = vec2(z, z * z) * a;
    o.target1 = a;
    return o;
}

// Mean depth and what rounding took of it, variance, -b0 log2(e).
struct factors { vec4 factor0; };

factors factor(sums t) {
    float b0 = max(t.target1, 1e-12), g = BIAS / (1.0 - BIAS) * b0;
    float least = max(ROUNDING * (1.0 - BIAS / PUBLISHED_BIAS), 1e-15) * BY_STORAGE(b0, (b0 + g));
    vec2 m0 = pivot_of(vec2(b0, g), 0.0), m1 = vec2(SUM_WITHIN(t.target0.x, b0), 0.0);
    vec2 m2 = vec2(SUM_WITHIN(t.target0.y, b0), g * V2);
    float r0 = 1.0 / m0.x;
    vec2 mean = ratio(m1, m0, r0), left = pivot_of(reduced_even(m2, m1, mean), least);
    factors o;
    o.factor0 = vec4(mean, left.x * r0, -1.44269504 * t.target1);
    return o;
}

// What is at z: w = v / (v + d^2); all the rest lies on the other side of the mean.
float transmittance(factors f, float z, float alpha) {
    precise float d = (z - f.factor0.x) - f.factor0.y;
    float w = f.factor0.z / (d * d + f.factor0.z);
    return transmittance_through(w, d > 0.0 ? 1.0 - w : 0.0, f.factor0.w, BETA, alpha);
}

#include "engine/both_at_once.glsl"

#ifndef MEANS_OF_BLOCKS
vec4 resolve(vec4 shaded_sum, sums t) { return covered(shaded_sum, t.target1); }
#endif
