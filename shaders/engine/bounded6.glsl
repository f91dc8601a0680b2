// Bounded neural transmittance with six power moments: what the moments leave open, a network of
// 169 numbers decides.
//
// As bounded.glsl, of what six moments prove of a depth. The network, 10 - 8 - 8 - 1 rectified and
// a sigmoid, sees the fifth and the sixth moment, too. The first layer's sums of what a pixel's
// fragments share are made once, with the factors of power6.glsl.
//
// A program may bring its own `NETWORK`, float[169]: layer by layer, output by output the weights
// of its inputs, then its bias; and define NETWORK_GIVEN.
#include "engine/common.glsl"
#include "engine/pairs.glsl"
#include "engine/storage.glsl"
#include "engine/roots.glsl"
#include "engine/rules3.glsl"
#ifndef NETWORK_GIVEN
#include "engine/bounded6_network.glsl"
#endif

const int EACH = 11;
#include "engine/bounded_share.glsl"

// How far moments move toward those of a safe distribution, V2, V4 and V6 (MBOIT's supplement); the
// network was trained with 2.5e-7.
#ifndef BIAS
#define BIAS 2.5e-7
#endif

const float PUBLISHED_BIAS = BY_STORAGE(5e-6, 1e-3);

// Added up: moments times absorbance; absorbance.
struct sums { vec4 target0; vec2 target1; float target2; };

#include "engine/six_moments.glsl"

// Nodes, b0; residues, d; the first layer's sums; mean depth, what rounding took of it,
// 1 / deviation.
struct factors { vec4 factor0; vec4 factor1; vec4 factor2; vec4 factor3; vec4 factor4; };

// What output j of the first layer has of the inputs that a pixel's fragments share.
float begun(int j, vec4 seen, vec2 high) {
    int k = EACH * j;
    float sum = NETWORK[k + 8] * high.x + (NETWORK[k + 9] * high.y + NETWORK[k + 10]);
    return NETWORK[k + 4] * seen.x + (NETWORK[k + 5] * seen.y + (NETWORK[k + 6] * seen.z
           + (NETWORK[k + 7] * seen.w + sum)));
}

factors factor(sums t) {
    recurrence3 r = recurrence_of_sums(t);
    rule3 q = rule3_of(r);
    // The moments of z less its mean in deviations are sums over the ways from the first polynomial
    // back to it, by recurrence coefficients in deviations. With the smallest they stay finite
    float variance = max(r.s.x, 1e-18), per = inversesqrt(variance);
    float u = r.u.x * per, v = r.u.y * per, s2 = r.s.y * per * per, s3 = r.s.z * per * per;
    float both = u + v, fourth = u * u + (s2 + 1.0), fifth = u * (u * u + 2.0) + s2 * (u + both);
    float sixth = u * u + (fourth * fourth + s2 * (both * both + s3));
    // logarithms of total and deviation, skewness, logarithm of kurtosis; and of the fifth, with
    // its sign, and the sixth
    float size = 0.69314718 * log2(min(abs(fifth), 22000.0) + 1.0);
    vec4 seen = vec4(clamp(0.69314718 * log2(max(t.target2, 1e-30)), -8.0, 8.0),
                     max(0.34657359 * log2(variance), -8.0), clamp(u, -6.0, 6.0),
                     0.69314718 * log2(clamp(fourth, 1.0, 403.428793)));
    vec2 high = vec2(fifth < 0.0 ? -size : size, 0.69314718 * log2(clamp(sixth, 1.0, 160000.0)));
    factors o;
    o.factor0 = vec4(q.g, t.target2);
    o.factor1 = vec4(q.e, q.d);
    o.factor2 = vec4(begun(0, seen, high), begun(1, seen, high), begun(2, seen, high),
                     begun(3, seen, high));
    o.factor3 = vec4(begun(4, seen, high), begun(5, seen, high), begun(6, seen, high),
                     begun(7, seen, high));
    o.factor4 = vec4(r.a0, r.low, per, 0.0);
    return o;
}

float transmittance(factors f, float z, float alpha) {
    vec2 mass = mass3_at(f.factor0.xyz, f.factor1.xyz, f.factor1.w, z);
    float beside = ((z - f.factor4.x) - f.factor4.y) * f.factor4.z;
    return bounded_through(mass, f.factor0.w, beside, alpha, f.factor2, f.factor3);
}

#include "engine/both_at_once.glsl"
