#version 450
// Multi-layer alpha blending: Salvi and Vaidyanathan, 2014. A pixel keeps layers, of each its
// depth, premultiplied colour and transmittance; for fragments these become steps.
//
//   SCALAR, DOUBLE, PASS   arrays/fragments.glsl
//   STEPS                  1 to 32, the layers of a pixel
//   QUANTIZED              0 or 1: layers are half floats, and depth a word of 16 bits
//   BY_ENERGY              0 or 1: the two blend that do least, or the farthest
//   BUCKETS                0 or 1: the first layer is of what is faint in front (Kern et al. 2020)
#include "meshes/extensions.glsl"
#include "kernels/dialect.glsl"
#include "kernels/elementary.h"
#include "kernels/storage.h"
#include "kernels/warp.h"
#include "kernels/mlab.h"
#include "kernels/steps.h"
#include "arrays/fragments.glsl"
#include "arrays/warp.glsl"
#define KEPT_STEPS factors
#include "arrays/steps.glsl"

#define LAYER (STATE_SIZE / STEPS) // numbers of one

#if PASS == CAPTURE || PASS == DRAW_ORDERED
uniform uint coloured; // 0: fragments have no colour
uniform number least;  // alpha that makes a layer

layer layer_seen(surface s) {
    number color[3] = number[3](K(0.0), K(0.0), K(0.0));
    if (coloured == 1u)
        for (uint c = 0u; c < 3u; ++c) color[c] = color_of(s, c);
    layer l = layer_of(held_depth(s.depth), s.alpha, color[0], color[1], color[2], least);
    if (QUANTIZED == 1) l = held_layer(l);
    return l;
}

#if BY_ENERGY
// Of the layers and one behind them the two blend whose blending does least.
void blend_best(inout layer held[STEPS], layer last) {
    layer more[STEPS + 1];
    for (int i = 0; i < STEPS; ++i) more[i] = held[i];
    more[STEPS] = last;
    real reaches = K(1.0);
    blending best = blending_of(reaches, more[0], more[1], K(1.0));
    for (int i = 2; i <= STEPS; ++i) {
        reaches = reaches * more[i - 2].through;
        best = or_blending(best, blending_of(reaches, more[i - 1], more[i], K(i)));
    }
    best = blending_needed(best, last, K(STEPS));
    layer front = more[0], behind = more[1];
    for (int i = 2; i <= STEPS; ++i) {
        bool here = best.place == K(i);
        front = layer_chosen(here, more[i - 1], front);
        behind = layer_chosen(here, more[i], behind);
    }
    layer merged = layers_merged(front, behind, best);
    if (QUANTIZED == 1) merged = held_layer(merged);
    for (int i = 0; i < STEPS; ++i) {
        layer later = layer_chosen(K(i) < best.place, merged, more[i + 1]);
        held[i] = layer_chosen(K(i) < best.place - 1.0, more[i], later);
    }
}
#endif

// Blends what is carried past a layer behind it.
layer with_behind(layer here, layer coming) {
    layer l = layers_blended(here, coming);
    if (QUANTIZED == 1) l = held_layer(l);
    return l;
}

#if BUCKETS
uniform number front_least; // alpha in front of which all goes to the first layer
uniform number back_least;  // alpha behind which all is dropped

// The nearest depths with such alpha.
struct buckets {
    number first, last;
};

buckets buckets_of(uint p) {
    buckets b = buckets(empty_layer().depth, empty_layer().depth);
    uint end = offsets[p + 1u];
    for (uint k = offsets[p]; k < end; ++k) {
        surface s = surface_at(k);
        number depth = held_depth(s.depth);
        if (s.alpha >= front_least) b.first = min(b.first, depth);
        if (s.alpha >= back_least) b.last = min(b.last, depth);
    }
    return b;
}

// The layers after a fragment has come to its bucket.
void insert_in(inout layer held[STEPS], surface s, buckets b) {
    layer coming = layer_seen(s);
    number depth = held_depth(s.depth);
    if (depth > b.last) return;
    if (depth < b.first) {
        layer_pair pair = layers_passed(held[0], coming);
        held[0] = with_behind(pair.front, pair.behind);
        return;
    }
    for (int i = 1; i < STEPS; ++i) {
        layer_pair pair = layers_passed(held[i], coming);
        held[i] = pair.front;
        coming = pair.behind;
    }
    held[STEPS - 1] = with_behind(held[STEPS - 1], coming);
}
#else

