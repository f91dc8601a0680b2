#version 450
// Anchors (kernels/anchors.h): the greatest keys of a pixel and sums of all others in cells. A
// fragment a thread, they come together by atomic maxima and additions, in any order.
//
//   SCALAR, DOUBLE, PASS   arrays/fragments.glsl
//   ANCHORS, CELLS         how many are kept, and into how many parts the pixel's extent is cut
//   LARGE_KEYS             whether keys have 64 bits
//   ROUND                  of DRAW_WORDS 0: keys; 1: cells
#include "arrays/reads.glsl"
#include "kernels/options.h"
#include "kernels/dialect.glsl"
#include "kernels/elementary.h"
#include "kernels/storage.h"
#include "kernels/warp.h"
#define KEPT_ROOM ANCHORS
#define CELL_ROOM (ANCHORS + CELLS)
#include "kernels/anchors.h"
#include "arrays/fragments.glsl"
#include "arrays/warp.glsl"
#include "arrays/absorbance.glsl"

// In factors what C's stages have of a pixel.

#define BEHIND_KEYS (ANCHORS + CELLS)
#define FIRST_CELL FIRST_BEHIND_KEYS
number place_on_ray(number depth) { return warped(depth); }
#include "arrays/kept.glsl"

#if PASS == NOTHING_KEPT
void own_pass(uint p) { empty_places(p); }
#elif PASS == KEEP
void own_pass(uint p, surface s) { keep(p, s); }
#elif PASS == ADD_TO_CELLS || PASS == DRAW_WORDS
void add_to_cells(uint p, surface s) {
    anchors a;
    uint nearest = nearest_word(p);
    uint farthest = indices[place_of(p, FARTHEST_WORD)];
    a.nearest = number(min(nearest, farthest));
    a.farthest = number(farthest);
    for (int k = 0; k < ANCHORS; ++k) a.word[k] = word_of_key(key_held(p, k));
    KEPT_KEY least = key_held(p, ANCHORS - 1);
    number word = word_of(s);
    KEPT_KEY key = whole_key(s);
    bool is_last = key != NO_KEY && key == least;
    real of_least = anchor_absorbance(lower_of(least), shrink);
    real own = absorbance_of(s.alpha);
    real absorbed = is_last ? of_least : own;
    uint cell = place_of(p, FIRST_CELL + int(anchor_cell(ANCHORS, CELLS, a, word)));
    if ((is_last || !is_kept(key, least)) && atomicAdd(indices[cell], 0u) < uint(ANCHOR_FULL))
        atomicAdd(indices[cell], uint(anchor_steps(absorbed, word)));
}
#if PASS == ADD_TO_CELLS
void own_pass(uint p, surface s) { add_to_cells(p, s); }
#else
void change_words(surface s, uint p) {
#if ROUND == 0
    keep(p, s);
#else
    add_to_cells(p, s);
#endif
}
#endif
#elif PASS == CAPTURE
void capture(uint p) {
    uint first = FACTORS_SIZE * p;
    bool empty = is_empty(p);
    uint nearest = empty ? 0u : nearest_word(p);
    uint farthest = empty ? 0u : indices[place_of(p, FARTHEST_WORD)];
    anchors a;
    a.nearest = number(min(nearest, farthest));
    a.farthest = number(farthest);
    factors[first] = SCALAR(a.nearest);
    factors[first + 1u] = SCALAR(a.farthest);
    KEPT_KEY least = NO_KEY;
    if (!empty) least = key_held(p, ANCHORS - 1);
    for (int k = 0; k < ANCHORS; ++k) {
        KEPT_KEY key = NO_KEY;
        if (!empty) key = key_held(p, k);
        a.word[k] = word_of_key(key);
        number absorbed = anchor_absorbance(lower_of(key), shrink);
        a.absorbed[k] = key != NO_KEY ? absorbed : K(0.0);
        factors[first + 2u + uint(k)] = SCALAR(a.word[k]);
        factors[first + uint(2 + ANCHORS + k)] = SCALAR(a.absorbed[k]);
    }
    int cell_of_least = int(anchor_cell(ANCHORS, CELLS, a, a.word[ANCHORS - 1]));
    int steps_of_least = int(anchor_steps(a.absorbed[ANCHORS - 1], a.word[ANCHORS - 1]));
    for (int c = 0; c < ANCHORS + CELLS; ++c) { // how far beyond full hangs on the order
        int sum = empty ? 0 : int(min(indices[place_of(p, FIRST_CELL + c)], uint(ANCHOR_FULL)));
        int taken = 0;
        for (int k = 0; k < ANCHORS; ++k)
            if (least != NO_KEY && key_held(p, k) == least && c == cell_of_least)
                taken += steps_of_least;
        sum = sum < int(ANCHOR_FULL) ? sum - taken : sum;
        factors[first + uint(2 + 2 * ANCHORS + c)] = SCALAR(sum);
    }
}
#elif PASS == FACTOR
void factor(uint p) {
    uint first = FACTORS_SIZE * p + uint(2 + ANCHORS);
    precise double absorbed = 0.0;
    precise double steps = 0.0;
    for (int k = 0; k < ANCHORS; ++k) absorbed += double(factors[first + uint(k)]);
    for (int c = 0; c < ANCHORS + CELLS; ++c) steps += double(factors[first + uint(ANCHORS + c)]);
    precise double in_cells = steps / double(ANCHOR_STEPS);
    precise double all = absorbed + in_cells;
    set_total(p, exponential(-all));
}
#elif READS
anchors ray;

void load_ray(uint p) {
    uint first = FACTORS_SIZE * p;
    ray.nearest = number(factors[first]);
    ray.farthest = number(factors[first + 1u]);
    for (int k = 0; k < ANCHORS; ++k) {
        ray.word[k] = number(factors[first + uint(2 + k)]);
        ray.absorbed[k] = number(factors[first + uint(2 + ANCHORS + k)]);
    }
    for (int c = 0; c < ANCHORS + CELLS; ++c)
        ray.cell[c] = number(factors[first + uint(2 + 2 * ANCHORS + c)]);
}

number in_front(uint p, surface s) {
    real own = K(0.0); // of a depth
#if PASS != CURVE
    bool kept = is_kept(whole_key(s), key_held(p, ANCHORS - 1));
    own = absorbance_of(s.alpha);
    own = kept ? K(-1.0) : own;
#endif
    real absorbed = anchor_absorbed(ANCHORS, CELLS, ray, word_of(s), own);
    return exponential(-absorbed);
}
#endif
#include "arrays/questions.glsl"
