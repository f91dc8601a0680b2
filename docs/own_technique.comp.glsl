#version 450
// The technique of own_technique.py, a pixel a thread: two sums over its fragments, then the
// transmittance in front of each.
#define DOUBLE 0
#include "kernels/dialect.glsl"
#include "kernels/elementary.h"

layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly restrict buffer Offsets { int offsets[]; };
layout(std430, binding = 1) readonly restrict buffer Depths { float depth[]; };
layout(std430, binding = 2) readonly restrict buffer Alphas { float alpha[]; };
layout(std430, binding = 3) writeonly restrict buffer Results { float transmittance[]; };

uniform uint pixels;
uniform vec2 range;  // logarithms of the nearest and the farthest depth

float place(int i) { return clamp((log(depth[i]) - range.x) / (range.y - range.x), 0.0, 1.0); }

void main() {
    uint p = gl_GlobalInvocationID.x;
    if (p >= pixels) return;
    // Read before the loops: llvmpipe writes too little where a loop that writes reads its own end.
    int begin = offsets[p], end = offsets[p + 1];
    vec2 sums = vec2(0.0);
    for (int i = begin; i < end; ++i)
        sums += absorbance(min(alpha[i], 0.998)) * vec2(1.0, place(i));
    float mean = clamp(sums.y / max(sums.x, 1e-6), 0.01, 0.99);
    for (int i = begin; i < end; ++i)
        transmittance[i] = exp(-sums.x * pow(place(i), mean / (1.0 - mean)));
}
