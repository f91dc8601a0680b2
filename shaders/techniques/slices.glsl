#version 450
// Slices of optical depth: ours, from the storage of Drobot, 2025 (kernels/slices.h). Where slices
// stand comes as a table.
//
//   SCALAR, DOUBLE, PASS   arrays/fragments.glsl
//   SLOTS, CELLS, POWERS, OF_BLOCKS, OF_MIDDLE, SATURATES   arrays/slices.glsl
//   FULL_TOTAL             0 or 1, of blocks: pixels have totals of their own, too
//   HALF_TOTAL             0 or 1: as half floats
//   BYTE_TOTAL             0 or 1: as a byte has them beside their blocks'
//   INSIDE                 0 or 1: answers are held within what four power moments prove
//   ROUND                  of DRAW_WORDS 0: marks; 1: slices, and of pixels' own totals `indices`
#include "kernels/dialect.glsl"
#include "kernels/elementary.h"
#include "kernels/storage.h"
#include "kernels/warp.h"
#include "arrays/fragments.glsl"
#include "arrays/warp.glsl"
#include "arrays/absorbance.glsl"
#if DRAWN // where block_side is of the blocks that are drawn
#define block_side shared_side
#endif
#include "arrays/slices.glsl"

uniform uint image_top; // in the display, as the columns
uniform uint image_left;
uniform number half_step;
uniform double quantum; // optical depth of a step

number code_of(uint p, surface s, number cell) {
    uint pixel = first_pixel + p;
    real threshold =
        slice_threshold(pixel / image_width + image_top, pixel % image_width + image_left, cell);
    return slice_code(absorbance_of(s.alpha), code_scale, code_most, threshold);
}

#if INSIDE
#define NODES 2
#define NUMBERS 4
#define PROVES (PASS == HOLD_WITHIN || PASS == CURVE)
#define SECOND_RULE OF_BLOCKS
#include "arrays/power_bounds.glsl"
#endif

#if PASS == CAPTURE && defined(FROM_TRIANGLES)
void capture(uint p) {
#if FULL_TOTAL
    doubles[DOUBLES_SIZE * p + DOUBLES_SIZE - 1u] = double(indices[p]);
#endif
}
#elif PASS == CAPTURE
void capture(uint p) {
#if !OF_BLOCKS
    for (uint k = 0u; k < SUMS; ++k) sums[SUMS * p + k] = 0u;
#endif
    // Both by one loop, not by arrays/let_through.glsl: with two llvmpipe gives other totals.
    precise double through = 1.0;
    precise double fine = 0.0; // whole numbers: exact
    for (uint i = offsets[p]; i < offsets[p + 1u]; ++i) {
        through *= 1.0 - double(alphas[i]);
        fine += double(fine_code(absorbance_of(number(alphas[i]))));
    }
    set_total(p, through);
#if FULL_TOTAL
    doubles[DOUBLES_SIZE * p + DOUBLES_SIZE - 1u] = fine;
#endif
}
#elif PASS == DEPOSIT || PASS == DRAW_WORDS
void deposit(uint p, surface s) {
    slice_place place = slice_place_of(warped(s.depth), K(CELLS));
    number code = code_of(p, s, place.cell);
    if (uint(code) == 0u || !gives(p)) return; // its cell may have no slices
    slice_seen seen = slices_at(region_of_pixel(p), first_sum_of(p), place);
    uint near = uint(slice_near(code, seen.joined));
    add(seen.slot + 1u, near);
    add(seen.slot + 2u, uint(code) - near);
}
#if PASS == DEPOSIT
void own_pass(uint p, surface s) { deposit(p, s); }
#else
void change_words(surface s, uint p) {
#if ROUND == 0
    mark(p, s);
#else
    deposit(p, s);
#if FULL_TOTAL
    uint fine = uint(fine_code(absorbance_of(s.alpha)));
    if (atomicAdd(indices[p], fine) >= 0x80000000u) atomicMin(indices[p], 0x80000000u);
#endif
#endif
}
#endif
#elif PASS == INTEGRATE
void own_pass(uint block) {
    uint sum = 0u;
    uint pixels = pixels_of(block);
    for (uint k = 1u; k < SUMS; ++k) {
        sum += kept_of(WORDS * block + k, pixels);
        sums[WORDS * block + k] = sum;
    }
#if POWERS
    sum_powers(block);
#endif
}
#elif OF_BLOCKS && PASS == BLOCK_READ
#include "kernels/upsampling.h"

