#version 450
// Transmittance function maps: what drops of the transmittance add to a ray's sums, and the light
// that reaches depths.
//
//   DOUBLE    0 or 1: numbers are float or double
//   COSINES   1 to 32: how many coefficients a ray has
//   HALF      0 or 1: whether they are stored as half floats
//   PASS      0: the terms of drops, one a thread; 1: transmittance from their sums, one depth a thread
#include "kernels/dialect.glsl"
#include "kernels/elementary.h"
#include "kernels/storage.h"
#include "kernels/transmittance_function.h"

layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly restrict buffer Depths { number d[]; }; // in [0, 1]
uniform uint count;

#if PASS == 0
layout(std430, binding = 1) readonly restrict buffer Drops { number w[]; };
layout(std430, binding = 2) writeonly restrict buffer Terms { number terms[]; }; // COSINES a drop

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    cosine_series s = series_of_drop(COSINES, w[i], d[i]);
    for (int k = 0; k < COSINES; ++k) terms[uint(COSINES) * i + uint(k)] = s.c[k];
}
#else
layout(std430, binding = 1) readonly restrict buffer Surfaces { number own[]; }; // opacity
layout(std430, binding = 2) readonly restrict buffer Questions { uint ray_of[]; };
layout(std430, binding = 3) readonly restrict buffer Sums { number sums[]; }; // COSINES a ray
layout(std430, binding = 4) readonly restrict buffer Totals { number total[]; };
layout(std430, binding = 5) writeonly restrict buffer Answers { number T[]; };

number stored(real x) {
#if HALF
    return rounded_to_half(x);
#else
    return x;
#endif
}

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    cosine_series s;
    for (int k = 0; k < COSINES; ++k) s.c[k] = sums[uint(COSINES) * ray_of[i] + uint(k)];
    s = projected(COSINES, s);
    for (int k = 0; k < COSINES; ++k) s.c[k] = stored(s.c[k]);
    T[i] = function_transmittance(COSINES, s, stored(total[ray_of[i]]), d[i], own[i]);
}
#endif
