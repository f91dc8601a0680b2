#version 450
// Adaptive transparency: Salvi, Montgomery and Lefohn, 2011. A pixel keeps a few steps.
//
//   SCALAR, DOUBLE, PASS   arrays/fragments.glsl
//   STEPS                  2 to 32, of a pixel
//   QUANTIZED              0 or 1: steps are held as words of 16 bits
//   BY_ENERGY              0 or 1: nodes merge by energy, or the one of the least area goes
#include "meshes/extensions.glsl"
#include "kernels/dialect.glsl"
#include "kernels/elementary.h"
#include "kernels/storage.h"
#include "kernels/warp.h"
#include "kernels/adaptive.h"
#include "kernels/steps.h"
#include "arrays/fragments.glsl"
#include "arrays/warp.glsl"
#define KEPT_STEPS state
#include "arrays/steps.glsl"

#if PASS == CAPTURE || PASS == DRAW_ORDERED
// The steps after a fragment has come; one more of them is never in use.
void insert(inout visibility held[STEPS + 1], surface s) {
    visibility more[STEPS + 1];
    number depth = held_depth(s.depth);
    real passes = 1.0 - s.alpha;
    more[0] = node_shifted(visibility(depth, K(1.0)), held[0], depth, passes);
    for (int i = 1; i <= STEPS; ++i) more[i] = node_shifted(held[i - 1], held[i], depth, passes);
#if BY_ENERGY
    number scale = QUANTIZED == 1 ? word_step() : K(1.0);
    merging best = merging_of(K(1.0), more[0], more[1], K(1.0), scale);
    for (int i = 2; i <= STEPS; ++i)
        best =
            or_merging(best, merging_of(more[i - 2].through, more[i - 1], more[i], K(i), scale));
    best = merging_needed(best, more[STEPS - 1], more[STEPS], K(STEPS));
    number place = merged_depth(best);
    if (QUANTIZED == 1) place = nearest_integer(place);
    for (int i = 0; i < STEPS; ++i)
        held[i] = node_merged(more[i], more[i + 1], K(i), best.place, place);
#else
    removal gone = removal(K(1.0), area_lost(more[0], more[1]));
    for (int i = 2; i < STEPS; ++i)
        gone = or_removal(gone, K(i), area_lost(more[i - 1], more[i]));
    number place = place_left_out(gone, more[STEPS], K(STEPS));
    for (int i = 0; i < STEPS; ++i) held[i] = node_kept(more[i], more[i + 1], K(i), place);
#endif
    if (QUANTIZED == 1)
        for (int i = 0; i < STEPS; ++i) held[i] = held_node(held[i]);
}
#endif

#if PASS == CAPTURE
void capture(uint p) {
    visibility held[STEPS + 1];
    for (int i = 0; i <= STEPS; ++i) held[i] = visibility(empty_depth(), K(1.0));
    uint end = offsets[p + 1u];
    for (uint k = offsets[p]; k < end; ++k) insert(held, surface_at(k));
    for (uint i = 0u; i < STEPS; ++i) {
        state[2u * (STEPS * p + i)] = held[i].depth;
        state[2u * (STEPS * p + i) + 1u] = held[i].through;
    }
    set_total(p, double(held[STEPS - 1].through));
}
#endif

// Of triangles: the steps of a pixel.

#if PASS == DRAW_ORDERED
void take(surface s) {
    visibility held[STEPS + 1];
    for (int i = 0; i < STEPS; ++i) held[i] = visibility(numbers[2 * i], numbers[2 * i + 1]);
    held[STEPS] = visibility(empty_depth(), K(1.0));
    insert(held, s);
    for (int i = 0; i < STEPS; ++i) {
        numbers[2 * i] = held[i].depth;
        numbers[2 * i + 1] = held[i].through;
    }
}
#elif PASS == COLLECT
void collect(uint p) {
    for (int i = 0; i < NUMBERS_DRAWN; ++i) state[NUMBERS_DRAWN * p + i] = numbers[i];
    set_total(p, double(numbers[NUMBERS_DRAWN - 1]));
}
#endif
#include "arrays/questions.glsl"