uniform double last_octave; // that a ratio of totals may be in
uniform uint guided; // 1: shares go by the depth of opaque surfaces, of pixels, then of blocks
layout(std430, binding = ASKED) readonly restrict buffer Guides { double guides[]; };

uint own_block(uint p) {
    uint row = (first_pixel + p) / image_width + uint(block_top);
    uint column = (first_pixel + p) % image_width + uint(block_left);
    return row / uint(block_side) * uint(blocks_across) + column / uint(block_side);
}

// Of what pixels read of the blocks around them: shares; the blocks' total, and the pixel's.
void own_pass(uint p) {
    two_blocks x = blocks_across_from(first_pixel + p);
    two_blocks y = blocks_down_from(first_pixel + p);
    four_shares of = bilinear_shares(x.share, y.share);
    uint block[4];
    for (int i = 0; i < 4; ++i) block[i] = block_between(x, y, i);
    if (guided == 1u)
        of = depth_aware_shares(of, guides[p], guides[count + block[0]], guides[count + block[1]],
                                guides[count + block[2]], guides[count + block[3]]);
    precise double share[4] =
        double[4](of.upper_left, of.upper_right, of.lower_left, of.lower_right);
    precise double steps[4]; // that a block has in all
    for (int i = 0; i < 4; ++i)
        steps[i] = double(sums[WORDS * block[i] + uint(SLOTS) + 2u]);
#if FULL_TOTAL
    precise double own = doubles[DOUBLES_SIZE * (p + 1u) - 1u] * 0.0000152587890625; // 2^-16
    if (HALF_TOTAL == 1) own = min(rounded_to_half(own), MOST_HALF);
#if BYTE_TOTAL
    precise double of_block = double(sums[WORDS * own_block(p) + uint(SLOTS) + 2u]) * quantum;
    of_block = max(of_block, 0.0009765625lf);
    precise double ratio = own / of_block;
    precise double turned = ratio * 140737488355329.0lf; // 2^47 + 1: six digits are left
    precise double rounded = turned - (turned - ratio);
    own = of_block * clamp(rounded, 0.00390625lf * last_octave, last_octave);
#endif
    // Those count more whose totals are as its own: where geometry ends within a block they have
    // been drawn of other surfaces.
    precise double sum = 0.0;
    for (int i = 0; i < 4; ++i) {
        precise double total = steps[i] * quantum;
        precise double apart = 8.0 * (total - own) / (max(total, own) + 0.0009765625);
        share[i] = share[i] * (1.0 / (1.0 + apart * apart) + 0.0009765625);
        sum += share[i];
    }
    for (int i = 0; i < 4; ++i) share[i] = share[i] / sum;
#endif
    precise double low = 0.0;
    for (int i = 0; i < 4; ++i) {
        low += share[i] * steps[i];
        factors[FACTORS_SIZE * p + uint(i)] = SCALAR(share[i]);
    }
#if POWERS
    for (uint k = 0u; k < NUMBERS; ++k) {
        precise double powers = 0.0;
        for (int i = 0; i < 4; ++i) powers += share[i] * power_sum(block[i], k);
        powers = low > 0.0 ? powers / low : 0.0;
        doubles[DOUBLES_SIZE * p + HELD_SLICES + k] = double(SCALAR(powers));
    }
#endif
    low = low * quantum;
    factors[FACTORS_SIZE * p + 4u] = SCALAR(low);
#if FULL_TOTAL
    factors[FACTORS_SIZE * p + 5u] = SCALAR(own);
#else
    factors[FACTORS_SIZE * p + 5u] = SCALAR(low);
#endif
}
#endif

