#version 450
// Optical depths of surfaces in Moment Transparency, one fragment a thread.
//
//   DOUBLE   0 or 1: numbers are float or double
#include "kernels/dialect.glsl"
#include "kernels/elementary.h"
#include "kernels/storage.h"
#include "kernels/moment_transparency.h"

layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly restrict buffer Fragments { number alpha[]; };
layout(std430, binding = 1) writeonly restrict buffer Answers { number absorbances[]; };

uniform uint count;
uniform number shrink; // what no alpha comes nearer to 1 than

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    absorbances[i] = scaled_absorbance(alpha[i], shrink);
}
