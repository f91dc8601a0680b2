#version 450
// Power moments: Muenstermann, Krumpen, Klein and Peters, "Moment-Based Order-Independent
// Transparency", 2018. A pixel keeps b (2 NODES numbers) and b0; of words of 16 bits the words.
//
//   SCALAR, DOUBLE, PASS   arrays/fragments.glsl
//   NODES                  1, 2, 3 or 4, for 2, 4, 6 or 8 moments
//   BITS                   16 or 32: of a stored moment
//   B0_IS_HALF             0 or 1, with 16 bits: b0 is a float or a half float
//   HALVES                 0 or 1, with 32 bits: half floats, to which fragments add terms
//   OWN_EXTENT             0 or 1, with HALVES: of each pixel's own extent, which is in words, and
//                          of Chebyshev polynomials
//   OWN_UNITS              0 or 1, with BOUNDED: how long pixels' own ranges of depth are is given
//   ROUND                  of triangles that are drawn twice for these: 0 finds extents, 1 moments
//   LAYERS                 0, or how many of the nearest fragments are kept: moments are then of
//                          all others (arrays/front.glsl)
//   BOUNDED                0 or 1: a network decides between the moments' bounds
//                          (kernels/bounded_neural.h)
//   ENGINE                 0 or 1: factors and what is read of them are as engines ship them, in
//                          floats alone (engine/power4.glsl and its kin); of words of 32 bits
#include "meshes/extensions.glsl"
#include "arrays/reads.glsl"
#if ENGINE && (PASS == FACTOR || READS)
#include "arrays/begin_engine.glsl"
#if BOUNDED
layout(std430, binding = NETWORK) readonly restrict buffer Network { float network[]; };
#undef NETWORK
#define NETWORK network
#define NETWORK_GIVEN
#include "engine/bounded.glsl"
#elif NODES == 2
#include "engine/power4.glsl"
#elif NODES == 3
#include "engine/power6.glsl"
#else
#include "engine/power8.glsl"
#endif
#include "arrays/end_engine.glsl"
#endif
#include "kernels/dialect.glsl"
#include "kernels/elementary.h"
#include "kernels/storage.h"
#include "kernels/kept_sums.h"
#include "kernels/warp.h"
#include "kernels/power_moments.h"
#if BITS == 16
#include "kernels/moment_words.h"
#endif
#include "kernels/own_extent.h"
#include "kernels/half_moments.h"
#include "arrays/fragments.glsl"
#include "arrays/means.glsl"
#include "arrays/warp.glsl"
#include "arrays/absorbance.glsl"

#define NUMBERS (2 * NODES)
#include "arrays/front.glsl"

// With OWN_EXTENT the last two of factors are where it begins and ends.
own_extent extent_held(uint p) {
    own_extent e;
    e.nearest = factors[FACTORS_SIZE * p + FACTORS_SIZE - 2u];
    e.farthest = factors[FACTORS_SIZE * p + FACTORS_SIZE - 1u];
    return e;
}

void hold_extent(uint p, own_extent e) {
    factors[FACTORS_SIZE * p + FACTORS_SIZE - 2u] = SCALAR(e.nearest);
    factors[FACTORS_SIZE * p + FACTORS_SIZE - 1u] = SCALAR(e.farthest);
}

// Depth as moments are taken of it.
number depth_in(own_extent e, number depth) {
#if OWN_EXTENT
    return depth_within(e, warped(depth));
#else
    return warped(depth);
#endif
}

void hold_halves(uint p, half_sums s) {
    moments m = moments_of_halves(OWN_EXTENT, s);
    for (int k = 0; k < 2 * NODES; ++k) state[STATE_SIZE * p + k] = SCALAR(m.b[k]);
    state[STATE_SIZE * p + NUMBERS] = SCALAR(s.b0);
}

#if PASS == EXTENT
void own_pass(uint p) {
    number nearest = K(1.0);
    number farthest = K(-1.0);
    for (uint i = offsets[p]; i < offsets[p + 1u]; ++i) {
        number z = warped(surface_at(i).depth);
        nearest = min(nearest, z);
        farthest = max(farthest, z);
    }
    hold_extent(p, extent_of_words(word_at_most(nearest), word_at_least(farthest)));
}
#endif

// In factors: nodes, what rounding took from them, residues, pivot, b0; then, BOUNDED, what of an
// outline fragments share, and what the network's first layer has summed.
#define OUTLINE (3u * NODES + 2u)
#if BOUNDED && !ENGINE
#define WIDEST 10
layout(std430, binding = NETWORK) readonly restrict buffer Network { float network[]; };
#include "kernels/network.h"
#include "kernels/bounded_neural.h"
#endif

