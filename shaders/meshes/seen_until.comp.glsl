#version 450
// How far each pixel's projected splats are seen, as count_tile of csrc/core/splats.c finds it: a
// pixel a thread, tile after tile, through the splats of the tile from front to back.
//
//   DOUBLE   0
#include "kernels/dialect.glsl"
#include "meshes/splat_pixels.glsl"
#include "meshes/seen_until.glsl"

layout(local_size_x = GROUP) in;
layout(std430, binding = TILE_FIRSTS) readonly restrict buffer Firsts { uint firsts[]; };
layout(std430, binding = FRONT_TO_BACK) readonly restrict buffer FrontToBack { int front_to_back[]; };
uniform uint count;       // threads
uniform int tile_columns;
uniform uint from;        // of each tile's list splats from this one on,
uniform uint most;        // so many at once

void main() {
    uint thread = gl_GlobalInvocationID.y * gl_NumWorkGroups.x * gl_WorkGroupSize.x
                  + gl_GlobalInvocationID.x;
    if (thread >= count) return;
    const uint tile_pixels = SPLAT_TILE * SPLAT_TILE;
    int tile = int(thread / tile_pixels), inside = int(thread % tile_pixels);
    ivec2 pixel = SPLAT_TILE * ivec2(tile % tile_columns, tile / tile_columns)
                  + ivec2(inside % SPLAT_TILE, inside / SPLAT_TILE);
    if (pixel.x >= picture.x || pixel.y >= picture.y) return;
    int p = pixel.y * picture.x + pixel.x;
    seen_until s = ends[p];
    if (from == 0u) s = seen_until(1.0, 3.4028234663852886e38, 0);
    uint begin = firsts[tile] + from, end = min(begin + most, firsts[tile + 1]);
    for (uint n = begin; n < end && s.through >= 0.0; ++n) {
        int i = front_to_back[n];
        precise float alpha = splat_at(i, pixel).alpha;
        precise float after = s.through * (1.0 - alpha);
        if (alpha > 0.0) {
            bool seen = after >= LEAST_SEEN;
            s.through = seen ? after : -1.0;
            if (!seen) {
                s.z = splats[i].z;
                s.index = splats[i].index;
            }
        }
    }
    ends[p] = s;
}
