// Moment Transparency: Sharpe, HPG 2018, one pass of four moments of depth in [0, 1] (equations 1
// to 6 and the supplement), in floats alone; the reconstruction is that of power4.glsl. What
// reaches the background is the product of 1 - alpha.
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

float transmittance(factors f, float z, float alpha) {
    return transmittance_at(f, placed(z), BETA, alpha * MAX_ALPHA);
}

#include "engine/both_at_once.glsl"

vec4 resolve(vec4 shaded_sum, sums t) {
    float coverage = 1.0 - t.target2;
#if NORMALIZE
    return vec4(shaded_sum.rgb * (coverage / max(shaded_sum.a, 1e-30)), coverage);
#else
    return vec4(shaded_sum.rgb, coverage);
#endif
}
