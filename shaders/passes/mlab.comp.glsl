#version 450
// The layers of multi-layer alpha blending, one pixel a thread, its fragments in arrival order.
//
//   DOUBLE     0 or 1: numbers are float or double
//   LAYERS     how many a pixel keeps
//   QUANTIZED  0 or 1: layers are held as half floats
#include "kernels/dialect.glsl"
#include "kernels/storage.h"
#include "kernels/mlab.h"

struct fragment {
    number depth; // as layers hold it
    number alpha;
    number red;
    number green;
    number blue;
};

layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly restrict buffer Offsets { uint offsets[]; };
layout(std430, binding = 1) readonly restrict buffer Fragments { fragment fragments[]; };
layout(std430, binding = 2) writeonly restrict buffer Layers { layer layers[]; };

uniform uint count;
uniform number least; // alpha that makes a layer

void main() {
    uint p = gl_GlobalInvocationID.x;
    if (p >= count) return;
    layer held[LAYERS];
    for (int i = 0; i < LAYERS; ++i) held[i] = empty_layer();
    for (uint k = offsets[p]; k < offsets[p + 1u]; ++k) {
        fragment f = fragments[k];
        layer coming = layer_of(f.depth, f.alpha, f.red, f.green, f.blue, least);
        if (QUANTIZED == 1) coming = held_layer(coming);
        for (int i = 0; i < LAYERS; ++i) {
            layer_pair pair = layers_passed(held[i], coming);
            held[i] = pair.front;
            coming = pair.behind;
        }
        held[LAYERS - 1] = layers_blended(held[LAYERS - 1], coming);
        if (QUANTIZED == 1) held[LAYERS - 1] = held_layer(held[LAYERS - 1]);
    }
    for (int i = 0; i < LAYERS; ++i) layers[p * uint(LAYERS) + uint(i)] = held[i];
}
