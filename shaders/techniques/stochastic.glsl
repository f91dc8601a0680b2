#version 450
// Stochastic transparency: Enderton et al., 2011. A pixel keeps the nearest depth that covers each
// of its samples. One sample, and what covers it opaque, is hashed alpha: Wyman and McGuire, 2017.
//
//   SCALAR, DOUBLE, PASS   arrays/fragments.glsl
//   SAMPLES                1 to 64
//   STRATIFIED             0 or 1
//   HASHED_ALPHA           0 or 1
#include "kernels/dialect.glsl"
#include "kernels/hashing.h"
#include "kernels/stochastic.h"
#include "arrays/fragments.glsl"

// What hangs on the pass KEY and what on COVER of a fragment, in `indices`.
// Of a fragment: its key, the samples that it covers.
uint key_of(uint i) { return indices[INDICES_SIZE * i]; }

#if PASS == KEY
uniform uint seed;
uniform uint image_top; // in the display, as the columns
uniform uint image_left;
uniform uint image_width;
uniform uint first_pixel;

void own_pass(uint p, surface s) {
    uint pixel = first_pixel + p;
    uint row = image_top + pixel / image_width;
    uint column = image_left + pixel % image_width;
    indices[INDICES_SIZE * s.place] = fragment_key(seed, row, column, s.depth, s.alpha);
}
#endif

#if PASS == COVER
void own_pass(uint p, surface s) {
    uint key = key_of(s.place);
    uint twin = 0u;
    for (uint i = offsets[p]; i < s.place; ++i) twin += key_of(i) == key ? 1u : 0u;
    coverage c = coverage_of(key, twin, s.alpha, SAMPLES, STRATIFIED);
    indices[INDICES_SIZE * s.place + 1u] = c.low;
    indices[INDICES_SIZE * s.place + 2u] = c.high;
}
#endif

#if PASS == CAPTURE
#include "arrays/let_through.glsl"

void capture(uint p) {
    number nearest[SAMPLES];
    const number infinite = number(uintBitsToFloat(0x7f800000u));
    for (int k = 0; k < SAMPLES; ++k) nearest[k] = infinite;
    uint end = offsets[p + 1u];
    for (uint i = offsets[p]; i < end; ++i) {
        number depth = number(depths[i]);
        uint low = indices[INDICES_SIZE * i + 1u];
        uint high = indices[INDICES_SIZE * i + 2u];
        for (int k = 0; k < SAMPLES; ++k) {
            uint covers = k < 32 ? low >> k : high >> (k - 32);
            nearest[k] = (covers & 1u) == 1u ? min(nearest[k], depth) : nearest[k];
        }
    }
    for (int k = 0; k < SAMPLES; ++k) state[uint(SAMPLES) * p + uint(k)] = nearest[k];
#if HASHED_ALPHA
    set_total(p, nearest[0] < infinite ? 0.0 : 1.0);
#else
    set_total(p, let_through(p)); // the published total is exact
#endif
}
#endif

#if PASS == TRANSMITTANCE || PASS == CURVE || PASS == COMPOSITE
number ray[SAMPLES];

void load_ray(uint p) {
    for (int k = 0; k < SAMPLES; ++k) ray[k] = number(state[uint(SAMPLES) * p + uint(k)]);
}

number in_front(uint p, surface s) {
    real seen = K(0.0);
    for (int k = 0; k < SAMPLES; ++k) seen = seen + seen_by(ray[k], s.depth);
    return seen / K(SAMPLES);
}
#endif

#if PASS == COMPOSITE && HASHED_ALPHA
#define RESOLVES

// The nearest fragment that passes the test, the first of equals.
contribution resolved(uint p) {
    contribution sum = contribution(double[3](0.0, 0.0, 0.0), 0.0);
    uint end = offsets[p + 1u];
    uint seen = end;
    for (uint i = offsets[p]; i < end; ++i)
        if (seen == end && indices[INDICES_SIZE * i + 1u] != 0u && number(depths[i]) == number(state[p]))
            seen = i;
    if (seen < end) {
        for (uint c = 0u; c < 3u; ++c) sum.color[c] = double(colors[3u * seen + c]);
        sum.covers = 1.0;
    }
    return sum;
}
#endif
#include "arrays/questions.glsl"
