// Three trigonometric moments: Muenstermann, Krumpen, Klein and Peters, "Moment-Based
// Order-Independent Transparency", 2018 (MBOIT), in floats alone.
//
// Pass 1 adds up absorbance times cosines and sines of 1, 2 and 3 times the angle from z = 0 (MBOIT
// eq. 5, turned). With h half of it and y = tan h, the means of sin^k h cos^(6-k) h are power
// moments of y, 0 to 6, of absorbance times (1 + y^2)^-3. So all is as with six power moments
// (power6.glsl), but that weights are taken times (1 + y^2)^3 and that both outermost nodes count
// where they lie in the wrapping zone (eq. 6).
#include "engine/common.glsl"
#include "engine/pairs.glsl"
#include "engine/storage.glsl"
#include "engine/roots.glsl"
#include "engine/rules3.glsl"
#include "engine/circles.glsl"

// How much of an even spread outweighs rounding (MBOIT 4.1).
// Its moments are 0; published biases are 8e-7, in words 6.5e-4.
#ifndef BIAS
#define BIAS 8e-8
#endif
// Between the bounds of absorbance in front of a fragment: 0 is the lower, 1 the upper (MBOIT 3.2).
#ifndef BETA
#define BETA 0.25
#endif

const float PUBLISHED_BIAS = BY_WORDS(8e-7, 6.5e-4);

// Added up: cosine and sine of one, two, three angles, times absorbance; absorbance.
struct sums { vec4 target0; vec2 target1; float target2; };

sums accumulate(float z, float alpha) {
    float a = absorbance(alpha);
    vec2 once = on_the_circle(z), twice = turned(once, once);
    sums o;
    o.target0 = vec4(once, twice) * a;
    o.target1 = turned(twice, once) * a;
    o.target2 = a;
    return o;
}

// Nodes, -b0 log2(e); residues, d.
struct factors { vec4 factor0; vec4 factor1; };

// Moments are 32 times the means.
factors factor(sums t) {
    float b0 = max(t.target2, 1e-12), g = BIAS / (1.0 - BIAS) * b0;
    float least = max(ROUNDING * (1.0 - BIAS / PUBLISHED_BIAS), 1e-15) * b0;
    vec4 c = t.target0;
    vec2 c3 = t.target1;
    pair A = mixed(10.0, b0, 6.0, c.z, 10.0 * g), B = mixed_alone(15.0, c.x, 1.0, c3.x);
    pair P = mixed(2.0, b0, -2.0, c.z, 2.0 * g), Q = mixed_alone(1.0, c.x, -1.0, c3.x);
    pair E = mixed_alone(5.0, c.y, 1.0, c3.y), G = ALONE(4.0 * c.w);
    pair m0 = pivot_of(sum_of(A, B, PLUS), 0.0), m3 = mixed_alone(3.0, c.y, -1.0, c3.y);
    rule3 r = rule3_of(recurrence3_of(
        m0, sum_of(E, G, PLUS), sum_of(P, Q, PLUS), m3, sum_of(P, Q, LESS), sum_of(E, G, LESS),
        sum_of(A, B, LESS), least, 1e30));
    factors o;
    o.factor0 = vec4(r.g, -1.44269504 * t.target2);
    o.factor1 = vec4(r.e, r.d * (HEAD(m0) / (32.0 * (b0 + g))));
    return o;
}

// The weight of a node y, from its squared distances to the rule's.
float weight_on_line(float y, vec3 squares, vec3 e, float d) {
    float q = y * y + 1.0;
    return weight3(squares, e, d) * (q * q * q);
}

// The outermost node of the distribution with a node at z is s beyond the first of the rule, where
// s + s times the sum of A / (s + gaps) = C; gaps are the other nodes' distances from the first.
// A better s: the quotients as one pole that agrees in value q and slope at s.
float outermost3(float s, vec2 gaps, vec2 A, float C) {
    vec2 y = 1.0 / (s + gaps), t = A * y;
    float q = t.x + t.y, K = dot(t, y), M = q - s * K;
    return min(half_root(K, 0.5 * (q * q - C * K + M), C * M), 1e5);
}

// An outermost node's distance from z may be below 0: such a node counts in the zone. That on the
// other side than the first counts there only; its distance t from the rule's is nearly solved by
// all poles at the first.
float transmittance(factors f, float z, float alpha) {
    float at = on_the_line(z), d = f.factor1.w;
    vec3 u = f.factor0.xyz - at;
    float w = min(weight_on_line(at, u * u, f.factor1.xyz, d), 1.0);
    // seen from the ray's end where most nodes lie in front of z; v: distances from it
    bool mirrored = u.y < 0.0;
    vec3 e = mirrored ? f.factor1.zyx : f.factor1.xyz;
    vec3 g = mirrored ? -f.factor0.zyx : f.factor0.xyz;
    float v0 = mirrored ? u.z : -u.x;
    vec2 v = max(vec2(abs(u.y), mirrored ? -u.x : u.z), vec2(1e-12));
    v0 = abs(v0) < 1e-12 ? -1e-12 : v0;
    vec2 gaps = v0 + v, A = e.yz / v;
    float C = e.x / v0, s = 0.0;
    for (int i = 0; i < 3; ++i) s = outermost3(s, gaps, A, C);
    vec2 sg = s + gaps;
    float low = g.x - s, front = weight_on_line(low, vec3(s * s, sg * sg), e, d);
    // the outermost node on the other side, where t + 2 k = sum of e / (t + gap)
    float k = 0.5 * (v.y + C - (A.x + A.y)), t = half_root(1.0, k, e.x + (e.y + e.z));
    gaps = vec2(gaps.y, max(v.y - v.x, 0.0));
    for (int i = 0; i < 2; ++i) t = min(outer_step2(t, k, e.z, e.xy, gaps), 1e6);
    vec2 tg = t + gaps;
    float high = g.z + t, other = weight_on_line(high, vec3(tg * tg, t * t), e, d);
    vec2 share = shares_of_ends(low, high, mirrored);
    float ends = (v0 > 0.0 ? front * share.x : 0.0) + other * share.y;
    float in_front = clamp(mirrored ? (1.0 - w) - ends : ends, 0.0, 1.0 - w);
    return transmittance_through(w, in_front, f.factor0.w, BETA, alpha);
}

#include "engine/both_at_once.glsl"

#ifndef MEANS_OF_BLOCKS
vec4 resolve(vec4 shaded_sum, sums t) { return covered(shaded_sum, t.target2); }
#endif
