#version 450
// One function of kernels/elementary.h or kernels/storage.h over an array, one number a thread.
//
//   DOUBLE     0 or 1: numbers are float or double
//   FUNCTION   exponential, logarithm, absorbance, cosine_of_turns, sine_of_turns, rounded_to_half,
//              rounded_to_single, unorm16_word, unorm16_value, unorm8_byte or unorm8_value
#include "kernels/dialect.glsl"
#include "kernels/elementary.h"
#include "kernels/storage.h"

layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly restrict buffer Arguments { number x[]; };
layout(std430, binding = 1) writeonly restrict buffer Results { number y[]; };

uniform uint count;

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    y[i] = FUNCTION(x[i]);
}