#if OF_BLOCKS
uint ray_block[4];

void load_ray(uint p) {
    two_blocks x = blocks_across_from(first_pixel + p);
    two_blocks y = blocks_down_from(first_pixel + p);
    for (int i = 0; i < 4; ++i) ray_block[i] = block_between(x, y, i);
}

number blended_twice(uint p, surface s) {
    slice_place place = slice_place_of(warped(s.depth), K(CELLS));
    real twice = K(0.0);
    for (int i = 0; i < 4; ++i) {
        slice_seen seen = slices_at(region_of_block(ray_block[i]), WORDS * ray_block[i], place);
        number weight = number(factors[FACTORS_SIZE * p + uint(i)]);
        twice = twice + weight * twice_in_front(seen);
    }
    return twice;
}

number absorbed_in_front(uint p, surface s) {
    return block_absorbance(blended_twice(p, s), half_step, number(factors[FACTORS_SIZE * p + 4u]),
                            number(factors[FACTORS_SIZE * p + 5u]), absorbance_of(s.alpha));
}
#else
void load_ray(uint p) {}

number absorbed_in_front(uint p, surface s) {
    slice_place place = slice_place_of(warped(s.depth), K(CELLS));
    slice_seen seen = slices_at(region_of_pixel(p), SUMS * p, place);
    number code = code_of(p, s, place.cell);
    number own = slice_own(slice_near(code, seen.joined), code, seen.joined);
    return slice_absorbance(twice_in_front(seen), own, half_step);
}
#endif

#if INSIDE && OF_BLOCKS
// What is in front of a fragment is between the ends that the pixel's moments prove as far on the
// way as the slices stand between those of theirs (csrc/core/techniques/slice_moments.c).
number answer_at(uint p, surface s) {
#if PROVES
    number own = absorbance_of(s.alpha);
    light_between proven = proven_at(p, s.depth, own);
    precise double total = double(factors[FACTORS_SIZE * p + 4u]);
    precise double extent = proven.slices.at_most - proven.slices.at_least;
    precise double share = double(blended_twice(p, s)) * (0.5 * quantum);
    precise double way = 0.5;
    if (total > 0.0 && extent > 0.0)
        way = clamp((share / total - proven.slices.at_least) / extent, 0.0lf, 1.0lf);
    precise double between = proven.pixel.at_most - proven.pixel.at_least;
    precise double x = proven.b0 * (proven.pixel.at_least + way * between) - 0.5 * double(own);
    x = max(x, 0.0);
#if ABSORBS != 1
    x = exponential(-x);
#endif
    return within_proven(number(x), proven);
#else
    return K(0.0);
#endif
}
#else
number answer_at(uint p, surface s) {
    number x = absorbed_in_front(p, s);
#if ABSORBS != 1
    x = exponential(-x);
#endif
#if INSIDE && PROVES
    x = within_proven(x, proven_at(p, s.depth, absorbance_of(s.alpha)));
#endif
    return x;
}
#endif

#if INSIDE && PASS == HOLD_WITHIN
// A pass of its own, as a thread of one fragment has more patience with proofs. Answers are in
// `indices`, which all bits of a double fit in.
void own_pass(uint p, surface s) {
    load_ray(p);
    uvec2 bits = unpackDouble2x32(double(answer_at(p, s)));
    indices[2u * s.place] = bits.x;
    indices[2u * s.place + 1u] = bits.y;
}
#endif

number in_front(uint p, surface s) {
#if INSIDE && PASS != CURVE
    return number(packDouble2x32(uvec2(indices[2u * s.place], indices[2u * s.place + 1u])));
#else
    return answer_at(p, s);
#endif
}
#undef block_side
#include "arrays/multiplied_up.glsl"
#include "arrays/questions.glsl"
