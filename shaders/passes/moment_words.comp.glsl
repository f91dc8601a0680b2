#version 450
// What fragments leave in a pixel of 16-bit words, one ray a thread, in order of arrival: as blending
// with rounding at every fragment would, which fixed blending cannot do.
//
//   DOUBLE      0 or 1: numbers are float or double
//   NODES       2, 3 or 4, for 4, 6 or 8 words
//   CIRCLE      0 or 1: powers of depth or of points of the unit circle
//   B0_IS_HALF  0 or 1: b0 is a float or a half float
#include "kernels/dialect.glsl"
#include "kernels/elementary.h"
#include "kernels/storage.h"
#include "kernels/moment_words.h"

layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly restrict buffer Offsets { uint offsets[]; }; // rays + 1
layout(std430, binding = 1) readonly restrict buffer Absorbances { number a[]; };
layout(std430, binding = 2) readonly restrict buffer Depths { number z[]; };
layout(std430, binding = 3) writeonly restrict buffer Stored { number state[]; }; // words and b0

uniform uint count;
#if CIRCLE
uniform number scale; // half the angle of all depths
#define TERMS(z) circle_terms(scale, z)
#else
#define TERMS(z) power_terms(z)
#endif

void main() {
    uint ray = gl_GlobalInvocationID.x;
    if (ray >= count) return;
    stored s;
    for (int k = 0; k < 2 * NODES; ++k) s.word[k] = K(0.0);
    s.b0 = K(0.0);
    for (uint i = offsets[ray]; i < offsets[ray + 1u]; ++i)
        s = blended(s, TERMS(z[i]), a[i], B0_IS_HALF);
    uint at = (2u * NODES + 1u) * ray;
    for (int k = 0; k < 2 * NODES; ++k) state[at + k] = s.word[k];
    state[at + 2u * NODES] = s.b0;
}
