#version 450
// Fourier opacity maps: surfaces blended into a ray's half floats, and the light that reaches depths.
//
//   DOUBLE      0 or 1: numbers are float or double
//   HARMONICS   1 to 15: a ray has 1 + 2 HARMONICS coefficients
//   PASS        0 makes the coefficients, one ray a thread; 1 reads them, one depth a thread
#include "kernels/dialect.glsl"
#include "kernels/elementary.h"
#include "kernels/storage.h"
#include "kernels/fourier_opacity.h"

const uint NUMBERS = 1u + 2u * uint(HARMONICS);

layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly restrict buffer Depths { number d[]; }; // in [0, 1]
layout(std430, binding = 1) readonly restrict buffer Surfaces { number own[]; }; // absorbance
uniform uint count;

#if PASS == 0
layout(std430, binding = 2) readonly restrict buffer Offsets { uint offsets[]; };
layout(std430, binding = 3) writeonly restrict buffer Maps { number coefficients[]; };

void main() {
    uint ray = gl_GlobalInvocationID.x;
    if (ray >= count) return;
    fourier_series sum;
    sum.mean = K(0.0);
    for (int k = 0; k < HARMONICS; ++k) sum.cosine[k] = sum.sine[k] = K(0.0);
    for (uint i = offsets[ray]; i < offsets[ray + 1u]; ++i) {
        fourier_series s = series_of_surface(HARMONICS, own[i], d[i]);
        sum.mean = half_sum(sum.mean, s.mean);
        for (int k = 0; k < HARMONICS; ++k) {
            sum.cosine[k] = half_sum(sum.cosine[k], s.cosine[k]);
            sum.sine[k] = half_sum(sum.sine[k], s.sine[k]);
        }
    }
    coefficients[NUMBERS * ray] = sum.mean;
    for (int k = 0; k < HARMONICS; ++k) {
        coefficients[NUMBERS * ray + 1u + 2u * uint(k)] = sum.cosine[k];
        coefficients[NUMBERS * ray + 2u + 2u * uint(k)] = sum.sine[k];
    }
}
#else
layout(std430, binding = 2) readonly restrict buffer Questions { uint ray_of[]; };
layout(std430, binding = 3) readonly restrict buffer Maps { number coefficients[]; };
layout(std430, binding = 4) writeonly restrict buffer Answers { number T[]; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    uint at = NUMBERS * ray_of[i];
    fourier_series density;
    density.mean = coefficients[at];
    for (int k = 0; k < HARMONICS; ++k) {
        density.cosine[k] = coefficients[at + 1u + 2u * uint(k)];
        density.sine[k] = coefficients[at + 2u + 2u * uint(k)];
    }
    T[i] = series_transmittance(HARMONICS, integrated(HARMONICS, density), d[i], own[i]);
}
#endif
