#version 450
// Adaptive voxels as published: Drobot, "Adaptive Voxel-Based Order-Independent Transparency", 2025
// (kernels/slices.h). Blocks of pixels, or pixels, keep the light behind each slice in a byte.
//
//   SCALAR, DOUBLE, PASS   arrays/fragments.glsl
//   SLOTS, CELLS, OF_BLOCKS, OF_MIDDLE, SATURATES   arrays/slices.glsl
//   AROUND                 how many blocks are read along a row and a column: 2, or 4 of cubic ones
//   CUBIC                  0 or 1: light between slices is a B-spline
#include "kernels/dialect.glsl"
#include "kernels/elementary.h"
#include "kernels/warp.h"
#include "arrays/fragments.glsl"
#include "arrays/warp.glsl"
#include "arrays/absorbance.glsl"
#include "arrays/slices.glsl"

#define CORNERS (AROUND * AROUND)

#if PASS == CAPTURE
#include "arrays/let_through.glsl"

void capture(uint p) { set_total(p, let_through(p)); }
#elif PASS == DEPOSIT
void own_pass(uint p, surface s) {
    if (!gives(p)) return; // where no pixel that does has anything, a cell may have no slices
    slice_place place = slice_place_of(warped(s.depth), K(CELLS));
    slice_seen seen = slices_at(region_of_pixel(p), first_sum_of(p), place);
    real absorbed = absorbance_of(s.alpha);
    add(seen.slot + 1u, uint(voxel_code(absorbed * (1.0 - seen.joined), code_scale, code_most)));
    add(seen.slot + 2u, uint(voxel_code(absorbed * seen.joined, code_scale, code_most)));
}
#elif PASS == INTEGRATE
uniform double quantum; // optical depth of a step

// Of the slice k at k + 1, in 255 steps. One whose sum is more than its bits hold lets nothing
// through, and none behind it does.
void own_pass(uint block) {
    uint sum = 0u;
    uint pixels = pixels_of(block);
    bool full = false;
    for (uint k = 1u; k <= uint(SLOTS); ++k) {
        uint kept = kept_of(SUMS * block + k, pixels);
        sum += kept;
        full = full || kept > uint(code_most);
        real light = exponential(-(double(sum) * quantum)) * 255.0 + 0.5;
        sums[SUMS * block + k] = full ? 0u : uint(light);
    }
}
#endif

// The blocks around a pixel along a row or a column, and their shares.
struct around {
    int at[AROUND];
    double share[AROUND];
};

#if AROUND == 2
around blocks_around(int pixel, int there) {
    two_blocks two = between_blocks(pixel, there);
    precise around a;
    a.at[0] = two.low;
    a.at[1] = two.high;
    a.share[0] = 1.0 - two.share;
    a.share[1] = two.share;
    return a;
}
#else
around blocks_around(int pixel, int there) {
    int beyond = 2 * pixel + 1 - block_side; // the first block's middle, in half pixels
    int low = beyond < 0 ? -1 : beyond / (2 * block_side);
    precise double inside = double(beyond - 2 * block_side * low) / double(2 * block_side);
    precise double rest = 1.0 - inside;
    precise around a;
    for (int k = 0; k < 4; ++k) a.at[k] = clamp(low - 1 + k, 0, there - 1);
    a.share[0] = rest * rest * rest / 6.0;
    a.share[1] = (4.0 - inside * inside * (6.0 - 3.0 * inside)) / 6.0;
    a.share[2] = (4.0 - rest * rest * (6.0 - 3.0 * rest)) / 6.0;
    a.share[3] = inside * inside * inside / 6.0;
    return a;
}
#endif

around around_along_row(uint p) {
    return blocks_around(int((first_pixel + p) % image_width) + block_left, blocks_across);
}

around around_along_column(uint p) {
    return blocks_around(int((first_pixel + p) / image_width) + block_top, blocks_down);
}

#if PASS == BLOCK_READ
void own_pass(uint p) {
    around x = around_along_row(p);
    around y = around_along_column(p);
    for (int k = 0; k < CORNERS; ++k) {
        precise double share = y.share[k / AROUND] * x.share[k % AROUND];
        factors[FACTORS_SIZE * p + uint(k)] = SCALAR(share);
    }
}
#endif

int ray_column[AROUND];
int ray_row[AROUND];

void load_ray(uint p) {
    ray_column = around_along_row(p).at;
    ray_row = around_along_column(p).at;
}

uniform double slice_bias; // by so many slices fragments read light nearer
uniform uint cells_joined; // of a slice

number light_at(uint first, int slot) {
    return number(sums[first + 1u + uint(clamp(slot, 0, SLOTS - 1))]);
}

number dark_at(uint first, int slot, number z) {
    return z < K(0.0) ? K(0.0) : K(255.0) - light_at(first, slot);
}

// What a block has of light in front of z; of a spline, where shares sum to 1 but for rounding and
// T is to be 1 where nothing is dark, what light lacks.
number read_at(uint block, number z) {
    slice_place place = slice_place_of(z, K(CELLS));
    uint first = SUMS * block;
    slice_seen seen = slices_at(region_of_block(block), first, place);
    int slot = int(seen.slot - first);
#if CUBIC
    number inside = seen.any ? seen.joined : K(0.0); // without slices it stands at the next one
    // by any place: what is in front of all is not dark already
    return voxel_cubic_light(K(1.0), dark_at(first, slot - 1, z), dark_at(first, slot, z),
                             dark_at(first, slot + 1, z), dark_at(first, slot + 2, z), inside);
#else
    return voxel_light(z, light_at(first, slot), light_at(first, seen.any ? slot + 1 : slot),
                       seen.joined);
#endif
}

number in_front(uint p, surface s) {
    precise double shift = slice_bias * double(cells_joined) / double(CELLS);
    real z = warped(s.depth) - number(shift);
    real sum = K(0.0);
    for (int k = 0; k < CORNERS; ++k) {
        uint block = uint(ray_row[k / AROUND] * blocks_across + ray_column[k % AROUND]);
        number weight = number(factors[FACTORS_SIZE * p + uint(k)]);
        sum = sum + weight * read_at(block, z);
    }
#if CUBIC
    return max(1.0 - sum, K(0.0));
#else
    return sum;
#endif
}
#include "arrays/questions.glsl"
