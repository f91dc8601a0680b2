#version 450
// Transmittance function maps: Delalandre, Gautron, Marvie and Francois, "Transmittance Function
// Mapping", 2011. A pixel keeps coefficients of cosines of the exact transmittance, and its total.
//
//   SCALAR, DOUBLE, PASS   arrays/fragments.glsl
//   COSINES                1 to 32
//   BITS                   16 or 32: of a coefficient, and of the total
//   OF_BLOCKS, ..          arrays/blocks.glsl; of blocks a state is what the map takes of 1, which
//                          adds up: coefficients, and last all of it
#include "kernels/dialect.glsl"
#include "kernels/elementary.h"
#include "kernels/storage.h"
#include "kernels/warp.h"
#include "kernels/transmittance_function.h"
#include "arrays/fragments.glsl"
#include "arrays/warp.glsl"
#include "arrays/absorbance.glsl"
#include "arrays/ranks.glsl"

#if PASS == CAPTURE
number held(number x) {
#if BITS == 16
    return rounded_to_half(x);
#else
    return x;
#endif
}

void capture(uint p) {
    precise double sum[COSINES];
    for (int k = 0; k < COSINES; ++k) sum[k] = 0.0;
    precise double through = 1.0;
    uint end = offsets[p + 1u];
    for (uint at = offsets[p]; at < end; ++at) {
        uint i = indices[at];
        // not by way of a surface: glslang does not come to an end then
        precise number drop = number(alphas[i]) * number(through);
        cosine_series s = series_of_drop(COSINES, drop, warped(number(depths[i])));
        for (int k = 0; k < COSINES; ++k) sum[k] += double(s.c[k]);
        through *= 1.0 - double(alphas[i]);
    }
    cosine_series s;
    for (int k = 0; k < COSINES; ++k) s.c[k] = number(sum[k]);
    s = projected(COSINES, s, number(through));
    for (uint k = 0u; k < COSINES; ++k) state[STATE_SIZE * p + k] = SCALAR(held(s.c[k]));
#if BITS == 16
    through = double(held(number(through)));
#endif
    set_total(p, through);
#if OF_BLOCKS
    uint at = STATE_SIZE * p;
    state[at] = SCALAR(1.0 - double(state[at]));
    state[at + uint(COSINES)] = SCALAR(1.0 - through);
#endif
}
#endif

#if PASS == EXPAND
void own_pass(uint p) {
    uint from = STATE_SIZE * p, to = FACTORS_SIZE * p;
    factors[to] = SCALAR(1.0 - double(state[from]));
    for (uint k = 1u; k < COSINES; ++k) factors[to + k] = state[from + k];
    precise double total = 1.0 - double(state[from + uint(COSINES)]);
    factors[to + uint(COSINES)] = SCALAR(clamp(total, 0.0, 1.0));
}
#endif

#if PASS == TRANSMITTANCE || PASS == CURVE || PASS == COMPOSITE
cosine_series ray;
number ray_total;

void load_ray(uint p) {
#if OF_BLOCKS
    for (uint k = 0u; k < COSINES; ++k) ray.c[k] = factors[FACTORS_SIZE * p + k];
    ray_total = factors[FACTORS_SIZE * p + uint(COSINES)];
#else
    for (uint k = 0u; k < COSINES; ++k) ray.c[k] = state[STATE_SIZE * p + k];
    ray_total = number(totals[4u * p]);
#endif
}

number in_front(uint p, surface s) {
    number own = exclude_self == 1u ? min(s.alpha, max_alpha) : K(0.0);
    return function_transmittance(COSINES, ray, ray_total, warped(s.depth), own);
}
#endif
#if BITS == 16
#define BLOCK_NUMBER(x) rounded_to_half(x)
#endif
#include "arrays/blocks.glsl"
#include "arrays/questions.glsl"
