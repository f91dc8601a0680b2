// Six power moments: Muenstermann, Krumpen, Klein and Peters, "Moment-Based Order-Independent
// Transparency", 2018 (MBOIT), in floats alone.
//
// Pass 1 adds up absorbance times 1, z .. z^6. The factors, once a pixel, are the Gauss rule of
// three nodes of these moments. Of the distribution with a node at z, the other three nodes lie one
// in each interval that z is not in; only the outermost on the side where there is one is computed.
#include "engine/common.glsl"
#include "engine/pairs.glsl"
#include "engine/storage.glsl"
#include "engine/roots.glsl"
#include "engine/rules3.glsl"

// How much of a safe distribution outweighs rounding (MBOIT 4.1).
// Its even moments are V2, V4 and V6; published biases are 5e-6, in words 6e-4. Less is measured to
// be enough where factors are exact.
#ifndef BIAS
#define BIAS 5e-8
#endif
// Between the bounds of absorbance in front of a fragment: 0 is the lower, 1 the upper (MBOIT 3.2).
#ifndef BETA
#define BETA 0.25
#endif

const float PUBLISHED_BIAS = BY_WORDS(BY_STORAGE(5e-6, 1e-3), 6e-4);

// Added up: moments times absorbance; absorbance.
struct sums { vec4 target0; vec2 target1; float target2; };

#include "engine/six_sums.glsl"
#include "engine/six_moments.glsl"

// Nodes, -b0 log2(e); residues, d.
struct factors { vec4 factor0; vec4 factor1; };

factors factor(sums t) {
    rule3 r = rule3_of(recurrence_of_sums(t));
    factors o;
    o.factor0 = vec4(r.g, -1.44269504 * t.target2);
    o.factor1 = vec4(r.e, r.d);
    return o;
}

float transmittance(factors f, float z, float alpha) {
    vec2 m = mass3_at(f.factor0.xyz, f.factor1.xyz, f.factor1.w, z);
    return transmittance_through(m.x, m.y, f.factor0.w, BETA, alpha);
}

#include "engine/both_at_once.glsl"
