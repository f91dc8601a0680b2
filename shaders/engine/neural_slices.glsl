// Slices of optical depth at equal steps of each pixel's own extent, ours, added up by atomics as
// whole numbers. What slices before a fragment's two hold is in front of it for sure; of what its
// two hold besides its own a network says how much is. Transmittance is the same in any order.
//
// NETWORK  float[169]: of ten inputs, two layers of 8 and one output
//
// Slices, at least two.
#ifndef SLOTS
#define SLOTS 8
#endif
// The most of a slice: 2 to the power of its bits, less 1.
#ifndef CODE_MOST
#define CODE_MOST 255.0
#endif
// How many steps of a slice are optical depth 1.
#ifndef CODE_SCALE
#define CODE_SCALE 46.0184
#endif
#include "engine/common.glsl"
#include "engine/dialect.glsl"
#include "kernels/own_extent.h"
#include "kernels/slices.h"
#define WIDEST 10
#define address int
#define NETWORK_NUMBER(from, i) NETWORK[(from) + (i)]
#include "kernels/network.h"
#include "kernels/slice_network.h"

// Of a pixel: how near it begins and how far it ends, then its slices.
#define WORDS (SLOTS + 2)
#include "engine/pixel_words.glsl"

#define EACH 11
#include "engine/bounded_share.glsl"

// Added up while fragments are shaded: colours; what is let through, which starts at 1 and is
// multiplied by 1 - target1.
struct sums { vec4 target0; float target1; };

// Before all else: where a pixel begins and ends, in words around its fragments.
void extend(uvec2 pixel, uvec2 size, float z, float alpha) {
    uint first = first_word(pixel, size);
    if (alpha > 0.0) {
        max_words(first, 65535u - uint(word_at_most(z)));
        max_words(first + 1u, uint(word_at_least(z)));
    }
}

slice_place place_of(uint first, float z) {
    uint begins = 65535u - load_words(first);
    own_extent e = extent_of_words(float(begins), float(load_words(first + 1u)));
    return own_slice_place(e, z, float(SLOTS - 1));
}

// Whole steps of a fragment, of which those of thin layers count right in the mean of pixels.
float code_of(uvec2 pixel, float z, float alpha) {
    float threshold = own_slice_threshold(pixel.y, pixel.x, z);
    return slice_code(absorbance(alpha), CODE_SCALE, CODE_MOST, threshold);
}

// What a fragment adds to the two slices around it.
void deposit(uvec2 pixel, uvec2 size, float z, float alpha) {
    uint first = first_word(pixel, size);
    slice_place p = place_of(first, z);
    float code = code_of(pixel, z, alpha), here = slice_near(code, p.inside);
    uint at = first + uint(p.cell) + 2u;
    if (here > 0.0) add_words(at, uint(here));
    if (code > here) add_words(at + 1u, uint(code - here));
}

// For each pixel, row by row: sums up to each slice, of which none has more than its most.
void integrate(uint index, uvec2 size) {
    if (index < size.x * size.y) {
        uint first = index * uint(WORDS) + 2u, sum = 0u;
        for (int k = 0; k < int(SLOTS); ++k) {
            sum = sum + min(load_words(first + uint(k)), uint(CODE_MOST));
            store_words(first + uint(k), sum);
        }
    }
}

// What is in slices before the k-th, counted from 1; of all from the last on.
float sum_before(uint first, uint k) {
    float sum = float(load_words(first + min(max(k, 2u), uint(SLOTS + 1))));
    return k < 2u ? 0.0 : sum;
}

// What the j-th output of the first layer is of, but for four of its inputs.
float begun(int j, values seen) {
    int k = EACH * j + 4;
    vec4 more = vec4(seen.x[4], seen.x[5], seen.x[6], seen.x[7]);
    float last = NETWORK[k + 4] * seen.x[8] + (NETWORK[k + 5] * seen.x[9] + NETWORK[k + 6]);
    return weighed(k, more, last);
}

// The share of what may be in front that is counted.
float learnt_share(values seen) {
    vec4 low = vec4(begun(0, seen), begun(1, seen), begun(2, seen), begun(3, seen));
    vec4 high = vec4(begun(4, seen), begun(5, seen), begun(6, seen), begun(7, seen));
    return answer_of(low, high, vec4(seen.x[0], seen.x[1], seen.x[2], seen.x[3]));
}

float transmittance(uvec2 pixel, uvec2 size, float z, float alpha) {
    uint first = first_word(pixel, size);
    slice_place p = place_of(first, z);
    uint cell = uint(p.cell);
    slice_sums s;
    s.outer = sum_before(first, cell);
    s.front = sum_before(first, cell + 1u);
    s.middle = sum_before(first, cell + 2u);
    s.back = sum_before(first, cell + 3u);
    s.beyond = sum_before(first, cell + 4u);
    s.all = sum_before(first, uint(SLOTS + 1));
    float code = code_of(pixel, z, alpha), here = slice_near(code, p.inside);
    float absorbs = absorbance(alpha);
    slice_outlook o = slice_outlook_at(s, p.inside, here, code, absorbs, 1.0 / CODE_SCALE);
    return exponential(-(o.least + learnt_share(o.seen) * o.room));
}

#include "engine/let_through.glsl"
