// Hashed alpha testing: Wyman and McGuire, I3D 2017. A fragment is left with a chance of
// its opacity, by a hash; what is left is opaque, and the depth test keeps the nearest.
#include "engine/dialect.glsl"
#include "kernels/hashing.h"
#include "kernels/stochastic.h"

// A pixel is one sample, which a fragment covers or not.
#ifndef SAMPLES
#define SAMPLES 1
#endif
#ifndef STRATIFIED
#define STRATIFIED 0
#endif

// Colour and 1, not blended.
struct sums { vec4 target0; };

#include "engine/covered_samples.glsl"

sums accumulate_color(vec3 color, float alpha, float depth) {
    sums o;
    o.target0 = vec4(color, 1.0);
    return o;
}

// Premultiplied colour and coverage.
vec4 resolve_color(sums t) { return t.target0; }
