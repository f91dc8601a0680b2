// Moment Transparency: Sharpe, HPG 2018, one pass of four moments of depth in [0, 1] (equations 1
// to 6 and the supplement), in floats alone; the reconstruction is that of power4.glsl. What
// reaches the background is the product of 1 - alpha.
#include "engine/common.glsl"
#include "engine/pairs.glsl"
#include "engine/rules2.glsl"

// Supplement, 1.1.
#ifndef BIAS
#define BIAS 3e-7
#endif
// Between the bounds of absorbance in front of a fragment; 0.25 is the paper's overestimation.
#ifndef BETA
#define BETA 0.0
#endif

const float PUBLISHED_BIAS = 3e-7;
#include "engine/four_moments.glsl"

// Added up: moments times absorbance; absorbance. What is let through, which starts at 1 and is
// multiplied by 1 - target2.
struct sums { vec4 target0; float target1; float target2; };

// Every alpha counts as times MAX_ALPHA, so that none is opaque.
sums accumulate(float z, float alpha) {
    float a = absorbance(alpha * MAX_ALPHA);
    sums o;
    o.target0 = powers_of(0.5 * z + 0.5) * a;
    o.target1 = a;
    o.target2 = alpha;
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
    vec2 m = mass2_at(recurrence_held(f.factor0, f.factor1.x, f.factor1.y), 0.5 * z + 0.5);
    return transmittance_through(m.x, m.y, f.factor1.z, BETA, alpha * MAX_ALPHA);
}

// Both at once, for pixels of few fragments: no pass for factors.
float transmittance_of_sums(sums t, float z, float alpha) {
    return transmittance(factor(t), z, alpha);
}

vec4 resolve(vec4 shaded_sum, sums t) {
    float coverage = 1.0 - t.target2;
    return vec4(shaded_sum.rgb * (coverage / max(shaded_sum.a, 1e-30)), coverage);
}
