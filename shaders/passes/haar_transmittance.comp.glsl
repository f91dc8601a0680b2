#version 450
// The light that reaches depths of rays, from haar_cells.comp.glsl, one depth a thread.
//
//   DOUBLE   0 or 1: numbers are float or double
//   LEVELS   2 to 5, of wavelets
//   DENSITY  0 or 1: of the absorbance in front of a depth, or of its density
#include "kernels/dialect.glsl"
#include "kernels/elementary.h"
#include "kernels/haar_wavelet.h"

layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly restrict buffer Cells { number ends[]; };
layout(std430, binding = 1) readonly restrict buffer Questions { uint ray_of[]; };
layout(std430, binding = 2) readonly restrict buffer Depths { number z[]; };
layout(std430, binding = 3) readonly restrict buffer Surfaces { number own[]; }; // absorbance or 0
layout(std430, binding = 4) writeonly restrict buffer Answers { number T[]; };

uniform uint count;

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    haar_place place = haar_place_of(LEVELS, DENSITY, z[i]);
    int cell = int(place.cell), first = int(ray_of[i]) << LEVELS;
    number start = cell > 0 ? ends[first + cell - 1] : K(0.0);
    T[i] = haar_transmittance(DENSITY, start, ends[first + cell], place.inside, own[i]);
}
