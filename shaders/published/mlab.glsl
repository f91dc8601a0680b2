#version 450
// What the published pass of multi-layer alpha blending costs (Salvi, Vaidyanathan 2014), written
// plainly from the paper: layers in order, premultiplied, the last two of which become one. A
// yardstick: moit draws nothing with it.
//
// LAYERS : how many there are.

#include "published/fragments.glsl"

layout(std430, binding = 1) buffer a_state { vec4 layers[]; }; // colours; what gets past
layout(std430, binding = 3) buffer the_depths { float depths[]; };
layout(std430, binding = 4) readonly buffer the_colours { vec4 colours[]; }; // and opacity

void main() {
    uint first = gl_GlobalInvocationID.x * LAYERS;
    vec4 layer[LAYERS + 1];
    float depth[LAYERS + 1];
    for (int i = 0; i < LAYERS; ++i) {
        layer[i] = layers[first + i];
        depth[i] = depths[first + i];
    }
    vec4 color = colours[gl_GlobalInvocationID.x];
    vec4 placed = vec4(color.rgb * color.a, 1.0 - color.a);
    float z = this_fragment().z;
    for (int i = 0; i < LAYERS; ++i) {
        bool behind = z < depth[i];
        vec4 here = layer[i];
        float deep = depth[i];
        layer[i] = behind ? placed : here;
        depth[i] = behind ? z : deep;
        placed = behind ? here : placed;
        z = behind ? deep : z;
    }
    vec4 last = layer[LAYERS - 1];
    layer[LAYERS - 1] = vec4(last.rgb + last.a * placed.rgb, last.a * placed.a);
    for (int i = 0; i < LAYERS; ++i) {
        layers[first + i] = layer[i];
        depths[first + i] = depth[i];
    }
}