#if PASS == CAPTURE
#if BITS == 16
void capture(uint p) {
    stored s;
    for (int k = 0; k < 2 * NODES; ++k) s.word[k] = K(0.0);
    s.b0 = K(0.0);
    for (uint i = offsets[p]; i < offsets[p + 1u]; ++i) {
        surface f = surface_at(i);
        s = blended(s, power_terms(warped(f.depth)), absorbance_of(f.alpha), B0_IS_HALF);
    }
    for (int k = 0; k < 2 * NODES; ++k) state[STATE_SIZE * p + k] = SCALAR(s.word[k]);
    state[STATE_SIZE * p + NUMBERS] = SCALAR(s.b0);
}
#elif HALVES
void capture(uint p) {
    own_extent e = extent_held(p);
    half_sums s = nothing_in_halves();
    for (uint i = offsets[p]; i < offsets[p + 1u]; ++i) {
        surface f = surface_at(i);
        half_sums t = half_terms(OWN_EXTENT, absorbance_of(f.alpha), depth_in(e, f.depth));
        s = added_in_halves(s, t);
    }
    hold_halves(p, s);
}
#endif
#endif

#if GATHERS && BITS == 32 && !HALVES
#include "arrays/power_sums.glsl"

#if PASS == CAPTURE
void capture(uint p) {
    gather(p, offsets[p + 1u] - offsets[p]);
    for (int k = 0; k < NUMBERS; ++k) state[STATE_SIZE * p + k] = SCALAR(mean_gathered[k]);
    state[STATE_SIZE * p + NUMBERS] = SCALAR(total_gathered);
#if LAYERS
    hold_nearest(p);
#endif
}
#endif
#endif

// Of triangles: targets of 32 bits add up terms; words of 16 bits take one fragment after the
// other.

#if HALVES
#if PASS == DRAW_TERMS
void set_terms(surface s, uint p) {
#if OWN_EXTENT && ROUND == 0
    own_extent e = own_extent(K(-1.0), K(1.0)); // not yet known
#else
    own_extent e = extent_held(p);
#endif
    half_sums t = half_terms(OWN_EXTENT, absorbance_of(s.alpha), depth_in(e, s.depth));
    for (int k = 0; k < 2 * NODES; ++k) numbers[k] = t.sum[k];
    numbers[2 * NODES] = t.b0;
#if OWN_EXTENT
    numbers[2 * NODES + 1] = K(65535.0) - word_at_most(warped(s.depth));
    numbers[2 * NODES + 2] = word_at_least(warped(s.depth));
#endif
}
#elif PASS == COLLECT
void collect(uint p) {
    half_sums s;
    for (int k = 0; k < 2 * NODES; ++k) s.sum[k] = numbers[k];
    s.b0 = numbers[2 * NODES];
    hold_halves(p, s);
#if OWN_EXTENT
    hold_extent(p, extent_of_words(K(65535.0) - numbers[2 * NODES + 1], numbers[2 * NODES + 2]));
#endif
}
#elif PASS == BETWEEN
void after_round(uint p) {}
#endif
#elif PASS == DRAW_TERMS
void set_terms(surface s, uint p) {
    real power = absorbance_of(s.alpha);
    real z = warped(s.depth);
    numbers[2 * NODES] = power;
    for (int k = 0; k < 2 * NODES; ++k) {
        power = power * z;
        numbers[k] = power;
    }
}
#elif PASS == DRAW_ORDERED
void take(surface s) {
    stored held;
    for (int k = 0; k < 2 * NODES; ++k) held.word[k] = numbers[k];
    held.b0 = numbers[2 * NODES];
    held = blended(held, power_terms(warped(s.depth)), absorbance_of(s.alpha), B0_IS_HALF);
    for (int k = 0; k < 2 * NODES; ++k) numbers[k] = held.word[k];
    numbers[2 * NODES] = held.b0;
}
#elif PASS == COLLECT
void collect(uint p) {
    number b0 = numbers[2 * NODES];
    real inverse = inverse_held(b0);
    for (int k = 0; k < 2 * NODES; ++k)
        state[STATE_SIZE * p + k] = BITS == 16 ? numbers[k] : numbers[k] * inverse;
    state[STATE_SIZE * p + NUMBERS] = b0;
}
#endif

#if ENGINE
#include "arrays/engine_moments.glsl"
#else
#if PASS == FACTOR
#include "kernels/pairs.h"
#include "kernels/power_rules.h"

#if OWN_UNITS
// Half of what of the image's range, which is 2, a pixel's own is.
layout(std430, binding = WEIGHTS) readonly restrict buffer Units { double units[]; };
#endif

#if !LAYERS
uniform double bias;
uniform double safe[2 * NODES]; // what bias moves moments toward
#endif
uniform double least; // pivots below are rounding alone

