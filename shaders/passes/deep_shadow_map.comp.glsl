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

bool is_lost(shadow_segment s) { return s.steepest > s.flattest; }

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
    real last = first < end ? z[first] : K(0.0);
    shadow_segment segment = shadow_segment_from(last, K(1.0));
    if (first < end) add_node(last, K(1.0));
    real behind = K(1.0);
    for (uint i = first; i < end;) {
        real depth = z[i];
        real before = behind;
        do {
            real through = K(1.0) - alpha[i++];
            behind = behind * through;
        } while (i < end && z[i] == depth);

        shadow_segment front = shadow_segment_through(segment, depth, before, total, tolerance);
        if (is_lost(front)) {
            real T = shadow_segment_at(segment, last);
            add_node(last, T);
            segment = shadow_segment_from(last, T);
            front = shadow_segment_through(segment, depth, before, total, tolerance);
        }
        segment = shadow_segment_through(front, depth, behind, total, tolerance);
        last = depth;
        if (is_lost(segment)) {
            add_node(last, shadow_segment_at(front, last));
            add_node(last, behind);
            segment = shadow_segment_from(last, behind);
        }
    }
    if (first < end) {
        add_node(last, shadow_segment_at(segment, last));
        add_node(last, total);
    }
    maps[start] = number(nodes);
}
