#version 450
// What the published passes of neural moment transparency cost (Tsopouridis, Vasilakis, Fudos
// 2024), written plainly from the paper: a network of 7, 32, 16 and 1 for each fragment. A
// yardstick: moit draws nothing with it.

#include "published/fragments.glsl"

#define FIRST 32
#define SECOND 16

layout(std430, binding = 1) buffer a_state { vec4 moments[]; };
layout(std430, binding = 3) buffer the_rest { vec4 rest[]; }; // b0, count, nearest, farthest
// Weights of each neuron, then what it begins with, layer by layer
layout(std430, binding = 4) readonly buffer the_network { float network[]; };

#if PASS == 1
void main() {
    fragment at = this_fragment();
    uint here = gl_GlobalInvocationID.x;
    float absorbance = -log(1.0 - at.alpha);
    float square = at.z * at.z;
    moments[here] = absorbance * vec4(at.z, square, square * at.z, square * square);
    rest[here] = vec4(absorbance, 1.0, -at.z, at.z);
}
#else
void main() {
    fragment at = this_fragment();
    uint here = gl_GlobalInvocationID.x;
    vec4 b = moments[here], known = rest[here];
    float least = exp(known.z), relative = (exp(at.z) - least) / (exp(known.w) - least);
    float given[7] = float[7](relative, known.y, known.x, b.x, b.y, b.z, b.w);
    float first[FIRST], second[SECOND];
    uint from = 0u;
    for (int j = 0; j < FIRST; ++j) {
        float sum = network[from + 8u * j + 7u];
        for (int k = 0; k < 7; ++k) sum += network[from + 8u * j + k] * given[k];
        first[j] = max(sum, 0.0);
    }
    from = 8u * FIRST;
    for (int j = 0; j < SECOND; ++j) {
        float sum = network[from + (FIRST + 1u) * j + FIRST];
        for (int k = 0; k < FIRST; ++k) sum += network[from + (FIRST + 1u) * j + k] * first[k];
        second[j] = max(sum, 0.0);
    }
    from += (FIRST + 1u) * SECOND;
    float last = network[from + SECOND];
    for (int k = 0; k < SECOND; ++k) last += network[from + k] * second[k];
    give(1.0 / (1.0 + exp(-last)));
}
#endif
