// Bounded neural transmittance with four power moments: what the moments leave open, a network of
// 153 numbers decides.
//
// Of all distributions with a ray's moments, and a surface of absorbance `own` at z, the one
// through z has the least absorbance in front of z, and none has more than its weight at z, less
// `own`, besides (Chebyshev, Markov, Stieltjes; MBOIT 3.2). The network, 8 - 8 - 8 - 1 rectified
// and a sigmoid, says how much of that. The first layer's sums of what a pixel's fragments share
// are made once, with the factors of power4.glsl.
//
// A program may bring its own `NETWORK`, float[153]: layer by layer, output by output the weights
// of its inputs, then its bias; and define NETWORK_GIVEN.
#include "engine/common.glsl"
#include "engine/pairs.glsl"
#include "engine/storage.glsl"
#include "engine/rules2.glsl"
#ifndef NETWORK_GIVEN
#include "engine/bounded_network.glsl"
#endif

#define EACH 9
#include "engine/bounded_share.glsl"

// How much of a safe distribution outweighs rounding (MBOIT 4.1).
// Its moments are 0, V2, 0 and V4; the network was trained with this.
#ifndef BIAS
#define BIAS 2.5e-7
#endif

const float PUBLISHED_BIAS = BY_STORAGE(5e-7, 3e-4);
#include "engine/four_moments.glsl"

// Added up: moments times absorbance; absorbance.
struct sums { vec4 target0; float target1; };

#include "engine/four_sums.glsl"

// a0, what rounding took of it, half of u and s2; s1, h, 1 / deviation, b0; the sums.
struct factors { vec4 factor0; vec4 factor1; vec4 factor2; vec4 factor3; };

// What output j of the first layer has of the inputs that a pixel's fragments share.
float begun(int j, vec4 seen) { return weighed(EACH * j + 4, seen, NETWORK[EACH * j + 8]); }

// Of sums that stand for an absorbance of b0 in all, whatever their own is. How long z's unit is in
// the range of depth whose deviations the network knows: `unit`.
factors factor_of(sums t, float b0, float unit) {
    recurrence2 r = recurrence_of_sums(t.target0, t.target1);
    // logarithms of total and deviation, skewness, logarithm of kurtosis
    float variance = max(r.s1, 1e-18), per = inversesqrt(variance), square = per * per;
    float u = 2.0 * r.half_u, kurtosis = (r.h * square + u * u) * square + 1.0;
    vec4 seen = vec4(clamp(0.69314718 * log2(max(b0, 1e-30)), -8.0, 8.0),
                     max(0.34657359 * log2(variance * (unit * unit)), -8.0),
                     clamp(u * per, -6.0, 6.0),
                     0.69314718 * log2(clamp(kurtosis, 1.0, 403.428793)));
    factors o;
    o.factor0 = held_of(r);
    o.factor1 = vec4(r.s1, r.h, per, b0);
    o.factor2 = vec4(begun(0, seen), begun(1, seen), begun(2, seen), begun(3, seen));
    o.factor3 = vec4(begun(4, seen), begun(5, seen), begun(6, seen), begun(7, seen));
    return o;
}

factors factor(sums t) { return factor_of(t, t.target1, 1.0); }

float transmittance(factors f, float z, float alpha) {
    recurrence2 r = recurrence_held(f.factor0, f.factor1.x, f.factor1.y);
    float beside = ((z - r.a0) - r.low) * f.factor1.z;
    return bounded_through(mass2_at(r, z), f.factor1.w, beside, alpha, f.factor2, f.factor3);
}

#include "engine/both_at_once.glsl"
