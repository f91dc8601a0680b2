// Triangles on the screen, as csrc/core/raster.c has them, and what of them lies in a pixel: the
// same bits as there, as both compute with the same steps in double (core/stages/raster.h).
//
//   TEXTURED   1: they have images, whose texels passes read; not defined: they have none
#include "arrays/bindings.glsl"
#include "meshes/picture.glsl"

#ifndef TEXTURED
#define TEXTURED 0
#endif

struct screen_triangle { // moit_screen_triangle, moit_textured_triangle
    double inverse_z[3];
    double color[9];
    double alpha[3];
    double normal[9];
    int x[3]; // in 1/256 pixel
    int y[3];
    int opaque;
    int source;
#if TEXTURED
    double u[3]; // where the corners lie on the image
    double v[3];
    double cutoff; // what has less alpha is not there
    int first;     // texel
    int columns;
    int rows;
    int filtering;
    int wrap_u;
    int wrap_v;
    int lit;
    int masked; // 1: there is a cutoff, and what is there is opaque
#endif
};
layout(std430, binding = TRIANGLES) readonly restrict buffer Triangles { screen_triangle triangles[]; };

// Some triangles are drawn as a box that holds them, and pixels ask the edges themselves: those
// that reach so far from the middle of the picture, in 1/256 pixel, that the GPU may clip them, and
// in doing so move their edges; and those with a level edge through middles of pixels, which GPUs
// give to the triangle above or below.
uniform ivec2 reach;

bool is_boxed(int i) {
    bool boxed = block_side > 1;
    for (int k = 0; k < 3; ++k) {
        int next = k == 2 ? 0 : k + 1, y = triangles[i].y[k];
        ivec2 away = abs(ivec2(triangles[i].x[k], y) - 128 * picture);
        boxed = boxed || away.x > reach.x || away.y > reach.y
                || (y == triangles[i].y[next] && (y & 255) == 128);
    }
    return boxed;
}
