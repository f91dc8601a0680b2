// Primitives as boxes of pixels, `pixels_of`, six calls each: two triangles. Each asks pixels by
// itself what it covers.
flat out int triangle;
flat out int boxed;

void main() {
    int i = gl_VertexID / 6, k = gl_VertexID % 6;
    triangle = i;
    boxed = 0;
    pixel_box b = asking(pixels_of(i));
    bool right = k == 1 || k == 3 || k == 4, low = k == 2 || k == 4 || k == 5;
    ivec2 corner = ivec2(right ? b.most.x : b.least.x, low ? b.most.y : b.least.y);
    gl_Position = vec4(on_screen(256 * corner), 0.0, 1.0);
}
