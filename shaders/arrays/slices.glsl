// Slices of depth, of pixels or of blocks of pixels: where they stand, and what is in them, whole
// numbers that fragments add to by atomics. No order shows, and no interlock is needed.
//
//   SLOTS      2 to 256 slices
//   CELLS      64 to 8192, of depth
//   OF_BLOCKS  0 or 1: whether slices are of blocks of pixels, or each pixel's own
//   POWERS     of blocks: how many sums of powers of where slices stand they have besides
//   OF_MIDDLE  0 or 1, of blocks: they have what the pixel at their middle has, or the mean of all
//   SATURATES  0 or 1: whether a slice has a code's most at most
#include "kernels/slices.h"
#include "arrays/squares.glsl"

#define SUMS (uint(SLOTS) + 3u) // before each slice, and behind the last
#define WORDS (SUMS + 2u * uint(POWERS)) // of a pixel or block

// Of each region's cells: slot, from and share, as csrc/core/stages/stages.h has them.
layout(std430, binding = NETWORK) readonly restrict buffer Tables { float tables[]; };
#if OF_BLOCKS && !DRAWN // where triangles are bound
layout(std430, binding = BLOCKS) buffer Words { uint sums[]; };
#else
layout(std430, binding = STATE) buffer Words { uint sums[]; };
#endif

uniform uint region_side; // 0: all pixels have one table
uniform uint region_top;  // pixels that the first region has beyond the image
uniform uint region_left;
uniform uint regions_across;
uniform number code_scale;
uniform number code_most;

uint region_at(uint row, uint column) {
    if (region_side == 0u) return 0u;
    return (row + region_top) / region_side * regions_across + (column + region_left) / region_side;
}

uint region_of_pixel(uint p) {
    uint pixel = first_pixel + p;
    return region_at(pixel / image_width, pixel % image_width);
}

struct slice_seen {
    uint slot; // in `sums`, of the slice at the front
    bool any;
    number joined; // how far in a joined cell
};

// By the table of a region what lies around a place, in slices that begin at `first` of `sums`.
slice_seen slices_at(uint region, uint first, slice_place place) {
    uint entry = 3u * (region * uint(CELLS) + uint(place.cell));
    uint slot = uint(tables[entry]);
    slice_seen seen;
    seen.slot = first + slot / 2u;
    seen.any = (slot & 1u) == 1u;
    seen.joined =
        slice_joined(place.inside, number(tables[entry + 1u]), number(tables[entry + 2u]));
    return seen;
}

// Twice what is in front, in steps.
number twice_in_front(slice_seen seen) {
    number before = number(sums[seen.slot]);
    number at = number(sums[seen.slot + (seen.any ? 1u : 0u)]);
    number behind = number(sums[seen.slot + (seen.any ? 2u : 0u)]);
    return slice_depth(before, at, behind, seen.joined);
}

#if OF_BLOCKS
// Sides of regions are multiples of those of blocks.
uint region_of_block(uint block) {
    uint row = block / uint(blocks_across) * uint(block_side) - uint(block_top);
    uint column = block % uint(blocks_across) * uint(block_side) - uint(block_left);
    return region_at(row, column);
}
#endif

#if PASS == DEPOSIT || PASS == MARK || PASS == DRAW_WORDS
#if OF_BLOCKS
uniform uint image_height;

// In the image what is next to the middle of a whole block, along a row or a column.
int middle_of(int block, int beyond, int most) {
    return clamp(block * block_side - beyond + block_side / 2, 0, most - 1);
}

bool gives(uint p) {
#if OF_MIDDLE
    int row = int((first_pixel + p) / image_width);
    int column = int((first_pixel + p) % image_width);
    return row == middle_of((row + block_top) / block_side, block_top, int(image_height))
           && column == middle_of((column + block_left) / block_side, block_left, int(image_width));
#else
    return true;
#endif
}

uint first_sum_of(uint p) {
    uint row = (first_pixel + p) / image_width + uint(block_top);
    uint column = (first_pixel + p) % image_width + uint(block_left);
    uint side = uint(block_side);
    return WORDS * (row / side * uint(blocks_across) + column / side);
}
#else
bool gives(uint p) { return true; }

uint first_sum_of(uint p) { return SUMS * p; }
#endif

// In `indices` a bit for each cell of each region.
void mark(uint p, surface s) {
    if (s.alpha <= K(0.0) || !gives(p)) return;
    uint cell = uint(slice_place_of(warped(s.depth), K(CELLS)).cell);
    atomicOr(indices[(region_of_pixel(p) * uint(CELLS) + cell) / 32u], 1u << (cell % 32u));
}
#if PASS == MARK
void own_pass(uint p, surface s) { mark(p, s); }
#endif

#include "arrays/added.glsl"
#endif

#if POWERS
uniform double place_low; // of moments' depth: of the first cell's front
uniform double place_extent;

// Of a block's k-th sum, two words.
uint power_at(uint block, uint k) { return WORDS * block + SUMS + 2u * k; }

double power_sum(uint block, uint k) {
    uint at = power_at(block, k);
    return packDouble2x32(uvec2(sums[at], sums[at + 1u]));
}
#endif

#if PASS == INTEGRATE
#if POWERS
void add_slice(uint block, uint slot, uint cell) {
    uint first = WORDS * block + slot; // what is before the slice, and before the next
    precise double z = place_low + place_extent * (double(cell) / double(CELLS));
    precise double power = double(sums[first + 1u] - sums[first]);
    for (uint k = 0u; k < uint(POWERS); ++k) {
        power = power * z;
        uint at = power_at(block, k);
        precise double sum = power_sum(block, k) + power;
        uvec2 bits = unpackDouble2x32(sum);
        sums[at] = bits.x;
        sums[at + 1u] = bits.y;
    }
}

// Sums of powers of where a block's slices stand, from front to back; they are zero before.
void sum_powers(uint block) {
    uint region = region_of_block(block);
    uint last = SUMS; // none
    for (uint cell = 0u; cell < uint(CELLS);) {
        uint entry = 3u * (region * uint(CELLS) + cell);
        uint slot = uint(tables[entry]);
        bool any = (slot & 1u) == 1u;
        slot /= 2u;
        uint front = cell;
        cell += any ? uint(1.0 / tables[entry + 2u] + 0.5) : 1u;
        if (!any) continue;
        if (slot != last) add_slice(block, slot, front);
        add_slice(block, slot + 1u, cell);
        last = slot + 1u;
    }
}
#endif
#if OF_BLOCKS
uniform uint image_height;

uint covered_of(int first, int most) {
    return uint(clamp(first + block_side, 0, most) - clamp(first, 0, most));
}

// How many pixels of the image a block has the sums of.
uint pixels_of(uint block) {
#if OF_MIDDLE
    return 1u;
#else
    int row = int(block) / blocks_across * block_side - block_top;
    int column = int(block) % blocks_across * block_side - block_left;
    return covered_of(row, int(image_height)) * covered_of(column, int(image_width));
#endif
}
#else
uint pixels_of(uint pixel) { return 1u; }
#endif

// What a slice keeps, the k-th sum of a block or pixel, of which so many pixels have added up.
uint kept_of(uint at, uint pixels) {
    uint mean = (sums[at] + pixels / 2u) / pixels;
    return SATURATES == 1 ? min(mean, uint(code_most)) : mean;
}
#endif
