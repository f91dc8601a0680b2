// Moment Transparency: Sharpe, HPG 2018, four moments of depth in [0, 1] (equations 1 to 6 and the
// supplement), in floats alone; the reconstruction is that of power4.glsl. What reaches the
// background is the product of 1 - alpha.
#include "engine/common.glsl"
#include "engine/pairs.glsl"
#include "engine/storage.glsl"
#include "engine/rules2.glsl"

// How much of a safe distribution outweighs rounding.
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

// 1: moments are of blocks of pixels, in targets of their size; pixels read between these.
#ifndef LOW_RESOLUTION
#define LOW_RESOLUTION 0
#endif

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

#if !LOW_RESOLUTION
// Added up: moments times absorbance; absorbance. What is let through, which starts at 1 and is
// multiplied by 1 - target2.
struct sums { vec4 target0; float target1; float target2; };
#else
// Added up of a block: moments times absorbance; absorbance.
struct sums { vec4 target0; float target1; };
#endif

// Every alpha counts as times MAX_ALPHA, so that none is opaque.
sums accumulate(float z, float alpha) {
    float a = absorbance(alpha * MAX_ALPHA);
    sums o;
    o.target0 = powers_of(placed(z)) * a;
    o.target1 = a;
#if !LOW_RESOLUTION
    o.target2 = alpha;
#endif
    return o;
}

#if LOW_RESOLUTION
#include "engine/low_resolution.glsl"

// What a pixel reads of the four blocks around it.
sums between(sums a, sums b, sums c, sums d, vec4 share) {
    sums o;
    o.target0 = four_weighed(a.target0, b.target0, c.target0, d.target0, share);
    o.target1 = dot(vec4(a.target1, b.target1, c.target1, d.target1), share);
    return o;
}

// Moments of blocks may hide all of a pixel's fragments behind its neighbours'. What is left of
// them then is next to nothing, not nothing: scaled to what they cover it still has their colours,
// of which targets of half floats keep the digits.
#define LEAST_THROUGH 2.4414062e-4
#else
#define LEAST_THROUGH 0.0
#endif

#if PASSES == 2 && EXCLUDE_SELF
#define KEEPS_FIRST // which say what of a fragment is in its second moments
#endif
#if STORAGE == 0
#include "engine/four_factors.glsl"
#else
#include "engine/packed_moments.glsl"
#endif

#if PASSES == 1
float transmittance(factors f, float z, float alpha) {
#if LOW_RESOLUTION
    return max(transmittance_at(f, placed(z), BETA, alpha * MAX_ALPHA), LEAST_THROUGH);
#else
    return transmittance_at(f, placed(z), BETA, alpha * MAX_ALPHA);
#endif
}

#include "engine/both_at_once.glsl"
#else
#if !LOW_RESOLUTION
// Added up in the second pass: moments and absorbance of what the first pass lets through.
struct seconds { vec4 target3; float target4; };
#define MOMENTS_OF(s) s.target3
#define TOTAL_OF(s) s.target4
#else
// Added up in the second pass: moments and absorbance of what the first lets through to a block.
struct seconds { vec4 target2; float target3; };
#define MOMENTS_OF(s) s.target2
#define TOTAL_OF(s) s.target3

seconds between_second(seconds a, seconds b, seconds c, seconds d, vec4 share) {
    seconds o;
    o.target2 = four_weighed(a.target2, b.target2, c.target2, d.target2, share);
    o.target3 = dot(vec4(a.target3, b.target3, c.target3, d.target3), share);
    return o;
}
#endif

// Of the second pass (section 4.4), by the factors of the first.
seconds accumulate_second(factors first, float z, float alpha) {
    float most = alpha * MAX_ALPHA, place = placed(z);
    float a = absorbance(most) * transmittance_at(first, place, BETA, most);
    seconds o;
    MOMENTS_OF(o) = powers_of(place) * a;
    TOTAL_OF(o) = a;
    return o;
}

// What a ray of so much absorbance covers.
float covered_by(float total) { return 1.0 - exp2(-1.44269504 * total); }

// Of the second moments, with a scale in place of b0. As they are of less absorbance than the
// first, what they cover is scaled so that it ends at what the first cover (supplement 1.2).
factors factor_second(sums t, seconds s) {
    sums m;
    m.target0 = MOMENTS_OF(s);
    m.target1 = TOTAL_OF(s);
#if !LOW_RESOLUTION
    m.target2 = t.target2;
#endif
    factors f = factor(m);
    float scale = covered_by(t.target1) / max(covered_by(TOTAL_OF(s)), 1e-4);
    factors o;
    o.factor0 = f.factor0;
    o.factor1 = vec4(f.factor1.xyz, scale);
#ifdef KEEPS_FIRST
    factors first = factor(t);
    o.factor2 = first.factor0;
    o.factor3 = first.factor1;
#endif
    return o;
}

#ifdef KEEPS_FIRST
// The opacity that a fragment has of the second moments: of what the first let through to it.
float second_opacity(factors f, float z, float most) {
    factors first;
    first.factor0 = f.factor2;
    first.factor1 = f.factor3;
    first.factor2 = f.factor2;
    first.factor3 = f.factor3;
    return covered_by(absorbance(most) * transmittance_at(first, z, BETA, most));
}
#endif

// By factors of the second moments.
float transmittance(factors f, float z, float alpha) {
#ifdef KEEPS_FIRST
    float place = placed(z), own = second_opacity(f, place, alpha * MAX_ALPHA);
    float through = transmittance_at(f, place, BETA, own);
#else
    float through = transmittance_at(f, placed(z), BETA, alpha * MAX_ALPHA);
#endif
    return max(1.0 - (1.0 - through) * f.factor1.w, LEAST_THROUGH);
}
#endif

#if LOW_RESOLUTION
vec4 resolve(vec4 shaded_sum, float let_through) {
    float coverage = 1.0 - let_through;
#else
vec4 resolve(vec4 shaded_sum, sums t) {
    float coverage = 1.0 - t.target2;
#endif
#if NORMALIZE
    return vec4(shaded_sum.rgb * (coverage / max(shaded_sum.a, 1e-30)), coverage);
#else
    return vec4(shaded_sum.rgb, coverage);
#endif
}
