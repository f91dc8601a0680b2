// Blocks of pixels, which count from display coordinates (0, 0): those at an image's edges may be
// cut off. csrc/core/techniques/blocks.h has the same.

uniform int block_side;
uniform int block_left; // pixels that the first has beyond the image
uniform int block_top;
uniform int blocks_across;
uniform int blocks_down;
uniform uint first_pixel;
uniform uint image_width;

// The two blocks between whose middles a pixel lies, and the share of the second.
struct two_blocks {
    int low;
    int high;
    double share;
};

two_blocks between_blocks(int pixel, int there) {
    int beyond = 2 * pixel + 1 - block_side; // the first block's middle, in half pixels
    int low = beyond < 0 ? 0 : beyond / (2 * block_side);
    int high = beyond < 0 ? 0 : low + 1;
    int from_low = beyond < 0 ? 0 : beyond - 2 * block_side * low;
    double share = double(from_low) / double(2 * block_side);
    return two_blocks(min(low, there - 1), min(high, there - 1), share);
}

two_blocks blocks_across_from(uint pixel) {
    return between_blocks(int(pixel % image_width) + block_left, blocks_across);
}

two_blocks blocks_down_from(uint pixel) {
    return between_blocks(int(pixel / image_width) + block_top, blocks_down);
}

// The i-th of the four, row by row.
uint block_between(two_blocks x, two_blocks y, int i) {
    return uint((i < 2 ? y.low : y.high) * blocks_across + (i % 2 == 0 ? x.low : x.high));
}
