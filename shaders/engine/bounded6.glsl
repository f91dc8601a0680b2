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

#define EACH 11
#include "engine/bounded_share.glsl"

// How much of a safe distribution outweighs rounding (MBOIT 4.1).
// Its even moments are V2, V4 and V6; the network was trained with 2.5e-7.
#ifndef BIAS
#define BIAS 2.5e-7
#endif

const float PUBLISHED_BIAS = BY_STORAGE(5e-6, 1e-3);

// Added up: moments times absorbance; absorbance.
struct sums { vec4 target0; vec2 target1; float target2; };

#include "engine/six_sums.glsl"
#include "engine/six_moments.glsl"

#include "engine/bounded6_factors.glsl"

factors factor(sums t) { return factor_within(t, 1.0); }

float transmittance(factors f, float z, float alpha) {
    vec2 mass = mass3_at(f.factor0.xyz, f.factor1.xyz, f.factor1.w, z);
    float beside = ((z - f.factor4.x) - f.factor4.y) * f.factor4.z;
    return bounded_through(mass, f.factor0.w, beside, alpha, f.factor2, f.factor3);
}

#include "engine/both_at_once.glsl"
