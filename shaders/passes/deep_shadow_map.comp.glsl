#version 450
// Deep shadow maps of rays whose surfaces are sorted front to back, one ray a thread. A map of n
// surfaces has room for 3 n + 3 nodes, and lies behind those of the rays before it: the count of its
// nodes, then their depths and transmittances in turn.
//
//   DOUBLE   0 or 1: numbers are float or double
#include "kernels/dialect.glsl"
#include "kernels/deep_shadow.h"

layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly restrict buffer Rays { uint offsets[]; };
layout(std430, binding = 1) readonly restrict buffer Depths { number z[]; };
layout(std430, binding = 2) readonly restrict buffer Opacities { number alpha[]; };
layout(std430, binding = 3) restrict buffer Maps { number maps[]; };

uniform uint count;
uniform number tolerance;

uint start; // of this ray's map
uint nodes = 0u;

void add_node(number z, number T) {
    uint at = start + 1u + 2u * nodes;
    if (nodes > 0u && maps[at - 2u] == z && maps[at - 1u] == T) return;
    maps[at] = z;
    maps[at + 1u] = T;
    ++nodes;
}

void main() {
    uint ray = gl_GlobalInvocationID.x;
    if (ray >= count) return;
    uint first = offsets[ray], end = offsets[ray + 1u];
    start = 6u * first + 7u * ray;
    real total = K(1.0);
    for (uint i = first; i < end; ++i) {
        real through = K(1.0) - alpha[i];
        total = total * through;
    }
    shadow_segment segment;
    real behind = K(1.0);
    real last = K(0.0);
    for (uint i = first; i < end;) {
        real depth = z[i];
        real before = behind;
        do {
            real through = K(1.0) - alpha[i++];
            behind = behind * through;
        } while (i < end && z[i] == depth);
        if (nodes == 0u) {
            add_node(depth, K(1.0));
            segment = shadow_segment_from(depth, K(1.0));
            last = depth;
        }
        shadow_step next = shadow_step_at(segment, last, depth, before, behind, total, tolerance);
        if (next.broken) add_node(last, next.broken_T);
        if (next.stepped) {
            add_node(depth, next.stepped_T);
            add_node(depth, behind);
        }
        segment = next.next;
        last = depth;
    }
    if (first < end) {
        add_node(last, shadow_segment_at(segment, last));
        add_node(last, total);
    }
    maps[start] = number(nodes);
}
