#version 450
// The strongest fragments of a pixel, which occlude exactly, and six moments of all others in half
// floats of the pixel's own extent, between whose bounds a network decides.
//
//   SCALAR, DOUBLE, PASS   arrays/fragments.glsl
//   ANCHORS, LARGE_KEYS    how many are kept (kernels/anchors.h), and whether keys have 64 bits
//   NODES                  3, for six moments
#include "arrays/reads.glsl"
#include "kernels/options.h"
#include "kernels/dialect.glsl"
#include "kernels/elementary.h"
#include "kernels/storage.h"
#include "kernels/warp.h"
#include "kernels/power_moments.h"
#include "kernels/own_extent.h"
#include "kernels/half_moments.h"
#define KEPT_ROOM ANCHORS
#define CELL_ROOM 1
#include "kernels/anchors.h"
#define WIDEST 10
layout(std430, binding = NETWORK) readonly restrict buffer Network { float network[]; };
#include "kernels/network.h"
#include "kernels/bounded_neural.h"
#include "arrays/fragments.glsl"
#include "arrays/warp.glsl"
#include "arrays/absorbance.glsl"

#define BEHIND_KEYS 0
number place_on_ray(number depth) {
    real share = 0.5 + 0.5 * warped(depth);
    return share;
}
#include "arrays/kept.glsl"

// In state: means of powers, b0. In factors: nodes, what rounding took from them, residues, pivot,
// b0; what fragments share of an outline, and what the network's first layer has summed; where the
// pixel's extent begins and ends; words, then absorbances of what is kept.
#define NUMBERS (2 * NODES)
#define OUTLINE (3 * NODES + 2)
#define ENDS (OUTLINE + 3 + HIDDEN)
#define KEPT_WORDS (ENDS + 2)
uint factor_at(uint p, int k) { return FACTORS_SIZE * p + uint(k); }

own_extent extent_held(uint p) {
    own_extent e;
    e.nearest = factors[factor_at(p, ENDS)];
    e.farthest = factors[factor_at(p, ENDS + 1)];
    return e;
}

// The absorbance of what is kept in front of a word.
double kept_in_front(uint p, number word) {
    precise double absorbed = 0.0;
    for (int k = 0; k < ANCHORS; ++k)
        if (number(factors[factor_at(p, KEPT_WORDS + k)]) < word)
            absorbed += double(factors[factor_at(p, KEPT_WORDS + ANCHORS + k)]);
    return absorbed;
}

// What a fragment adds to moments.
number rest_of(uint p, surface s) {
    bool kept = is_kept(whole_key(s), key_held(p, ANCHORS - 1));
    return kept ? K(0.0) : absorbance_of(s.alpha);
}

#if PASS == EXTENT
void own_pass(uint p) {
    empty_places(p);
    number nearest = K(1.0);
    number farthest = K(-1.0);
    for (uint i = offsets[p]; i < offsets[p + 1u]; ++i) {
        number z = warped(surface_at(i).depth);
        nearest = min(nearest, z);
        farthest = max(farthest, z);
    }
    own_extent e = extent_of_words(word_at_most(nearest), word_at_least(farthest));
    factors[factor_at(p, ENDS)] = SCALAR(e.nearest);
    factors[factor_at(p, ENDS + 1)] = SCALAR(e.farthest);
}
#elif PASS == KEEP
void own_pass(uint p, surface s) { keep(p, s); }
#elif PASS == CAPTURE
void capture(uint p) {
    for (int k = 0; k < ANCHORS; ++k) { // before the loop, behind which nothing is read
        KEPT_KEY key = NO_KEY;
        if (offsets[p] < offsets[p + 1u]) key = key_held(p, k);
        number absorbed = anchor_absorbance(lower_of(key), shrink);
        factors[factor_at(p, KEPT_WORDS + k)] = SCALAR(word_of_key(key));
        factors[factor_at(p, KEPT_WORDS + ANCHORS + k)] = SCALAR(key != NO_KEY ? absorbed : K(0.0));
    }
    own_extent e = extent_held(p);
    half_sums s = nothing_in_halves();
    for (uint i = offsets[p]; i < offsets[p + 1u]; ++i) {
        surface f = surface_at(i);
        half_sums t = half_terms(1, rest_of(p, f), depth_within(e, warped(f.depth)));
        s = added_in_halves(s, t);
    }
    moments m = moments_of_halves(1, s);
    for (int k = 0; k < NUMBERS; ++k) state[STATE_SIZE * p + uint(k)] = SCALAR(m.b[k]);
    state[STATE_SIZE * p + uint(NUMBERS)] = SCALAR(s.b0);
}
#elif PASS == FACTOR
#include "kernels/pairs.h"
#include "kernels/power_rules.h"

