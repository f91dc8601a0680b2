// Corners of triangles, three calls a triangle. They are clipped already: w is 1, and z of a
// fragment is what it computes itself.
#include "meshes/triangles.glsl"

flat out int triangle;
flat out int boxed; // 1: it is drawn as a box

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
        pixel_box b = asking(pixel_box(least, most));
        // half of a box twice as large
        ivec2 size = 2 * (b.most - b.least);
        corner = 256 * (b.least + ivec2(k == 1 ? size.x : 0, k == 2 ? size.y : 0));
    }
    gl_Position = vec4(on_screen(corner), 0.0, 1.0);
}
