#version 450
// The moments that 16-bit words stand for, as power_rules takes them, one ray a thread.
//
//   DOUBLE   1: the work needs more digits than float has
//   NODES    2, 3 or 4, for 4, 6 or 8 words
//   CIRCLE   0 or 1: powers of depth or of points of the unit circle
#include "kernels/dialect.glsl"
#include "kernels/elementary.h"
#include "kernels/storage.h"
#include "kernels/moment_words.h"

layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly restrict buffer Stored { number state[]; }; // words and b0
layout(std430, binding = 1) writeonly restrict buffer Moments { number b[]; };   // 2 NODES a ray

uniform uint count;
#if CIRCLE
#define DECODED circle_decoded
#else
#define DECODED power_decoded
#endif

void main() {
    uint ray = gl_GlobalInvocationID.x;
    if (ray >= count) return;
    uint at = (2u * NODES + 1u) * ray;
    stored s;
    for (int k = 0; k < 2 * NODES; ++k) s.word[k] = state[at + k];
    s.b0 = state[at + 2u * NODES];
    decoded d = DECODED(s);
    for (int k = 0; k < 2 * NODES; ++k) b[2u * NODES * ray + k] = d.b[k];
}