uniform double bias;
uniform double safe[NUMBERS]; // what bias moves moments toward
uniform double least;         // pivots below are rounding alone

void factor(uint p) {
    double b0 = double(state[STATE_SIZE * p + uint(NUMBERS)]);
    precise double all = b0 + kept_in_front(p, K(65536.0));
    set_total(p, exponential(-all));
    factors[factor_at(p, 3 * NODES + 1)] = SCALAR(b0);
    if (b0 == 0.0) return; // nothing asks for more
    moments m;
    moments far_from_degenerate;
    for (int k = 0; k < NUMBERS; ++k) {
        m.b[k] = double(state[STATE_SIZE * p + uint(k)]);
        far_from_degenerate.b[k] = safe[k];
    }
    rule r = gauss_rule(HELD_AS_FLOATS, m, bias, far_from_degenerate, least);
    for (int i = 0; i < NODES; ++i) {
        SCALAR g = SCALAR(r.g[i]);
        factors[factor_at(p, i)] = g;
        factors[factor_at(p, NODES + i)] = SCALAR(r.g[i] - double(g));
        factors[factor_at(p, 2 * NODES + i)] = SCALAR(r.e[i]);
    }
    factors[factor_at(p, 3 * NODES)] = SCALAR(r.d);
    real unit = 0.5 * (double(factors[factor_at(p, ENDS + 1)]) - double(factors[factor_at(p, ENDS)]));
    outline o = outline_of(r, b0, unit);
    values begun = first_sums(0, o);
    factors[factor_at(p, OUTLINE)] = SCALAR(o.mean);
    factors[factor_at(p, OUTLINE + 1)] = SCALAR(o.inverse_deviation);
    factors[factor_at(p, OUTLINE + 2)] = SCALAR(o.inverse_total);
    for (int k = 0; k < HIDDEN; ++k) factors[factor_at(p, OUTLINE + 3 + k)] = SCALAR(begun.x[k]);
}
#elif READS
rule ray;
number ray_b0;
own_extent ray_extent;
outline ray_outline;
values ray_begun;

void load_ray(uint p) {
    for (int k = 0; k < NODES; ++k) {
        ray.g[k] = factors[factor_at(p, k)];
        ray.g_low[k] = factors[factor_at(p, NODES + k)];
        ray.e[k] = factors[factor_at(p, 2 * NODES + k)];
    }
    ray.d = factors[factor_at(p, 3 * NODES)];
    ray_b0 = factors[factor_at(p, 3 * NODES + 1)];
    ray_extent = extent_held(p);
    ray_outline.mean = factors[factor_at(p, OUTLINE)];
    ray_outline.inverse_deviation = factors[factor_at(p, OUTLINE + 1)];
    ray_outline.inverse_total = factors[factor_at(p, OUTLINE + 2)];
    for (int k = 0; k < HIDDEN; ++k) ray_begun.x[k] = factors[factor_at(p, OUTLINE + 3 + k)];
}

number in_front(uint p, surface s) {
    real absorbed = K(0.0);
    if (ray_b0 != K(0.0)) {
        number z = depth_within(ray_extent, warped(s.depth));
        outlook seen = outlook_at(ray, ray_outline, ray_b0, z, rest_of(p, s));
        absorbed = predicted_absorbance(0, ray_begun, seen);
    }
    precise double all = double(SCALAR(absorbed)) + kept_in_front(p, word_of(s));
    absorbed = number(SCALAR(all));
    return ABSORBS == 1 ? number(absorbed) : exponential(-absorbed);
}
#endif
#include "arrays/questions.glsl"
