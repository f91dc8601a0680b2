#version 450
// Transmittance of stochastic transparency, one ray a thread: its fragments are gone through twice,
// first for what the samples keep, then for what they see. Hashed alpha testing is one sample.
//
//   DOUBLE       0 or 1: numbers are float or double
//   SAMPLES      1 to 64
//   STRATIFIED   0 or 1
#include "kernels/dialect.glsl"
#include "kernels/hashing.h"
#include "kernels/stochastic.h"

layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly restrict buffer Offsets { uint offsets[]; };
layout(std430, binding = 1) readonly restrict buffer Depths { number depths[]; };
layout(std430, binding = 2) readonly restrict buffer Alphas { number alphas[]; };
layout(std430, binding = 3) writeonly restrict buffer Transmittances { number T[]; };

uniform uint count; // rays
uniform uint seed;
uniform uint top, left, width; // of the image in the display

void main() {
    uint ray = gl_GlobalInvocationID.x;
    if (ray >= count) return;
    uint row = top + ray / width, column = left + ray % width;
    number nearest[SAMPLES];
    const number infinity = number(uintBitsToFloat(0x7f800000u));
    for (int s = 0; s < SAMPLES; ++s) nearest[s] = infinity;
    for (uint i = offsets[ray]; i < offsets[ray + 1u]; ++i) {
        uint key = fragment_key(seed, row, column, depths[i], alphas[i]);
        uint twin = 0u;
        for (uint k = offsets[ray]; k < i; ++k)
            if (fragment_key(seed, row, column, depths[k], alphas[k]) == key) ++twin;
        coverage c = coverage_of(key, twin, alphas[i], SAMPLES, STRATIFIED);
        for (int s = 0; s < SAMPLES; ++s) {
            uint bit = s < 32 ? c.low >> s : c.high >> (s - 32);
            if ((bit & 1u) == 1u) nearest[s] = min(nearest[s], depths[i]);
        }
    }
    for (uint i = offsets[ray]; i < offsets[ray + 1u]; ++i) {
        number seen = K(0);
        for (int s = 0; s < SAMPLES; ++s) seen += seen_by(nearest[s], depths[i]);
        T[i] = seen / K(SAMPLES);
    }
}
