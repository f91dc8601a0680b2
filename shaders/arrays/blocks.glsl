// States of blocks of pixels, as csrc/core/techniques/blocks.h has them. A technique that has such
// includes this, and CAPTURE makes of each pixel that blocks take its own state.
//
//   OF_BLOCKS      0 or 1: whether states are of blocks. If so a state has
//   BLOCK_SETS     1 or 2 sets of numbers, one after the other; BLOCK_FIRST and BLOCK_SECOND make
//                  them of blocks
//   BLOCK_MEANS    1: means, and last of each set what they are of; 0: numbers that add up
//   FULL_TOTAL     0 or 1: what is read is scaled to the pixel's own total absorbance, of its own
//                  state
//   BLOCK_NUMBER   as the storage of blocks keeps a number of a state, if it is given
//   HOLDS_BLOCKS   if it is, hold_block(block, at) follows: what the storage keeps of the numbers
//                  of a set that begin at `at` of `blocks`

#if PASS < OVER_TRIANGLES
#include "arrays/let_through.glsl"
#endif

#if OF_BLOCKS == 1
#define SET_SIZE (STATE_SIZE / BLOCK_SETS)
#if BLOCK_MEANS
#define SET_NUMBERS (SET_SIZE - 1u)
#else
#define SET_NUMBERS SET_SIZE
#endif
#ifndef BLOCK_NUMBER
#define BLOCK_NUMBER(x) (x)
#endif

// STATE_SIZE a block
layout(std430, binding = BLOCKS) restrict buffer Blocks { SCALAR blocks[]; };

#if PASS == BLOCK_FIRST || PASS == BLOCK_SECOND
layout(std430, binding = ASKED) readonly restrict buffer Taken { uint taken[]; }; // blocks + 1

#ifdef HOLDS_BLOCKS
void hold_block(uint block, uint at);
#endif

void own_pass(uint block) {
    const uint set = PASS == BLOCK_FIRST ? 0u : SET_SIZE;
    precise double total = 0.0;
    precise double sum[SET_NUMBERS];
    for (uint k = 0u; k < SET_NUMBERS; ++k) sum[k] = 0.0;
    uint begin = taken[block];
    uint end = taken[block + 1u];
    for (uint p = begin; p < end; ++p) {
        uint from = STATE_SIZE * p + set;
        double weight = BLOCK_MEANS == 1 ? double(state[from + SET_SIZE - 1u]) : 1.0;
        total += weight;
        for (uint k = 0u; k < SET_NUMBERS; ++k) {
            precise double part = weight * double(state[from + k]);
            sum[k] += part;
        }
    }
    uint at = STATE_SIZE * block + set;
    double pixels = double(end - begin);
    for (uint k = 0u; k < SET_NUMBERS; ++k) {
#if BLOCK_MEANS
        precise double mean = total > 0.0 ? sum[k] / total : 0.0;
#else
        precise double mean = sum[k] / pixels;
#endif
        blocks[at + k] = SCALAR(BLOCK_NUMBER(double(SCALAR(mean))));
    }
#if BLOCK_MEANS
    precise double of_pixel = total / pixels;
    blocks[at + SET_NUMBERS] = SCALAR(of_pixel);
#endif
#ifdef HOLDS_BLOCKS
    hold_block(block, at);
#endif
}
#endif

#if PASS == BLOCK_READ
#include "kernels/upsampling.h"
#include "arrays/squares.glsl"

#ifndef FROM_TRIANGLES
uniform uint guided; // 1: shares go by the depth of opaque surfaces, of pixels, then of blocks
layout(std430, binding = ASKED) readonly restrict buffer Guides { double guides[]; };
#endif
#if !BLOCK_MEANS
uniform double total_weights[STATE_SIZE]; // of the sum that is the total absorbance
#endif

void own_pass(uint p) {
    uint pixel = first_pixel + p;
    two_blocks x = blocks_across_from(pixel);
    two_blocks y = blocks_down_from(pixel);
    four_shares of = bilinear_shares(x.share, y.share);
    uint place[4];
    for (int i = 0; i < 4; ++i) place[i] = block_between(x, y, i);
#ifndef FROM_TRIANGLES
    if (guided == 1u)
        of = depth_aware_shares(of, guides[p], guides[count + place[0]], guides[count + place[1]],
                                guides[count + place[2]], guides[count + place[3]]);
#endif
    double share[4] = double[4](of.upper_left, of.upper_right, of.lower_left, of.lower_right);
    for (uint set = 0u; set < STATE_SIZE; set += SET_SIZE) {
        uint to = STATE_SIZE * p + set;
        precise double sum[SET_NUMBERS];
        for (uint k = 0u; k < SET_NUMBERS; ++k) sum[k] = 0.0;
        precise double total = 0.0;
        for (int i = 0; i < 4; ++i) {
            uint from = STATE_SIZE * place[i] + set;
#if BLOCK_MEANS
            precise double part = share[i] * double(blocks[from + SET_NUMBERS]);
            total += part;
#else
            double part = share[i];
#endif
            for (uint k = 0u; k < SET_NUMBERS; ++k) {
                precise double more = part * double(blocks[from + k]);
                sum[k] += more;
            }
        }
#if BLOCK_MEANS
        for (uint k = 0u; k < SET_NUMBERS; ++k) {
            precise double mean = total > 0.0 ? sum[k] / total : 0.0;
            state[to + k] = SCALAR(mean);
        }
        if (FULL_TOTAL == 0) state[to + SET_NUMBERS] = SCALAR(total);
#else
        precise double scale = 1.0;
#if FULL_TOTAL
        precise double own = 0.0;
        for (uint k = 0u; k < SET_NUMBERS; ++k) {
            precise double more = total_weights[k] * sum[k];
            total += more;
            more = total_weights[k] * double(state[to + k]);
            own += more;
        }
        scale = total > 0.0 ? own / total : 0.0;
#endif
        for (uint k = 0u; k < SET_NUMBERS; ++k) {
            precise double number_read = sum[k] * scale;
            state[to + k] = SCALAR(number_read);
        }
#endif
    }
}
#endif

#if PASS == BLOCK_TOTAL
void own_pass(uint p) { set_total(p, let_through(p)); }
#endif
#endif
