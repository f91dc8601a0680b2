// Moment Transparency: Sharpe, HPG 2018, four moments of depth in [0, 1] (equations 1 to 6 and the
// supplement), in floats alone; the reconstruction is that of power4.glsl. What reaches the
// background is the product of 1 - alpha.
#include "engine/common.glsl"
#include "engine/pairs.glsl"
#include "engine/storage.glsl"
#include "engine/rules2.glsl"

// Supplement, 1.1.
#ifndef BIAS
#define BIAS 3e-7
#endif
// Between the bounds of absorbance in front of a fragment; 0.25 is the paper's overestimation.
#ifndef BETA
#define BETA 0.0
#endif

// What pass 2 reads: 0: floats; 1: two depths, a weight and an offset in words of 16 bits, and the
// total as a half float; 2: moments so.
#ifndef STORAGE
#define STORAGE 0
#endif

// Of moments: with 2 those of the second pass are of what the first lets through.
#ifndef PASSES
#define PASSES 1
#endif

const float PUBLISHED_BIAS = 3e-7;
#include "engine/four_moments.glsl"

// Depth as moments have it, in [0, 1]; in [-1, 1] by a footnote of the paper.
#ifndef SYMMETRIC
#define SYMMETRIC 0
#endif
float placed(float z) {
#if SYMMETRIC
    return z;
#else
    return 0.5 * z + 0.5;
#endif
}

// Added up: moments times absorbance; absorbance. What is let through, which starts at 1 and is
// multiplied by 1 - target2.
struct sums { vec4 target0; float target1; float target2; };

// Every alpha counts as times MAX_ALPHA, so that none is opaque.
sums accumulate(float z, float alpha) {
    float a = absorbance(alpha * MAX_ALPHA);
    sums o;
    o.target0 = powers_of(placed(z)) * a;
    o.target1 = a;
    o.target2 = alpha;
    return o;
}

#if STORAGE == 0
#include "engine/four_factors.glsl"
#else
#include "engine/packed_moments.glsl"
#endif

#if PASSES == 1
float transmittance(factors f, float z, float alpha) {
    return transmittance_at(f, placed(z), BETA, alpha * MAX_ALPHA);
}

#include "engine/both_at_once.glsl"
#else
// Added up in the second pass: moments and absorbance of what the first pass lets through.
struct seconds { vec4 target3; float target4; };

// Of the second pass (section 4.4), by the factors of the first.
seconds accumulate_second(factors first, float z, float alpha) {
    float most = alpha * MAX_ALPHA, place = placed(z);
    float a = absorbance(most) * transmittance_at(first, place, BETA, most);
    seconds o;
    o.target3 = powers_of(place) * a;
    o.target4 = a;
    return o;
}

// What a ray of so much absorbance covers.
float covered_by(float total) { return 1.0 - exp2(-1.44269504 * total); }

// Of the second moments, with a scale in place of b0. As they are of less absorbance than the
// first, what they cover is scaled so that it ends at what the first cover (supplement 1.2).
factors factor_second(sums t, seconds s) {
    sums m;
    m.target0 = s.target3;
    m.target1 = s.target4;
    m.target2 = t.target2;
    factors f = factor(m);
    float scale = covered_by(t.target1) / max(covered_by(s.target4), 1e-4);
    factors o;
    o.factor0 = f.factor0;
    o.factor1 = vec4(f.factor1.xyz, scale);
    return o;
}

// By factors of the second moments.
float transmittance(factors f, float z, float alpha) {
    float through = transmittance_at(f, placed(z), BETA, alpha * MAX_ALPHA);
    return max(1.0 - (1.0 - through) * f.factor1.w, 0.0);
}
#endif

vec4 resolve(vec4 shaded_sum, sums t) {
    float coverage = 1.0 - t.target2;
#if NORMALIZE
    return vec4(shaded_sum.rgb * (coverage / max(shaded_sum.a, 1e-30)), coverage);
#else
    return vec4(shaded_sum.rgb, coverage);
#endif
}
