// Four power moments: Muenstermann, Krumpen, Klein and Peters, "Moment-Based Order-Independent
// Transparency", 2018 (MBOIT), in floats alone.
//
// Pass 1 adds up absorbance times 1, z .. z^4. The factors, once a pixel, are the recurrence
// coefficients of the orthogonal polynomials of these moments; pass 2 takes no root (rules2.glsl).
#include "engine/common.glsl"
#include "engine/pairs.glsl"
#include "engine/storage.glsl"
#include "engine/rules2.glsl"

// How much of a safe distribution outweighs rounding (MBOIT 4.1).
// Its even moments are V2 and V4; published biases are 5e-7, in words 6e-5. Less is measured to be
// enough where factors are exact.
#ifndef BIAS
#define BIAS 5e-8
#endif
// Between the bounds of absorbance in front of a fragment: 0 is the lower, 1 the upper (MBOIT 3.2).
#ifndef BETA
#define BETA 0.25
#endif

const float PUBLISHED_BIAS = BY_WORDS(BY_STORAGE(5e-7, 3e-4), 6.8e-5);
#include "engine/four_moments.glsl"

// Added up: moments times absorbance; absorbance.
struct sums { vec4 target0; float target1; };

#include "engine/four_sums.glsl"

#include "engine/four_factors.glsl"

float transmittance(factors f, float z, float alpha) {
    return transmittance_at(f, z, BETA, alpha);
}

#include "engine/both_at_once.glsl"
