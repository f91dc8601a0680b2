#version 450
// The opaque pass: the nearest opaque surface of each pixel, its colour and its depth.
//
//   DOUBLE   0
//   SHADOWED 0 or 1, by the pixel
//   CUTOUT   0: triangles that are opaque; 1: of others the pixels where alpha is 1, the rest of
//            which
//            is left for transparent passes
#include "kernels/dialect.glsl"
#include "PRIMITIVE"

uniform float occluder_scale; // a power of two below 1 / farthest, so that no bit is lost

flat in int triangle;
flat in int boxed;

layout(location = 0) out vec4 color;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    pixel_of_triangle c = covered_by(triangle, pixel, boxed == 1);
    if (!c.there) discard;
#if CUTOUT
    if (alpha_of(triangle, c.at) != 1.0) discard;
#endif
    color = vec4(lit_color(triangle, c.at, pixel, uint(pixel.y * picture.x + pixel.x)), 1.0);
    gl_FragDepth = float(c.at.z) * occluder_scale;
}
