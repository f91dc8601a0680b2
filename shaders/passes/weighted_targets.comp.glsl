#version 450
// What fragments leave in the published targets of weighted blending, one pixel a thread, in order
// of arrival. A GPU's own blending does the same but for how it rounds.
//
//   DOUBLE   0 or 1: numbers are float or double
#include "kernels/dialect.glsl"
#include "kernels/storage.h"
#include "kernels/weighted_targets.h"

struct fragment {
    number red, green, blue; // colour times opacity and weight
    number weight;           // times opacity
    number alpha;            // opacity
};
struct pixel {
    number red, green, blue, weight; // accumulation
    number revealage;                // a byte
};

layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly restrict buffer Offsets { uint offsets[]; }; // pixels + 1
layout(std430, binding = 1) readonly restrict buffer Fragments { fragment fragments[]; };
layout(std430, binding = 2) writeonly restrict buffer Targets { pixel targets[]; };

uniform uint count;

void main() {
    uint p = gl_GlobalInvocationID.x;
    if (p >= count) return;
    accumulation held = accumulation(K(0.0), K(0.0), K(0.0), K(0.0));
    number byte = K(255.0);
    for (uint i = offsets[p]; i < offsets[p + 1u]; ++i) {
        fragment f = fragments[i];
        held = accumulated(held, accumulation(f.red, f.green, f.blue, f.weight));
        byte = dimmed_byte(byte, f.alpha);
    }
    targets[p] = pixel(held.red, held.green, held.blue, held.weight, byte);
}
