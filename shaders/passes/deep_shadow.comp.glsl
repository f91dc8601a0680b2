#version 450
// The light that reaches depths of rays, from deep_shadow_map.comp.glsl, one depth a thread.
//
//   DOUBLE   0 or 1: numbers are float or double
#include "kernels/dialect.glsl"
#include "kernels/deep_shadow.h"

layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly restrict buffer Rays { uint offsets[]; };
layout(std430, binding = 1) readonly restrict buffer Maps { number maps[]; };
layout(std430, binding = 2) readonly restrict buffer Questions { uint ray_of[]; };
layout(std430, binding = 3) readonly restrict buffer Depths { number z[]; };
layout(std430, binding = 4) writeonly restrict buffer Answers { number T[]; };

uniform uint count;

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    uint ray = ray_of[i], start = 6u * offsets[ray] + 7u * ray;
    uint nodes = uint(maps[start]), node = 0u, end = nodes;
    while (node < end) { // the first that is not in front of z
        uint middle = (node + end) / 2u;
        if (maps[start + 1u + 2u * middle] < z[i]) node = middle + 1u;
        else end = middle;
    }
    uint at = start + 1u + 2u * node;
    number found = K(1.0);
    if (node == nodes && nodes > 0u) found = maps[at - 1u];
    if (node > 0u && node < nodes)
        found = shadow_between(maps[at - 2u], maps[at - 1u], maps[at], maps[at + 1u], z[i]);
    T[i] = found;
}
