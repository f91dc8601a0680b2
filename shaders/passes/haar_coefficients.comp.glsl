#version 450
// What the fragments of a ray add to its Haar coefficients, in order of arrival, one ray a thread. A
// renderer blends the same addends into render targets, one fragment a thread.
//
//   DOUBLE   0 or 1: numbers are float or double
//   LEVELS   2 to 5, of wavelets
//   DENSITY  0 or 1: of the absorbance in front of a depth, or of its density
//   BITS     32: summed in double, stored as a number; 16: each sum rounded to half
#include "kernels/dialect.glsl"
#include "kernels/elementary.h"
#include "kernels/storage.h"
#include "kernels/haar_wavelet.h"

layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly restrict buffer Rays { uint offsets[]; };
layout(std430, binding = 1) readonly restrict buffer Depths { number z[]; };
layout(std430, binding = 2) readonly restrict buffer Surfaces { number s[]; };
layout(std430, binding = 3) writeonly restrict buffer Coefficients { number c[]; };

uniform uint count;

#if BITS == 16
#define SUM number
#define BLENDED(sum) min(rounded_to_half(sum), K(65504.0))
#else
#define SUM double
#define BLENDED(sum) (sum)
#endif

void main() {
    uint ray = gl_GlobalInvocationID.x;
    if (ray >= count) return;
    precise SUM sum[1 << LEVELS];
    for (int k = 0; k < 1 << LEVELS; ++k) sum[k] = SUM(0);
    for (uint i = offsets[ray]; i < offsets[ray + 1u]; ++i) {
        haar_event e = haar_event_of(LEVELS, DENSITY, z[i], s[i]);
        sum[0] = BLENDED(sum[0] + SUM(e.scaling));
        for (int p = 0; p < LEVELS; ++p) {
            int k = (1 << p) + (int(e.cell) >> (LEVELS - p));
            sum[k] = BLENDED(sum[k] + SUM(e.wavelet[p]));
        }
    }
    for (int k = 0; k < 1 << LEVELS; ++k) c[(ray << LEVELS) + k] = number(sum[k]);
}
