// Four trigonometric moments: Muenstermann, Krumpen, Klein and Peters, "Moment-Based
// Order-Independent Transparency", 2018 (MBOIT), in floats alone.
//
// Pass 1 adds up absorbance times cosines and sines of 1 to 4 times the angle from z = 0 (MBOIT
// eq. 5, turned). With h half of it and y = tan h, the means of sin^k h cos^(8-k) h are power
// moments of y, 0 to 8, of absorbance times (1 + y^2)^-4. So all is as with eight power moments
// (power8.glsl), but that weights are taken times (1 + y^2)^4 and that both outermost nodes count
// where they lie in the wrapping zone (eq. 6).
#include "engine/common.glsl"
#include "engine/pairs.glsl"
#include "engine/storage.glsl"
#include "engine/roots.glsl"
#define WIDE_RANGE
#include "engine/rules4.glsl"
#include "engine/circles.glsl"

// How much of an even spread outweighs rounding (MBOIT 4.1).
// Its moments are 0; published biases are 1.5e-6, in words 8.5e-4.
#ifndef BIAS
#define BIAS 1.5e-7
#endif
// Between the bounds of absorbance in front of a fragment: 0 is the lower, 1 the upper (MBOIT 3.2).
#ifndef BETA
#define BETA 0.25
#endif

const float PUBLISHED_BIAS = BY_WORDS(1.5e-6, 8.5e-4);

// Weights of nodes so far out are as good as that at infinity; their squares' product is a float.
const float MOST = 3e4;

// Added up: cosine and sine of one to four angles, times absorbance; absorbance.
struct sums { vec4 target0; vec4 target1; float target2; };

sums accumulate(float z, float alpha) {
    float a = absorbance(alpha);
    vec2 once = on_the_circle(z), twice = turned(once, once);
    sums o;
    o.target0 = vec4(once, twice) * a;
    o.target1 = vec4(turned(twice, once), turned(twice, twice)) * a;
    o.target2 = a;
    return o;
}

// Nodes; residues; d, -b0 log2(e).
struct factors { vec4 factor0; vec4 factor1; vec2 factor2; };

factors factor(sums t) {
    float b0 = max(t.target2, 1e-12), g = BIAS / (1.0 - BIAS) * b0;
    float least = max(ROUNDING * (1.0 - BIAS / PUBLISHED_BIAS), 1e-15) * b0;
    vec4 c = t.target0, c3 = t.target1;
    pair A = mixed(35.0, b0, 28.0, c.z, 35.0 * g), B = mixed_alone(56.0, c.x, 8.0, c3.x);
    pair P = mixed(5.0, b0, -4.0, c.z, 5.0 * g), Q = mixed_alone(4.0, c.x, -4.0, c3.x);
    pair E = mixed_alone(14.0, c.y, 6.0, c3.y), G = mixed_alone(14.0, c.w, 1.0, c3.w);
    pair I = mixed_alone(6.0, c.y, -2.0, c3.y), J = mixed_alone(2.0, c.w, -1.0, c3.w);
    pair M = mixed(3.0, b0, -4.0, c.z, 3.0 * g), C4 = ALONE(c3.z);
    A = sum_of(A, C4, PLUS);
    P = sum_of(P, C4, LESS);
    pair m0 = pivot_of(sum_of(A, B, PLUS), 0.0);
    rule4 r = rule4_of(recurrence4_of(
        m0, sum_of(E, G, PLUS), sum_of(P, Q, PLUS), sum_of(I, J, PLUS), sum_of(M, C4, PLUS),
        sum_of(I, J, LESS), sum_of(P, Q, LESS), sum_of(E, G, LESS), sum_of(A, B, LESS), least,
        1e30));
    factors o;
    o.factor0 = r.g;
    o.factor1 = r.e;
    o.factor2 = vec2(r.d * (HEAD(m0) / (128.0 * (b0 + g))), -1.44269504 * t.target2);
    return o;
}

// The weight of a node y, from its squared distances to the rule's.
float weight_on_line(float y, vec4 squares, vec4 e, float d) {
    float q = y * y + 1.0;
    q = q * q;
    return weight4(squares, e, d) * (q * q);
}

float transmittance(factors f, float z, float alpha) {
    float at = on_the_line(z), d = f.factor2.x;
    vec4 u = f.factor0 - at;
    float w = min(weight_on_line(at, u * u, f.factor1, d), 1.0);
    // seen from the ray's end where three nodes lie in front of z; v, behind: distances from it
    bool mirrored = u.z < 0.0;
    vec4 e = mirrored ? f.factor1.wzyx : f.factor1, g = mirrored ? -f.factor0.wzyx : f.factor0;
    float v0 = mirrored ? u.w : -u.x, v1 = mirrored ? u.z : -u.y;
    bool inside = v0 > 0.0, both = v1 > 0.0;
    v0 = abs(v0) < 1e-12 ? -1e-12 : v0;
    v1 = abs(v1) < 1e-12 ? -1e-12 : v1;
    vec2 behind = max(mirrored ? -u.yx : u.zw, vec2(1e-12)), gaps = v0 + behind, p = v1 + behind;
    float a = v0 - v1, C = e.x / v0, A = e.y / v1;
    vec2 B = e.zw / behind;
    float s = min(outermost4_nearly(a, gaps, C, A, B), 1e5);
    for (int i = 0; i < 4; ++i) s = min(outermost4(s, a, gaps, C, A, B), 1e5);
    s = min(s, MOST); // beyond, weights are the same
    float sa = s + a, low = max(g.x - s, -MOST);
    vec2 sb = s + gaps;
    float front = weight_on_line(low, vec4(s * s, sa * sa, sb * sb), e, d);
    // the second
    float E1 = A / sa, E01 = C / s + E1;
    vec2 E = B / sb;
    float x = second4(E1 * a / (E.x * a / p.x + E01), a, p, E01, E1, E);
    x = second4(x, a, p, E01, E1, E);
    float rest = a - x;
    vec2 xp = x + p;
    float second = weight_on_line(g.y - x, vec4(rest * rest, x * x, xp * xp), e, d);
    // the outermost node on the other side, where t + 2 k = sum of e / (t + gap)
    float k = 0.5 * (behind.y + (A + C) - (B.x + B.y));
    vec3 from_last = vec3(max(behind.y - behind.x, 0.0), p.y, gaps.y);
    float t = min(half_root(1.0, k, (e.x + e.y) + (e.z + e.w)), 1e5);
    for (int i = 0; i < 2; ++i) t = min(outer_step3(t, k, e.w, e.zyx, from_last), MOST);
    vec3 ts = t + from_last;
    float high = min(g.w + t, MOST);
    float other = weight_on_line(high, vec4(ts.zyx * ts.zyx, t * t), e, d);
    vec2 share = shares_of_ends(low, high, mirrored);
    float ends = (inside ? front * share.x : 0.0) + (both ? second : 0.0) + other * share.y;
    float in_front = clamp(mirrored ? (1.0 - w) - ends : ends, 0.0, 1.0 - w);
    return transmittance_through(w, in_front, f.factor2.y, BETA, alpha);
}

#include "engine/both_at_once.glsl"

#ifndef MEANS_OF_BLOCKS
vec4 resolve(vec4 shaded_sum, sums t) { return covered(shaded_sum, t.target2); }
#endif
