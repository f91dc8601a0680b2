#version 450
// From rays' Haar coefficients to the absorbance at the ends of their cells, one ray a thread.
//
//   DOUBLE   0 or 1: numbers are float or double
//   LEVELS   2 to 5, of wavelets
//   DENSITY  0 or 1: of the absorbance in front of a depth, or of its density
#include "kernels/dialect.glsl"
#include "kernels/elementary.h"
#include "kernels/haar_wavelet.h"

layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly restrict buffer Coefficients { number c[]; };
layout(std430, binding = 1) writeonly restrict buffer Cells { number ends[]; };

uniform uint count;

void main() {
    uint ray = gl_GlobalInvocationID.x;
    if (ray >= count) return;
    haar_coefficients stored;
    for (int k = 0; k < 1 << LEVELS; ++k) stored.c[k] = c[(ray << LEVELS) + k];
    haar_cells cells = haar_cells_of(LEVELS, DENSITY, stored);
    for (int k = 0; k < 1 << LEVELS; ++k) ends[(ray << LEVELS) + k] = cells.end[k];
}
