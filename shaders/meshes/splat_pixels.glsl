// What a splat is in a pixel: in float whatever `number` is elsewhere, with the steps of
// csrc/core/stages/splats.h, and its bits.
//
//   ALONG_RAYS   1: by the most of its density along the ray; else not defined: as it is projected
#include "meshes/splats.glsl"
#include "kernels/elementary.h"
#include "kernels/splats.h"

struct surface_point {
    float z;
    float alpha; // 0: it is not there
};

surface_point splat_at(int i, ivec2 pixel) {
    pixel_box seen = pixels_of(i);
    // from the tile's corner: what is far from the picture's keeps its digits
    ivec2 corner = pixel / SPLAT_TILE * SPLAT_TILE, from = pixel - corner;
    precise float x = float(splats[i].x - double(corner.x));
    precise float y = float(splats[i].y - double(corner.y));
    precise float dx = float(from.x) - x, dy = float(from.y) - y;
    precise float away = square_of_splat(dx, dy, splats[i].square), z = splats[i].depth[0];
#ifdef ALONG_RAYS
    float planes[3] = float[3](splats[i].along[3], splats[i].along[4], splats[i].along[5]);
    precise float level =
        splats[i].along[0] + splats[i].along[1] * dx + splats[i].along[2] * dy;
    precise float over = level + square_of_splat(dx, dy, planes);
    away = away / over;
    z = (z + splats[i].depth[1] * dx + splats[i].depth[2] * dy) / over;
#endif
    precise float alpha = alpha_of_splat(away, splats[i].opacity);
    bool there = all(greaterThanEqual(pixel, seen.least)) && all(lessThan(pixel, seen.most))
                 && z >= splats[i].nearest;
    return surface_point(z, there ? alpha : 0.0);
}

#ifdef ALONG_RAYS
// Of the density along the ray: deviation_at of csrc/core/splats.c.
float deviation_of(int i, ivec2 pixel) {
    precise double dx = double(pixel.x) - splats[i].x, dy = double(pixel.y) - splats[i].y;
    precise double level = double(splats[i].along[0]) + double(splats[i].along[1]) * dx
                           + double(splats[i].along[2]) * dy;
    precise double curve = double(splats[i].along[3]) * dx * dx
                           + double(splats[i].along[4]) * dx * dy
                           + double(splats[i].along[5]) * dy * dy;
    precise double over = level + curve;
    precise double deviation = splats[i].spread / sqrt(over);
    return deviation < 3.4028234663852886e38lf ? float(deviation) : 3.4028234663852886e38;
}
#endif
