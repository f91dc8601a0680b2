// The picture that primitives are drawn in.
//
// Row 0 of a picture is its top, in memory too: y runs down, and no pass turns a picture over.

uniform ivec2 picture; // width and height in pixels

// Of a smaller picture, whose pixels are blocks of so many pixels a side: each asks the pixel at
// its middle, or next to it in the picture. 1: none.
uniform int block_side;
uniform ivec2 blocks_there;

ivec2 asked_pixel(ivec2 pixel) {
    return block_side > 1 ? min(block_side * pixel + block_side / 2, picture - 1) : pixel;
}

// Pixels from `least` to before `most`.
struct pixel_box {
    ivec2 least;
    ivec2 most;
};

// The blocks that ask one of a box's pixels; the last may ask the last pixel. Without blocks the
// same box.
pixel_box asking(pixel_box b) {
    if (block_side <= 1) return b;
    ivec2 asked = ivec2(block_side / 2), last = blocks_there - 1;
    ivec2 least = clamp((b.least - asked + block_side - 1) / block_side, ivec2(0), last);
    ivec2 end = max((b.most - 1 - asked + block_side) / block_side, least);
    return pixel_box(least, ivec2(b.most.x < picture.x ? end.x : blocks_there.x,
                                  b.most.y < picture.y ? end.y : blocks_there.y));
}

// To where the GPU, moving corners to its own 1/256 pixel, finds just these.
vec2 on_screen(ivec2 corner) {
    dvec2 middle = dvec2(128 * (block_side > 1 ? blocks_there : picture));
    return vec2((dvec2(corner) - middle) / middle);
}
