#version 450
// Power moments: Muenstermann, Krumpen, Klein and Peters, "Moment-Based Order-Independent
// Transparency", 2018. A pixel keeps b (2 NODES numbers) and b0; of words of 16 bits the words.
//
//   SCALAR, DOUBLE, PASS   arrays/fragments.glsl
//   NODES                  2, 3 or 4, for 4, 6 or 8 moments
//   BITS                   16 or 32: of a stored moment
//   B0_IS_HALF             0 or 1, with 16 bits: b0 is a float or a half float
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
#include "kernels/moment_words.h"
#include "arrays/fragments.glsl"
#include "arrays/means.glsl"
#include "arrays/warp.glsl"
#include "arrays/absorbance.glsl"

#define NUMBERS (2u * NODES)
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
#else
void capture(uint p) {
    precise kept_sum sum[2 * NODES + 1][4];
    for (int k = 0; k <= 2 * NODES; ++k)
        for (int lane = 0; lane < 4; ++lane) sum[k][lane] = nothing_kept();
    uint end = offsets[p + 1u];
    for (uint i = offsets[p]; i < end; i += 4u)
        for (uint lane = 0u; lane < 4u; ++lane) { // as C's lanes add up
            bool there = i + lane < end;
            surface f = surface_at(there ? i + lane : i);
            precise double power = there ? double(absorbance_of(f.alpha)) : 0.0;
            precise double z = there ? double(warped(f.depth)) : 0.0;
            sum[0][lane] = kept_with(sum[0][lane], power);
            for (int k = 1; k <= 2 * NODES; ++k) {
                power = power * z;
                sum[k][lane] = kept_with(sum[k][lane], power);
            }
        }
    precise double total = total_kept(sum[0][0], sum[0][1], sum[0][2], sum[0][3]);
    precise double inverse = inverse_of_sum(total);
    for (int k = 1; k <= 2 * NODES; ++k) {
        precise double all = total_kept(sum[k][0], sum[k][1], sum[k][2], sum[k][3]);
        state[STATE_SIZE * p + k - 1] = SCALAR(all * inverse);
    }
    state[STATE_SIZE * p + NUMBERS] = SCALAR(total);
}
#endif
#endif

// Of triangles: targets of 32 bits add up terms; words of 16 bits take one fragment after the
// other.

#if PASS == DRAW_TERMS
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

uniform double bias;
uniform double safe[2 * NODES]; // what bias moves moments toward
uniform double least;           // pivots below are rounding alone

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
    rule r = gauss_rule(m, bias, far_from_degenerate, least);
    for (int i = 0; i < NODES; ++i) {
        SCALAR g = SCALAR(r.g[i]);
        factors[FACTORS_SIZE * p + i] = g;
        factors[FACTORS_SIZE * p + NODES + i] = SCALAR(r.g[i] - double(g));
        factors[FACTORS_SIZE * p + 2u * NODES + i] = SCALAR(r.e[i]);
    }
    factors[FACTORS_SIZE * p + 3u * NODES] = SCALAR(r.d);
    factors[FACTORS_SIZE * p + 3u * NODES + 1u] = SCALAR(b0);
#if BOUNDED
    outline o = outline_of(r, b0);
    values begun = first_sums(0, o);
    factors[FACTORS_SIZE * p + OUTLINE] = SCALAR(o.mean);
    factors[FACTORS_SIZE * p + OUTLINE + 1u] = SCALAR(o.inverse_deviation);
    factors[FACTORS_SIZE * p + OUTLINE + 2u] = SCALAR(o.inverse_total);
    for (uint k = 0u; k < uint(HIDDEN); ++k)
        factors[FACTORS_SIZE * p + OUTLINE + 3u + k] = SCALAR(begun.x[k]);
#endif
    set_total(p, exponential(-b0));
}
#endif

#if READS
uniform number beta;

rule ray;
number ray_b0;
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
#if BOUNDED
    ray_outline.mean = factors[FACTORS_SIZE * p + OUTLINE];
    ray_outline.inverse_deviation = factors[FACTORS_SIZE * p + OUTLINE + 1u];
    ray_outline.inverse_total = factors[FACTORS_SIZE * p + OUTLINE + 2u];
    for (uint k = 0u; k < uint(HIDDEN); ++k)
        ray_begun.x[k] = factors[FACTORS_SIZE * p + OUTLINE + 3u + k];
#endif
}

number in_front(uint p, surface s) {
    if (ray_b0 == K(0.0)) return K(ABSORBS == 1 ? 0.0 : 1.0);
#if BOUNDED
    outlook seen = outlook_at(ray, ray_outline, ray_b0, warped(s.depth), absorbance_of(s.alpha));
    real before = predicted_absorbance(0, ray_begun, seen);
    return ABSORBS == 1 ? number(before) : exponential(-before);
#else
    number own = own_absorbance(s.alpha);
#if ABSORBS == 1
    return absorbance_before(ray, ray_b0, warped(s.depth), own, beta);
#else
    return transmittance(ray, ray_b0, warped(s.depth), own, beta);
#endif
#endif
}
#endif
#endif
#include "arrays/blocks.glsl"
#include "arrays/questions.glsl"
