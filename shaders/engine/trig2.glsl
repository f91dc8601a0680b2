// Two trigonometric moments: Muenstermann, Krumpen, Klein and Peters, "Moment-Based
// Order-Independent Transparency", 2018 (MBOIT), in floats alone.
//
// Pass 1 adds up absorbance times cosines and sines of once and twice the angle from z = 0 (MBOIT
// eq. 5, turned). With h half of it and y = tan h, the means of sin^k h cos^(4-k) h are power
// moments of y, 0 to 4, of absorbance times (1 + y^2)^-2. So all is as with four power moments
// (rules2.glsl), but that weights are taken times (1 + y^2)^2 and that a node that lies in the
// wrapping zone counts by its share there (eq. 6): both nodes beside z are computed.
#include "engine/common.glsl"
#include "engine/pairs.glsl"
#include "engine/storage.glsl"
#include "engine/rules2.glsl"
#include "engine/circles.glsl"

// How much of an even spread outweighs rounding (MBOIT 4.1).
// Its moments are 0; published biases are 4e-7, in words 4e-4.
#ifndef BIAS
#define BIAS 4e-8
#endif
// Between the bounds of absorbance in front of a fragment: 0 is the lower, 1 the upper (MBOIT 3.2).
#ifndef BETA
#define BETA 0.25
#endif

const float PUBLISHED_BIAS = BY_WORDS(4e-7, 4e-4);

// Added up: cosine and sine of one and two angles, times absorbance; absorbance.
struct sums { vec4 target0; float target1; };

sums accumulate(float z, float alpha) {
    float a = absorbance(alpha);
    vec2 once = on_the_circle(z);
    sums o;
    o.target0 = vec4(once, turned(once, once)) * a;
    o.target1 = a;
    return o;
}

// a0, what rounding took of it, half of u and s2; s1, h, -b0 log2(e), the measure's mass.
struct factors { vec4 factor0; vec4 factor1; };

factors factor(sums t) {
    float b0 = max(t.target1, 1e-12), g = BIAS / (1.0 - BIAS) * b0;
    float least = max(ROUNDING * (1.0 - BIAS / PUBLISHED_BIAS), 1e-15) * b0;
    // 8 times the means
    vec4 c = t.target0;
    pair A = mixed(3.0, b0, 1.0, c.z, 3.0 * g), B = ALONE(4.0 * c.x);
    pair m0 = pivot_of(sum_of(A, B, PLUS), 0.0), m2 = mixed(1.0, b0, -1.0, c.z, g);
    pair m1 = mixed_alone(2.0, c.y, 1.0, c.w), m3 = mixed_alone(2.0, c.y, -1.0, c.w);
    recurrence2 r = recurrence2_of(m0, m1, m2, m3, sum_of(A, B, LESS), least, 1e30);
    factors o;
    o.factor0 = vec4(r.a0, r.low, r.half_u, r.half_s2);
    o.factor1 = vec4(r.s1, r.h, -1.44269504 * t.target1, HEAD(m0) / (8.0 * (b0 + g)));
    return o;
}

// The weight of a node y at d from a0, where minus p2 is p.
float weight_on_line(float y, float d, float p, factors f) {
    float q = y * y + 1.0;
    return f.factor1.w * f.factor1.y * (q * q)
           / (p * p + (2.0 * f.factor0.w * d * d + f.factor1.y));
}

// How much of nodes lies in front of z, which is `at`; inverse: 1 / y of each.
vec2 shares_in_front(vec2 inverse, vec2 y, float at) {
    vec2 share = wrapped_shares(clamp(inverse, vec2(-EDGE), vec2(EDGE)));
    float first = abs(inverse.x) < EDGE ? share.x : (y.x < at ? 1.0 : 0.0);
    return vec2(first, abs(inverse.y) < EDGE ? share.y : (y.y < at ? 1.0 : 0.0));
}

float transmittance(factors f, float z, float alpha) {
    float at = on_the_line(z);
    precise float d = (at - f.factor0.x) - f.factor0.y;
    float p = (2.0 * f.factor0.z - d) * d + f.factor1.x, w = min(weight_on_line(at, d, p, f), 1.0);
    // the other two nodes, from a0: far / p, where p may be 0, and near
    float c = p * f.factor1.x + f.factor1.y, B = f.factor0.z * p + f.factor0.w * d;
    float R = sqrt(max(B * B + p * c, 0.0)), q = B + (B < 0.0 ? -R : R), near_d = -c / q;
    float near_y = near_d + f.factor0.y + f.factor0.x;
    float near_p = (2.0 * f.factor0.z - near_d) * near_d + f.factor1.x;
    float far_y = q / (abs(p) < 1e-30 ? 1e-30 : p) + f.factor0.x;
    float near_w = min(weight_on_line(near_y, near_d, near_p, f), 1.0 - w);
    float far_w = (1.0 - w) - near_w;
    vec2 y = vec2(near_y, far_y);
    vec2 inverse = 1.0 / vec2(abs(y.x) < 1e-30 ? 1e-30 : y.x, abs(y.y) < 1e-30 ? 1e-30 : y.y);
    float in_front = dot(vec2(near_w, far_w), shares_in_front(inverse, y, at));
    return transmittance_through(w, in_front, f.factor1.z, BETA, alpha);
}

#include "engine/both_at_once.glsl"

#ifndef MEANS_OF_BLOCKS
vec4 resolve(vec4 shaded_sum, sums t) { return covered(shaded_sum, t.target1); }
#endif
