#version 450
// The nodes of adaptive transparency, one pixel a thread, its fragments in arrival order.
//
//   DOUBLE     0 or 1: numbers are float or double
//   NODES      how many steps a pixel keeps, at least 2
//   QUANTIZED  0 or 1: transmittance is held as words of 16 bits
#include "kernels/dialect.glsl"
#include "kernels/storage.h"
#include "kernels/adaptive.h"

struct fragment {
    number depth; // as nodes hold it
    number alpha;
};

layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly restrict buffer Offsets { uint offsets[]; };
layout(std430, binding = 1) readonly restrict buffer Fragments { fragment fragments[]; };
layout(std430, binding = 2) writeonly restrict buffer Nodes { visibility nodes[]; };

uniform uint count;

void main() {
    uint p = gl_GlobalInvocationID.x;
    if (p >= count) return;
    visibility held[NODES + 1];
    visibility more[NODES + 1];
    for (int i = 0; i <= NODES; ++i) held[i] = visibility(empty_depth(), K(1.0));
    for (uint k = offsets[p]; k < offsets[p + 1u]; ++k) {
        number depth = fragments[k].depth;
        real passes = 1.0 - fragments[k].alpha;
        more[0] = node_shifted(visibility(depth, K(1.0)), held[0], depth, passes);
        for (int i = 1; i <= NODES; ++i)
            more[i] = node_shifted(held[i - 1], held[i], depth, passes);
        removal gone = removal(K(1.0), area_lost(more[0], more[1]));
        for (int i = 2; i < NODES; ++i)
            gone = or_removal(gone, K(i), area_lost(more[i - 1], more[i]));
        number place = place_left_out(gone, more[NODES], K(NODES));
        for (int i = 0; i < NODES; ++i) {
            held[i] = node_kept(more[i], more[i + 1], K(i), place);
            if (QUANTIZED == 1) held[i] = held_node(held[i]);
        }
    }
    for (int i = 0; i < NODES; ++i) nodes[p * uint(NODES) + uint(i)] = held[i];
}
