#version 450
// Slices of optical depth at equal steps of each pixel's own extent, which a network reads
// (kernels/slice_network.h).
//
//   SCALAR, DOUBLE, PASS   arrays/fragments.glsl
//   SLOTS                  2 to 256 slices
//   ROUND                  of DRAW_WORDS 0: where pixels begin and end; 1: slices
#include "arrays/reads.glsl"
#include "kernels/dialect.glsl"
#include "kernels/elementary.h"
#include "kernels/storage.h"
#include "kernels/warp.h"
#include "kernels/own_extent.h"
#include "kernels/slices.h"
#define WIDEST 10
layout(std430, binding = NETWORK) readonly restrict buffer Network { float network[]; };
#include "kernels/network.h"
#include "kernels/slice_network.h"
#include "arrays/fragments.glsl"
#include "arrays/warp.glsl"
#include "arrays/absorbance.glsl"

uniform uint first_pixel;
uniform uint image_width;
uniform uint image_top; // in the display, as the columns
uniform uint image_left;
uniform number code_scale;
uniform number code_most;
uniform double quantum; // optical depth of a step

// Of a pixel twice 0, then what its slices get; later the sums of these up to each, and of all
// again. In factors where its extent begins and ends.
#define SUMS (uint(SLOTS) + 3u)
layout(std430, binding = STATE) buffer Words { uint sums[]; };

own_extent extent_held(uint p) {
    own_extent e;
    e.nearest = factors[FACTORS_SIZE * p];
    e.farthest = factors[FACTORS_SIZE * p + 1u];
    return e;
}

number code_of(uint p, surface s) {
    uint pixel = first_pixel + p;
    real threshold = own_slice_threshold(pixel / image_width + image_top,
                                         pixel % image_width + image_left, warped(s.depth));
    return slice_code(absorbance_of(s.alpha), code_scale, code_most, threshold);
}

slice_place place_of(uint p, surface s) {
    return own_slice_place(extent_held(p), warped(s.depth), K(SLOTS - 1));
}

#if PASS == EXTENT || PASS == BETWEEN
// By the words of its ends, before any fragment is added.
void begin_slices(uint p, number nearest, number farthest) {
    for (uint k = 0u; k < SUMS; ++k) sums[SUMS * p + k] = 0u;
    own_extent e = extent_of_words(nearest, farthest);
    factors[FACTORS_SIZE * p] = SCALAR(e.nearest);
    factors[FACTORS_SIZE * p + 1u] = SCALAR(e.farthest);
}
#elif PASS == DEPOSIT || PASS == DRAW_WORDS
#include "arrays/added.glsl"

void deposit(uint p, surface s) {
    slice_place place = place_of(p, s);
    number code = code_of(p, s);
    uint near = uint(slice_near(code, place.inside));
    uint first = SUMS * p + uint(place.cell) + 2u;
    add(first, near);
    add(first + 1u, uint(code) - near);
}
#endif

#if PASS == EXTENT
void own_pass(uint p) {
    number nearest = K(1.0);
    number farthest = K(-1.0);
    for (uint i = offsets[p]; i < offsets[p + 1u]; ++i) {
        surface s = surface_at(i);
        number z = warped(s.depth);
        nearest = s.alpha > K(0.0) ? min(nearest, z) : nearest;
        farthest = s.alpha > K(0.0) ? max(farthest, z) : farthest;
    }
    begin_slices(p, word_at_most(nearest), word_at_least(farthest));
}
#elif PASS == BETWEEN
void after_round(uint p) {
    begin_slices(p, number(65535u - indices[2u * p]), number(indices[2u * p + 1u]));
}
#elif PASS == CAPTURE
#include "arrays/let_through.glsl"

void capture(uint p) { set_total(p, let_through(p)); }
#elif PASS == DEPOSIT
void own_pass(uint p, surface s) { deposit(p, s); }
#elif PASS == DRAW_WORDS
void change_words(surface s, uint p) {
#if ROUND == 0
    // in `indices` the greatest of each: how near the pixel begins, and how far it ends
    if (s.alpha > K(0.0)) {
        atomicMax(indices[2u * p], 65535u - uint(word_at_most(warped(s.depth))));
        atomicMax(indices[2u * p + 1u], uint(word_at_least(warped(s.depth))));
    }
#else
    deposit(p, s);
#endif
}
#elif PASS == FACTOR
void factor(uint p) {
    uint sum = 0u;
    for (uint k = 1u; k < SUMS; ++k) {
        sum += min(sums[SUMS * p + k], uint(code_most));
        sums[SUMS * p + k] = sum;
    }
}
#elif READS
void load_ray(uint p) {}

number in_front(uint p, surface s) {
    slice_place place = place_of(p, s);
    uint first = SUMS * p + uint(place.cell);
    slice_sums around;
    around.outer = number(sums[first]);
    around.front = number(sums[first + 1u]);
    around.middle = number(sums[first + 2u]);
    around.back = number(sums[first + 3u]);
    around.beyond = number(sums[first + 4u]);
    around.all = number(sums[SUMS * p + uint(SLOTS) + 1u]);
    number code = code_of(p, s);
    slice_outlook seen = slice_outlook_at(around, place.inside, slice_near(code, place.inside),
                                          code, absorbance_of(s.alpha), number(quantum));
    real x = seen.least + slice_share(0, seen.seen) * seen.room;
    return ABSORBS == 1 ? number(x) : exponential(-x);
}
#endif
#include "arrays/multiplied_up.glsl"
#include "arrays/questions.glsl"