void factor(uint p) {
    double b0 = double(state[STATE_SIZE * p + NUMBERS]);
    if (b0 == 0.0) { // as most pixels of many pictures; nothing asks for more
        factors[FACTORS_SIZE * p + 3u * NODES + 1u] = SCALAR(0.0);
        set_total(p, 1.0);
        return;
    }
    moments m;
    moments far_from_degenerate;
    for (int k = 0; k < 2 * NODES; ++k) {
        m.b[k] = double(state[STATE_SIZE * p + k]);
        far_from_degenerate.b[k] = safe[k];
    }
#if BITS == 16
    stored s;
    for (int k = 0; k < 2 * NODES; ++k) s.word[k] = m.b[k];
    s.b0 = b0;
    decoded d = power_decoded(s);
    for (int k = 0; k < 2 * NODES; ++k) m.b[k] = double(SCALAR(d.b[k]));
#endif
#if LAYERS
    b0 = tail_of(p, b0, m.b);
    m.b = tail_mean;
    if (b0 == 0.0) {
        factors[FACTORS_SIZE * p + 3u * NODES + 1u] = SCALAR(0.0);
        return;
    }
    rule r = gauss_rule(0, m, K(0.0), far_from_degenerate, K(1e-15));
#else
    rule r = gauss_rule(HELD_AS_FLOATS, m, bias, far_from_degenerate, least);
#endif
    for (int i = 0; i < NODES; ++i) {
        SCALAR g = SCALAR(r.g[i]);
        factors[FACTORS_SIZE * p + i] = g;
        factors[FACTORS_SIZE * p + NODES + i] = SCALAR(r.g[i] - double(g));
        factors[FACTORS_SIZE * p + 2u * NODES + i] = SCALAR(r.e[i]);
    }
    factors[FACTORS_SIZE * p + 3u * NODES] = SCALAR(r.d);
    factors[FACTORS_SIZE * p + 3u * NODES + 1u] = SCALAR(b0);
#if BOUNDED
#if OWN_EXTENT
    real unit = 0.5 * (double(factors[FACTORS_SIZE * p + FACTORS_SIZE - 1u])
                       - double(factors[FACTORS_SIZE * p + FACTORS_SIZE - 2u]));
#elif OWN_UNITS
    real unit = units[p];
#else
    real unit = K(1.0);
#endif
    outline o = outline_of(r, b0, unit);
    values begun = first_sums(0, o);
    factors[FACTORS_SIZE * p + OUTLINE] = SCALAR(o.mean);
    factors[FACTORS_SIZE * p + OUTLINE + 1u] = SCALAR(o.inverse_deviation);
    factors[FACTORS_SIZE * p + OUTLINE + 2u] = SCALAR(o.inverse_total);
    for (uint k = 0u; k < uint(HIDDEN); ++k)
        factors[FACTORS_SIZE * p + OUTLINE + 3u + k] = SCALAR(begun.x[k]);
#endif
#if !LAYERS
    set_total(p, exponential(-b0));
#endif
}
#endif

#if READS
uniform number beta;

rule ray;
number ray_b0;
own_extent ray_extent;
#if BOUNDED
outline ray_outline;
values ray_begun;
#endif

void load_ray(uint p) {
    for (int k = 0; k < NODES; ++k) {
        ray.g[k] = factors[FACTORS_SIZE * p + k];
        ray.g_low[k] = factors[FACTORS_SIZE * p + NODES + k];
        ray.e[k] = factors[FACTORS_SIZE * p + 2u * NODES + k];
    }
    ray.d = factors[FACTORS_SIZE * p + 3u * NODES];
    ray_b0 = factors[FACTORS_SIZE * p + 3u * NODES + 1u];
    ray_extent = extent_held(p);
#if BOUNDED
    ray_outline.mean = factors[FACTORS_SIZE * p + OUTLINE];
    ray_outline.inverse_deviation = factors[FACTORS_SIZE * p + OUTLINE + 1u];
    ray_outline.inverse_total = factors[FACTORS_SIZE * p + OUTLINE + 2u];
    for (uint k = 0u; k < uint(HIDDEN); ++k)
        ray_begun.x[k] = factors[FACTORS_SIZE * p + OUTLINE + 3u + k];
#endif
}

#if LAYERS
number in_tail(uint p, surface s) {
#else
number in_front(uint p, surface s) {
#endif
    if (ray_b0 == K(0.0)) return K(ABSORBS == 1 ? 0.0 : 1.0);
    number z = depth_in(ray_extent, s.depth);
#if BOUNDED
    outlook seen = outlook_at(ray, ray_outline, ray_b0, z, absorbance_of(s.alpha));
    real before = predicted_absorbance(0, ray_begun, seen);
    return ABSORBS == 1 ? number(before) : exponential(-before);
#else
    number own = own_absorbance(s.alpha);
#if ABSORBS == 1
    return absorbance_before(ray, ray_b0, z, own, beta);
#else
    return transmittance(ray, ray_b0, z, own, beta);
#endif
#endif
}
#endif
#endif
#include "arrays/blocks.glsl"
#include "arrays/questions.glsl"
