// Corners of triangles, three calls a triangle. They are clipped already: w is 1, and z of a
// fragment is what it computes itself.
#include "meshes/triangles.glsl"

flat out int triangle;
flat out int boxed; // 1: it is drawn as a box

// To where the GPU, moving corners to its own 1/256 pixel, finds just these.
vec2 on_screen(ivec2 corner) {
    dvec2 middle = dvec2(128 * (block_side > 1 ? blocks_there : picture));
    return vec2((dvec2(corner) - middle) / middle);
}

void main() {
    int i = gl_VertexID / 3, k = gl_VertexID % 3;
    triangle = i;
    ivec2 corner = ivec2(triangles[i].x[k], triangles[i].y[k]);
    boxed = is_boxed(i) ? 1 : 0;
    if (boxed == 1) {
        ivec2 least = corner, most = corner;
        for (int other = 0; other < 3; ++other) {
            ivec2 at = ivec2(triangles[i].x[other], triangles[i].y[other]);
            least = min(least, at);
            most = max(most, at);
        }
        // to whole pixels, and one more
        least = clamp((least >> 8) - 1, ivec2(-1), picture + 1);
        most = clamp((most >> 8) + 2, ivec2(-1), picture + 1);
        if (block_side > 1) { // to blocks that ask one of these; the last may ask the last pixel
            ivec2 asked = ivec2(block_side / 2), last = blocks_there - 1;
            least = clamp((least - asked + block_side - 1) / block_side, ivec2(0), last);
            ivec2 end = max((most - 1 - asked + block_side) / block_side, least);
            most = ivec2(most.x < picture.x ? end.x : blocks_there.x,
                         most.y < picture.y ? end.y : blocks_there.y);
        }
        // half of a box twice as large
        ivec2 size = 2 * (most - least);
        corner = 256 * (least + ivec2(k == 1 ? size.x : 0, k == 2 ? size.y : 0));
    }
    gl_Position = vec4(on_screen(corner), 0.0, 1.0);
}