// The layers after a fragment has come.
void insert(inout layer held[STEPS], surface s) {
    layer coming = layer_seen(s);
    for (int i = 0; i < STEPS; ++i) {
        layer_pair pair = layers_passed(held[i], coming);
        held[i] = pair.front;
        coming = pair.behind;
    }
#if BY_ENERGY
    blend_best(held, coming);
#else
    held[STEPS - 1] = with_behind(held[STEPS - 1], coming);
#endif
}
#endif
#endif

// Of triangles: the layers of a pixel.

#if PASS == DRAW_ORDERED
void take(surface s) {
    layer held[STEPS];
    for (int i = 0; i < STEPS; ++i)
        held[i] = layer(numbers[5 * i], numbers[5 * i + 1], numbers[5 * i + 2], numbers[5 * i + 3],
                        numbers[5 * i + 4]);
    insert(held, s);
    for (int i = 0; i < STEPS; ++i) {
        numbers[5 * i] = held[i].depth;
        numbers[5 * i + 1] = held[i].red;
        numbers[5 * i + 2] = held[i].green;
        numbers[5 * i + 3] = held[i].blue;
        numbers[5 * i + 4] = held[i].through;
    }
}
#elif PASS == COLLECT
void collect(uint p) {
    for (int i = 0; i < NUMBERS_DRAWN; ++i) state[NUMBERS_DRAWN * p + i] = numbers[i];
}
#endif

#if PASS == CAPTURE
void capture(uint p) {
    layer held[STEPS];
    for (int i = 0; i < STEPS; ++i) held[i] = empty_layer();
    uint end = offsets[p + 1u];
#if BUCKETS
    buckets b = buckets_of(p);
    for (uint k = offsets[p]; k < end; ++k) insert_in(held, surface_at(k), b);
#else
    for (uint k = offsets[p]; k < end; ++k) insert(held, surface_at(k));
#endif
    for (uint i = 0u; i < STEPS; ++i) {
        uint at = STEPS * p + i;
        state[LAYER * at] = held[i].depth;
        state[LAYER * at + 1u] = held[i].red;
        state[LAYER * at + 2u] = held[i].green;
        state[LAYER * at + 3u] = held[i].blue;
        state[LAYER * at + 4u] = held[i].through;
    }
}
#endif

#if PASS == FACTOR
// A pass of its own: glslang takes forever where what is precise hangs on blended layers.
void factor(uint p) {
    precise double through = 1.0;
    for (uint i = 0u; i < STEPS; ++i) {
        uint at = STEPS * p + i;
        through = through * double(state[LAYER * at + 4u]);
        factors[2u * at] = state[LAYER * at];
        factors[2u * at + 1u] = SCALAR(through);
    }
    set_total(p, through);
}
#endif

#if PASS == COMPOSITE || PASS == RESOLVE
#define RESOLVES

// One layer over the other, from the front.
contribution resolved(uint p) {
    precise contribution sum;
    precise double through = 1.0;
    for (uint c = 0u; c < 3u; ++c) sum.color[c] = 0.0;
    for (uint i = 0u; i < STEPS; ++i) {
        uint at = LAYER * (STEPS * p + i);
        for (uint c = 0u; c < 3u; ++c)
            sum.color[c] = sum.color[c] + through * double(state[at + 1u + c]);
        through = through * double(state[at + 4u]);
    }
    sum.covers = 1.0 - through;
    return sum;
}
#endif
#if PASS == RESOLVE
#define RESOLVES_DRAWN
contribution resolved_drawn(uint p, vec4 held, vec4 second) { return resolved(p); }
#endif

#if QUANTIZED && (PASS == COMPOSITE || PASS == RESOLVE)
#define OVERFLOWS
bool overflowed(uint p) {
    number most = K(0.0);
    for (uint i = LAYER * STEPS * p; i < LAYER * STEPS * (p + 1u); i += LAYER)
        for (uint c = 1u; c < 4u; ++c) most = max(most, abs(number(state[i + c])));
    return most >= MOST_HALF;
}
#endif
#include "arrays/questions.glsl"
