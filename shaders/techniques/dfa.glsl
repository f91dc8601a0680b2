#version 450
// Deep fragments: the two nearest fragments of a pixel, and of the others sums, of which a network
// makes a colour (kernels/deep_fragments.h).
//
//   SCALAR, DOUBLE, PASS   arrays/fragments.glsl
#include "arrays/bindings.glsl"
#include "kernels/dialect.glsl"
#include "kernels/elementary.h"
#include "kernels/storage.h"
#include "kernels/warp.h"
#define WIDEST 32
layout(std430, binding = NETWORK) readonly restrict buffer Network { float network[]; };
#include "kernels/network.h"
#include "kernels/deep_fragments.h"
#include "arrays/fragments.glsl"
#include "arrays/warp.glsl"
#include "arrays/absorbance.glsl"
#include "arrays/ranks.glsl"

// Of a pixel: depths of the second, the first and the last fragment, b0, absorbances of the first
// and the second, what passes the first and both, their colour, and sums of the others: weighted,
// weighted colour, colour.
#define FIRST_Z (STATE_SIZE * p)
#define SECOND_Z (STATE_SIZE * p + 1u)
#define LAST_Z (STATE_SIZE * p + 2u)
#define B0 (STATE_SIZE * p + 3u)
#define FIRST_A (STATE_SIZE * p + 4u)
#define SECOND_A (STATE_SIZE * p + 5u)
#define BEHIND_FIRST (STATE_SIZE * p + 6u)
#define THROUGH (STATE_SIZE * p + 7u)
#define FRONT (STATE_SIZE * p + 8u)
#define SUMS (STATE_SIZE * p + 11u)
// What that comes to: the absorbance behind the second, the share of the first guess, and what
// these others cover in the image.
#define TAIL (FACTORS_SIZE * p)
#define SHARE (FACTORS_SIZE * p + 1u)
#define COVERED (FACTORS_SIZE * p + 2u)

#if PASS == CAPTURE
uniform uint coloured; // whether there are colours

void capture(uint p) {
    uint begin = offsets[p];
    uint end = offsets[p + 1u];
    for (uint k = 0u; k < STATE_SIZE; ++k) state[STATE_SIZE * p + k] = SCALAR(k == 7u ? 1.0 : 0.0);
    precise number through = K(1.0);
    precise number front[3] = number[3](K(0.0), K(0.0), K(0.0));
    for (uint k = 0u; k < 2u; ++k)
        if (begin + k < end) {
            surface f = surface_at(indices[begin + k]);
            precise number seen = through * f.alpha;
            number z = warped(f.depth);
            if (k == 0u) state[FIRST_Z] = SCALAR(z);
            state[SECOND_Z] = SCALAR(z);
            state[FIRST_A + k] = SCALAR(absorbance_of(f.alpha));
            for (uint c = 0u; c < 3u; ++c)
                if (coloured == 1u) front[c] = front[c] + seen * color_of(f, c);
            through = through * (K(1.0) - f.alpha);
            state[BEHIND_FIRST + k] = SCALAR(through);
        }
    state[THROUGH] = SCALAR(through);
    for (uint c = 0u; c < 3u; ++c) state[FRONT + c] = SCALAR(front[c]);
    if (begin < end)
        state[LAST_Z] = SCALAR(rounded_to_half(warped(number(depths[indices[end - 1u]]))));
    precise double sum[4] = double[4](0.0, 0.0, 0.0, 0.0);
    for (uint i = begin; i < end; i += 4u)
        for (uint lane = 0u; lane < 4u; ++lane) { // as C's lanes add up
            bool there = i + lane < end;
            number alpha = number(alphas[there ? i + lane : i]);
            sum[lane] += there ? double(absorbance_of(alpha)) : 0.0;
        }
    precise double total = (sum[0] + sum[1]) + (sum[2] + sum[3]);
    state[B0] = SCALAR(total);
}
#endif

#if PASS == BLEND_TAIL
uniform uint coloured;

void own_pass(uint p) {
    uint begin = offsets[p];
    uint end = offsets[p + 1u];
    if (end - begin < 3u) return;
    uint first = indices[begin];
    uint second = indices[begin + 1u];
    number sum[7];
    for (int k = 0; k < 7; ++k) sum[k] = K(0.0);
    for (uint i = begin; i < end; ++i) {
        surface f = surface_at(i);
        bool behind = i != first && i != second;
        precise number a = behind ? absorbance_of(f.alpha) : K(0.0);
        precise number weighted =
            a * even_transmittance(state[B0], state[SECOND_Z], state[LAST_Z], warped(f.depth));
        sum[0] = half_sum(sum[0], weighted);
        for (int c = 0; c < 3; ++c) {
            number color = coloured == 1u ? color_of(f, uint(c)) : K(0.0);
            sum[1 + c] = half_sum(sum[1 + c], weighted * color);
            sum[4 + c] = half_sum(sum[4 + c], a * color);
        }
    }
    for (int k = 0; k < 7; ++k) state[SUMS + k] = SCALAR(sum[k]);
}
#endif

#if PASS == MIX
void own_pass(uint p) {
    real through = state[THROUGH];
    real near = state[SUMS];
    real tail = tail_absorbance(state[B0], state[FIRST_A], state[SECOND_A]);
    values seen = deep_features(tail, near, state[FIRST_Z], state[SECOND_Z], state[LAST_Z]);
    real covered = through * covered_by(tail);
    real passes = through * seen.x[2];
    factors[TAIL] = SCALAR(tail);
    factors[SHARE] = SCALAR(deep_share(0, seen, near));
    factors[COVERED] = SCALAR(covered);
    set_total(p, double(passes));
}
#endif

#if PASS == TRANSMITTANCE
void load_ray(uint p) {}

number in_front(uint p, surface s) {
    uint first = indices[offsets[p]];
    bool second = offsets[p] + 1u < offsets[p + 1u] && indices[offsets[p] + 1u] == s.place;
    number even =
        even_transmittance(state[B0], state[SECOND_Z], state[LAST_Z], warped(s.depth));
    number T = deep_transmittance(state[THROUGH], factors[COVERED], factors[SHARE], state[SUMS], factors[TAIL],
                                  absorbance_of(s.alpha), even, s.alpha);
    T = second ? number(state[BEHIND_FIRST]) : T;
    return first == s.place ? K(1.0) : T;
}
#endif

#if PASS == COMPOSITE
#define RESOLVES

contribution resolved(uint p) {
    precise contribution sum;
    for (uint c = 0u; c < 3u; ++c) {
        real behind = deep_color(factors[COVERED], factors[SHARE], state[SUMS + 1u + c],
                                 state[SUMS], state[SUMS + 4u + c], factors[TAIL]);
        real color = state[FRONT + c] + behind;
        sum.color[c] = double(color);
    }
    sum.covers = 1.0 - totals[4u * p];
    return sum;
}
#endif
#include "arrays/questions.glsl"
