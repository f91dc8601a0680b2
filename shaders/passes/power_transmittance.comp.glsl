#version 450
// The light that reaches depths of rays, from power_rules.comp.glsl, one depth a thread.
//
//   DOUBLE   0 or 1: numbers are float or double, those of rules too
//   NODES    2, 3 or 4, for 4, 6 or 8 moments
#include "kernels/dialect.glsl"
#include "kernels/elementary.h"
#include "kernels/power_moments.h"
#include "rules_buffer.glsl"

layout(local_size_x = 64) in;
layout(std430, binding = 1) readonly restrict buffer Rays { number b0[]; };
layout(std430, binding = 2) readonly restrict buffer Questions { uint ray_of[]; };
layout(std430, binding = 3) readonly restrict buffer Depths { number z[]; };
layout(std430, binding = 4) readonly restrict buffer Surfaces { number own[]; }; // absorbance or 0
layout(std430, binding = 5) writeonly restrict buffer Answers { number T[]; };

uniform uint count;
uniform number beta;

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    T[i] = transmittance(rule_of(ray_of[i]), b0[ray_of[i]], z[i], own[i], beta);
}
