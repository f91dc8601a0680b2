#version 450
// Which fragments there are: how many each pixel has, then of which triangles.
//
//   DOUBLE      0
//   PASS        COUNT or FILL
//   WITH_SOLID  1: fragments of alpha 1 are listed, too; 0: they are opaque surfaces elsewhere
//   THICK       1: fragments have deviations, so of what has its middle behind an opaque surface
//               some is in front: who composites cuts it there
#include "arrays/bindings.glsl"
#include "kernels/dialect.glsl"
#include "meshes/transparent.glsl"

// COUNT: of fragments; FILL: where the next one goes. A pixel each.
layout(std430, binding = PLACES) coherent restrict buffer Places { uint places[]; };
#if PASS == FILL
uniform uint first; // of the triangles in the buffer
layout(std430, binding = KEYS) writeonly restrict buffer Keys { uvec2 keys[]; }; // triangle, pixel
#endif

uniform ivec2 listed_rows; // from the first to before the second

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    if (pixel.y < listed_rows.x || pixel.y >= listed_rows.y) return;
#if THICK
    pixel_of_triangle c = covered_by(triangle, asked_pixel(pixel), boxed == 1);
#else
    pixel_of_triangle c = seen_at(pixel);
#endif
#if !WITH_SOLID
    c.there = c.there && alpha_of(triangle, c.at) != 1.0;
#endif
    uint p = uint(pixel.y * picture.x + pixel.x);
    if (c.there) {
        uint place = atomicAdd(places[p], 1u);
#if PASS == FILL
        keys[place] = uvec2(first + uint(triangle), p);
#endif
    }
}
