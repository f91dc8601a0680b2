// What meshes/surface.glsl has of triangles, of splats. No light falls on them.
//
//   ALL   1: of all fragments; else not defined: until there is an end of what is seen
#include "meshes/splat_pixels.glsl"

#ifndef ALL
#include "meshes/seen_until.glsl"
#endif

struct pixel_of_triangle {
    bool there;
    surface_point at;
};

// Boxes cover nothing but whole pixels, and each asks by itself.
pixel_of_triangle covered_by(int i, ivec2 pixel, bool asks) {
    surface_point at = splat_at(i, pixel);
    bool there = at.alpha > 0.0;
#ifndef ALL
    there = there && is_seen(i, pixel);
#endif
    return pixel_of_triangle(there, at);
}

float alpha_of(int i, surface_point p) { return p.alpha; }

vec3 lit_color(int i, surface_point p, ivec2 pixel, uint at) {
    return vec3(splats[i].color[0], splats[i].color[1], splats[i].color[2]);
}
