#version 450
// Whether fma rounds once: what it loses of a product, asked of a device once.
#include "arrays/bindings.glsl"
#include "engine/probe.glsl"

layout(local_size_x = GROUP) in;
layout(std430, binding = ASKED) readonly restrict buffer Asked { float asked[]; };
layout(std430, binding = ANSWERS) writeonly restrict buffer Answers { float answers[]; };

void main() {
    if (gl_GlobalInvocationID.x == 0u) answers[0] = lost_by_fma(asked[0]);
}
