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
#include "engine/roots.glsl"
#define WIDE_RANGE
#include "engine/rules4.glsl"
#include "engine/circles.glsl"

// How far moments move toward those of an even spread, all 0 (MBOIT 4.1; its supplement: 1.5e-6).
#ifndef BIAS
#define BIAS 1.5e-7
#endif
// Between the bounds of absorbance in front of a fragment: 0 is the lower, 1 the upper (MBOIT 3.2).
#ifndef BETA
#define BETA 0.25
#endif

const float PUBLISHED_BIAS = 1.5e-6;

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
    float least = max(1.1920929e-7 * (1.0 - BIAS / PUBLISHED_BIAS), 1e-15) * b0;
    // 128 times the means; cosines C and sines S
    float_pair minus4C2 = pair_of(-4.0 * t.target0.z, 0.0), C4 = pair_of(t.target1.z, 0.0);
    float_pair S4 = pair_of(t.target1.w, 0.0);
    float_pair A = sum_of(sum_of(product(b0, 35.0, 35.0 * g), product(t.target0.z, 28.0, 0.0)), C4);
    float_pair B = sum_of(product(t.target0.x, 56.0, 0.0), pair_of(8.0 * t.target1.x, 0.0));
    float_pair P = sum_of(sum_of(product(b0, 5.0, 5.0 * g), minus4C2), minus(C4));
    float_pair Q = sum_of(pair_of(4.0 * t.target0.x, 0.0), pair_of(-4.0 * t.target1.x, 0.0));
    float_pair E = sum_of(product(t.target0.y, 14.0, 0.0), product(t.target1.y, 6.0, 0.0));
    float_pair G = sum_of(product(t.target0.w, 14.0, 0.0), S4);
    float_pair I = sum_of(product(t.target0.y, 6.0, 0.0), pair_of(-2.0 * t.target1.y, 0.0));
    float_pair J = sum_of(pair_of(2.0 * t.target0.w, 0.0), minus(S4));
    float_pair m0 = normal_pair(sum_of(A, B));
    rule4 r = rule4_of(recurrence4_of(
        m0, sum_of(E, G), sum_of(P, Q), sum_of(I, J),
        sum_of(sum_of(product(b0, 3.0, 3.0 * g), minus4C2), C4), sum_of(I, minus(J)),
        sum_of(P, minus(Q)), sum_of(E, minus(G)), sum_of(A, minus(B)), least, 1e30));
    factors o;
    o.factor0 = r.g;
    o.factor1 = r.e;
    o.factor2 = vec2(r.d * (m0.h / (128.0 * (b0 + g))), -1.44269504 * t.target2);
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
    // Where three nodes lie in front of z, the ray is seen from its end. v: distances from z, above
    // 0 in front of it for the first two
    bool ahead = u.z < 0.0;
    vec4 e = ahead ? f.factor1.wzyx : f.factor1;
    float v0 = ahead ? u.w : -u.x, v1 = ahead ? u.z : -u.y, v2 = max(ahead ? -u.y : u.z, 1e-12);
    float v3 = max(ahead ? -u.x : u.w, 1e-12);
    bool inside = v0 > 0.0, both = v1 > 0.0;
    v0 = abs(v0) < 1e-12 ? -1e-12 : v0;
    v1 = abs(v1) < 1e-12 ? -1e-12 : v1;
    float a = v0 - v1; // of the other nodes from the first
    float b = v0 + v2, c = v0 + v3, A = e.y / v1, B = e.z / v2, D = e.w / v3, C = e.x / v0;
    // the outermost node on that side
    float s = min(outermost4(0.0, a, b, c, A, B, C, D), 1e5);
    s = min(outermost4(s, a, b, c, A, B, C, D), 1e5);
    s = min(outermost4(s, a, b, c, A, B, C, D), 1e5);
    s = outermost4(s, a, b, c, A, B, C, D);
    float sw = min(s, MOST); // beyond, weights are the same
    float sa = sw + a, sb = sw + b, sc = sw + c, y = ahead ? f.factor0.w + s : f.factor0.x - s;
    vec4 squares = vec4(sw * sw, sa * sa, sb * sb, sc * sc);
    float front = weight_on_line(clamp(y, -MOST, MOST), squares, e, d);
    // its share in front by how far it lies in the zone, on its own side
    float inverse = (y < 0.0 ? -1.0 : 1.0) / max(abs(y), 1.0), end = ahead ? EDGE : -EDGE;
    float share = wrapped_share(y * end > 0.0 ? clamp(inverse, -EDGE, EDGE) : end);
    front = inside ? front * (ahead ? 1.0 - share : share) : 0.0;
    // the second
    float p = v1 + v2, q = v1 + v3, E1 = A / sa, E2 = B / sb, E3 = D / sc, E01 = C / sw + E1;
    float x = E1 * a / (a * (E2 / p + E3 / q) + E01);
    x = second4(x, a, p, q, E01, E1, E2, E3);
    x = second4(x, a, p, q, E01, E1, E2, E3);
    float xa = a - x, xp = x + p, xq = x + q;
    y = ahead ? f.factor0.z + x : f.factor0.y - x;
    float second = weight_on_line(y, vec4(xa * xa, x * x, xp * xp, xq * xq), e, d);
    front = both ? front + second : front;
    // the outermost node on the other side, t beyond that of the rule, counts in the zone only:
    // t + 2 k = sum of e / (t + gap), which all poles at the first nearly solve
    float l = max(v3 - v2, 0.0), k = 0.5 * (v3 + (A + C) - (B + D));
    float t = min(half_root(1.0, k, (e.x + e.y) + (e.z + e.w)), 1e5);
    t = outer_step3(t, k, e.w, e.z, l, e.y, q, e.x, c);
    float tw = min(t, MOST), tl = tw + l, tq = tw + q, tc = tw + c;
    y = ahead ? f.factor0.x - t : f.factor0.w + t;
    squares = vec4(tc * tc, tq * tq, tl * tl, tw * tw);
    float other = weight_on_line(clamp(y, -MOST, MOST), squares, e, d);
    inverse = (y < 0.0 ? -1.0 : 1.0) / max(abs(y), 1.0);
    share = wrapped_share(y * end < 0.0 ? clamp(inverse, -EDGE, EDGE) : -end);
    float ends = front + other * (ahead ? 1.0 - share : share);
    mass m;
    m.at = w;
    m.in_front = clamp(ahead ? (1.0 - w) - ends : ends, 0.0, 1.0 - w);
    return transmittance_through(m, f.factor2.y, BETA, alpha);
}

// Both at once, for pixels of few fragments: no pass for factors.
float transmittance_of_sums(sums t, float z, float alpha) {
    return transmittance(factor(t), z, alpha);
}

vec4 resolve(vec4 shaded_sum, sums t) { return covered(shaded_sum, t.target2); }
