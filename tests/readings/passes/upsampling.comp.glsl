#version 450
// Shares of four squares as kernels/upsampling.h has them, one pixel a thread: bilinear, then with
// depth.
//
//   DOUBLE   0 or 1: numbers are float or double
#include "kernels/dialect.glsl"
#include "kernels/upsampling.h"

layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly restrict buffer Asked { number asked[]; }; // count, 7
layout(std430, binding = 1) writeonly restrict buffer Found { number found[]; }; // count, 8

uniform uint count;

void keep(uint at, four_shares s) {
    found[at] = s.upper_left;
    found[at + 1u] = s.upper_right;
    found[at + 2u] = s.lower_left;
    found[at + 3u] = s.lower_right;
}

void main() {
    uint i = gl_GlobalInvocationID.x, q = 7u * i;
    if (i >= count) return;
    four_shares s = bilinear_shares(asked[q], asked[q + 1u]);
    keep(8u * i, s);
    keep(8u * i + 4u, depth_aware_shares(s, asked[q + 2u], asked[q + 3u], asked[q + 4u],
                                         asked[q + 5u], asked[q + 6u]));
}
