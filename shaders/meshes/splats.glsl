// Splats on the screen, as csrc/core/splat_projection.c has them.
#include "arrays/bindings.glsl"
#include "kernels/options.h"
#include "meshes/picture.glsl"

struct screen_splat { // moit_screen_splat
    double x;         // its middle, in pixels
    double y;
    double spread; // along rays: the deviation of its density along those of its middle
    float square[3];
    float along[6];
    float depth[3];
    float opacity;
    float color[3];
    float nearest;
    float z;
    int across[2]; // pixels
    int down[2];
    int left; // tiles
    int top;
    int right;
    int bottom;
    int projected;
    int index;
    int opaque;
};
layout(std430, binding = TRIANGLES) readonly restrict buffer Splats { screen_splat splats[]; };

// The pixels where it may be seen: in its tiles, and in the picture.
pixel_box pixels_of(int i) {
    ivec2 first = ivec2(splats[i].across[0], splats[i].down[0]);
    ivec2 last = ivec2(splats[i].across[1], splats[i].down[1]);
    ivec2 least = max(first, SPLAT_TILE * ivec2(splats[i].left, splats[i].top));
    ivec2 tiles_end = SPLAT_TILE * ivec2(splats[i].right, splats[i].bottom);
    ivec2 most = min(min(last, picture - 1) + 1, tiles_end); // ends may be as great as there are
    return pixel_box(least, max(least, most));
}
