#version 450
// Neural moment transparency: Tsopouridis, Vasilakis and Fudos, "Neural Moment Transparency", 2024.
// A pixel keeps where its fragments begin and end, how many there are, b0 and four power moments.
//
//   SCALAR, DOUBLE, PASS   arrays/fragments.glsl
//   WORDS                  0: extents are half floats, moments of the scene's range; 1: extents are
//                          words of 16 bits, moments of the pixel's own range
//   ROUND                  of triangles that are drawn twice for these: 0 finds extents, 1 moments
#include "meshes/extensions.glsl"
#include "kernels/dialect.glsl"
#include "kernels/elementary.h"
#include "kernels/storage.h"
#include "kernels/own_extent.h"
#include "kernels/kept_sums.h"
#include "kernels/warp.h"
#define WIDEST 32
layout(std430, binding = NETWORK) readonly restrict buffer Network { float network[]; };
#include "kernels/network.h"
#include "kernels/neural_moments.h"
#include "arrays/fragments.glsl"
#include "arrays/means.glsl"
#include "arrays/warp.glsl"
#include "arrays/absorbance.glsl"

// In factors: nearest, farthest, count, b0, b1 to b4; in state what reaches fragments.

neural_extent extent_held(uint p) {
    neural_extent e;
    e.nearest = factors[FACTORS_SIZE * p];
    e.farthest = factors[FACTORS_SIZE * p + 1u];
    e.blur = extent_blur(WORDS);
    return e;
}

#if PASS == EXTENT
void own_pass(uint p) {
    uint end = offsets[p + 1u];
    number nearest = K(0.0);
    number farthest = K(0.0);
    for (uint i = offsets[p]; i < end; ++i) {
        number z = warped(surface_at(i).depth);
        nearest = i == offsets[p] ? z : min(nearest, z);
        farthest = i == offsets[p] ? z : max(farthest, z);
    }
    neural_extent e = held_extent(WORDS, nearest, farthest);
    factors[FACTORS_SIZE * p] = SCALAR(e.nearest);
    factors[FACTORS_SIZE * p + 1u] = SCALAR(e.farthest);
    factors[FACTORS_SIZE * p + 2u] = SCALAR(end - offsets[p]);
}
#endif

#if PASS == CAPTURE
#define NUMBERS 4
#define LAYERS 0
#define TERM_DEPTH(depth) neural_depth(WORDS, extent_held(p), warped(depth))
#include "arrays/terms.glsl"
#include "arrays/power_sums.glsl"

void capture(uint p) {
    gather(p, offsets[p + 1u] - offsets[p]);
    factors[FACTORS_SIZE * p + 3u] = SCALAR(total_gathered);
    for (int k = 0; k < NUMBERS; ++k)
        factors[FACTORS_SIZE * p + 4u + k] = SCALAR(mean_gathered[k]);
}
#endif

#if PASS == FACTOR
void factor(uint p) { set_total(p, exponential(-double(factors[FACTORS_SIZE * p + 3u]))); }
#endif

// Of triangles: sums of absorbance times powers, b0, the count, and the greatest -z and z.

#if PASS == DRAW_TERMS
void set_terms(surface s, uint p) {
    number z = warped(s.depth);
    real at = z;
#if WORDS == 1 && ROUND == 1
    at = neural_depth(WORDS, extent_held(p), z);
#endif
    real power = absorbance_of(s.alpha);
    numbers[4] = power;
    for (int k = 0; k < 4; ++k) {
        power = power * at;
        numbers[k] = power;
    }
    numbers[5] = K(1.0);
    // rounded here, as targets round to half floats as they like
    numbers[6] = WORDS == 1 ? unorm16_word(0.5 - 0.5 * z) : -rounded_to_half(z);
    numbers[7] = WORDS == 1 ? unorm16_word(0.5 + 0.5 * z) : rounded_to_half(z);
}
#elif PASS == COLLECT
void collect(uint p) {
    number b0 = numbers[4];
    real inverse = inverse_held(b0);
    number nearest = WORDS == 1 ? 1.0 - 2.0 * unorm16_value(numbers[6]) : -numbers[6];
    number farthest = WORDS == 1 ? 2.0 * unorm16_value(numbers[7]) - 1.0 : numbers[7];
    bool there = numbers[5] > K(0.0);
    factors[FACTORS_SIZE * p] = there ? nearest : K(0.0);
    factors[FACTORS_SIZE * p + 1u] = there ? farthest : K(0.0);
    factors[FACTORS_SIZE * p + 2u] = numbers[5];
    factors[FACTORS_SIZE * p + 3u] = b0;
    for (uint k = 0u; k < 4u; ++k) factors[FACTORS_SIZE * p + 4u + k] = numbers[k] * inverse;
}
#elif PASS == BETWEEN
void after_round(uint p) {}
#endif

#if PASS == WEIGH || PASS == CURVE || PASS == DRAW_SHADES
neural_extent ray_extent;
number ray_total;
values ray; // the first layer, as far as the pixel's fragments share it

void load_ray(uint p) {
    ray_extent = extent_held(p);
    number b0 = factors[FACTORS_SIZE * p + 3u];
    ray_total = exponential(-b0);
    values seen = neural_features(factors[FACTORS_SIZE * p + 2u], b0, factors[FACTORS_SIZE * p + 4u],
                                  factors[FACTORS_SIZE * p + 5u], factors[FACTORS_SIZE * p + 6u],
                                  factors[FACTORS_SIZE * p + 7u]);
    ray = neural_ray(0, seen);
}

number reaching(surface s) {
    number z = warped(s.depth);
    number said = neural_share(0, ray, relative_depth(WORDS, ray_extent, z));
    return neural_transmittance(ray_extent, ray_total, z, said);
}
#endif

#if PASS == WEIGH
// A pass of its own, as a thread of few fragments has more patience with a network.
void own_pass(uint p, surface s) {
    load_ray(p);
    state[s.place] = SCALAR(reaching(s));
}
#elif PASS == CURVE || PASS == DRAW_SHADES
number in_front(uint p, surface s) { return reaching(s); }
#elif PASS == TRANSMITTANCE || PASS == COMPOSITE
void load_ray(uint p) {}
number in_front(uint p, surface s) { return number(state[s.place]); }
#endif
#include "arrays/questions.glsl"
