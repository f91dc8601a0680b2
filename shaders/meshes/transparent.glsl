// What transparent passes see: fragments that no opaque surface hides. Equal depth is not hidden.
#include "PRIMITIVE"

layout(binding = OCCLUDERS) uniform sampler2D occluders; // their depth, in (0, 1); 1: none
uniform float occluder_scale;

flat in int triangle;
flat in int boxed;

pixel_of_triangle seen_at(ivec2 pixel) {
    pixel_of_triangle c = covered_by(triangle, asked_pixel(pixel), boxed == 1);
    c.there = c.there && float(c.at.z) * occluder_scale <= texelFetch(occluders, pixel, 0).x;
    return c;
}
