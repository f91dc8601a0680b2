#version 450
// The light that reaches depths of rays whose transmittance falls in steps, one depth a thread.
//
//   DOUBLE   0 or 1: numbers are float or double
//   STEPS    how many there are in a ray
#include "kernels/dialect.glsl"
#include "kernels/steps.h"

struct step_down {
    number depth;
    number through; // what is left of the light behind it
};

layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly restrict buffer Rays { step_down steps[]; };
layout(std430, binding = 1) readonly restrict buffer Questions { uint ray_of[]; };
layout(std430, binding = 2) readonly restrict buffer Depths { number z[]; };
layout(std430, binding = 3) writeonly restrict buffer Answers { number T[]; };

uniform uint count;

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    uint first = ray_of[i] * uint(STEPS);
    number through = K(1.0);
    for (uint k = 0u; k < uint(STEPS); ++k)
        through = behind_step(z[i], steps[first + k].depth, steps[first + k].through, through);
    T[i] = through;
}
