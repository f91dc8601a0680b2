#version 450
// What words of 16 bits keep of four moments, one ray a thread.
//
//   DOUBLE      1: the words are differences of large numbers
//   SYMMETRIC   0: depths lie in [0, 1]; 1: in [-1, 1]
#include "kernels/dialect.glsl"
#include "kernels/elementary.h"
#include "kernels/storage.h"
#include "kernels/moment_transparency.h"

layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly restrict buffer Moments { number b[]; }; // 4 a ray
layout(std430, binding = 1) writeonly restrict buffer Words { number kept[]; }; // words, moments

uniform uint count;

void main() {
    uint ray = gl_GlobalInvocationID.x;
    if (ray >= count) return;
    four m;
    for (int k = 0; k < 4; ++k) m.x[k] = b[4u * ray + k];
#if SYMMETRIC
    four w = symmetric_words(m);
    m = symmetric_moments(w);
#else
    four w = unit_words(m);
    m = unit_moments(w);
#endif
    for (int k = 0; k < 4; ++k) {
        kept[8u * ray + k] = w.x[k];
        kept[8u * ray + 4u + k] = m.x[k];
    }
}
