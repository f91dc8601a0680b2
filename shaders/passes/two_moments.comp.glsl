#version 450
// The light that reaches depths of rays after a second pass of moments, from what its moments say
// (power_transmittance.comp.glsl), one depth a thread.
//
//   DOUBLE   0 or 1: numbers are float or double
#include "kernels/dialect.glsl"
#include "kernels/elementary.h"
#include "kernels/storage.h"
#include "kernels/moment_transparency.h"

layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly restrict buffer First { number b0[]; };
layout(std430, binding = 1) readonly restrict buffer Second { number second_b0[]; };
layout(std430, binding = 2) readonly restrict buffer Questions { uint ray_of[]; };
layout(std430, binding = 3) readonly restrict buffer Told { number told[]; };
layout(std430, binding = 4) writeonly restrict buffer Answers { number T[]; };

uniform uint count;

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    number ratio = covered_ratio(b0[ray_of[i]], second_b0[ray_of[i]]);
    T[i] = two_pass_transmittance(told[i], ratio);
}
