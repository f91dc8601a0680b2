#version 450
// Weights of weighted blending, one fragment a thread.
//
//   DOUBLE   0 or 1: numbers are float or double
//   WEIGHT   which of the WEIGHT_... of kernels/weights.h
#include "kernels/dialect.glsl"
#include "kernels/weights.h"

struct fragment {
    number z;      // distance from the eye in the units that the weights are tuned for, positive
    number d;      // what a depth buffer holds, in [0, 1]
    number alpha;  // net coverage
    number bright; // the largest channel of colour times opacity
};

layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly restrict buffer Fragments { fragment fragments[]; };
layout(std430, binding = 1) writeonly restrict buffer Weights { number weights[]; };

uniform uint count;

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    fragment f = fragments[i];
    weights[i] = blend_weight(WEIGHT, f.z, f.d, f.alpha, f.bright);
}
