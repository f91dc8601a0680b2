// Anchors, ours: a few fragments that matter most occlude exactly, wherever they lie; all others
// are counted in cells between them. Keys and cells are whole numbers that atomics change, so that
// nothing hangs on the order of fragments.
//
// ANCHORS  how many are kept; CELLS: into how many parts the pixel's extent is cut besides
#include "engine/common.glsl"
#include "engine/kept_keys.glsl"

// Added up while fragments are shaded: colours; what is let through, which starts at 1 and is
// multiplied by 1 - target1.
struct sums { vec4 target0; float target1; };

// A pixel's extent and what it keeps, without its cells.
anchors kept_of(uint first) {
    anchors a;
    a.farthest = float(load_words(first + uint(ANCHORS + 1)));
    a.nearest = min(float(65535u - load_words(first + uint(ANCHORS))), a.farthest);
    for (int k = 0; k < ANCHORS; ++k) {
        whole_key key = KEY_AT(first, k);
        a.word[k] = word_of_key(key);
        a.absorbed[k] = absorbance_of_key(key);
    }
    return a;
}

// What a fragment adds to its cell, which is none where it is kept. Of the last key that is kept
// there may be several: all are counted, and resolved as one less for each that has a place.
void add(uvec2 pixel, uvec2 size, float z, float alpha) {
    uint first = first_word(pixel, size);
    whole_key key = key_of(z, alpha), least = KEY_AT(first, ANCHORS - 1);
    bool is_last = IS_KEY(key) && ARE_SAME(key, least);
    anchors a = kept_of(first);
    float word = word_of(z), absorbed = is_last ? absorbance_of_key(least) : absorbance(alpha);
    uint cell = first + uint(ANCHORS + 2) + uint(anchor_cell(ANCHORS, CELLS, a, word));
    uint steps = alpha > 0.0 ? uint(anchor_steps(absorbed, word)) : 0u;
    bool counts = steps > 0u && (is_last || !is_kept(key, least));
    if (counts && load_words(cell) < uint(ANCHOR_FULL)) add_words(cell, steps);
}

float transmittance(uvec2 pixel, uvec2 size, float z, float alpha) {
    uint first = first_word(pixel, size);
    whole_key least = KEY_AT(first, ANCHORS - 1);
    anchors a = kept_of(first);
    float twin = anchor_cell(ANCHORS, CELLS, a, a.word[ANCHORS - 1]);
    float one = anchor_steps(a.absorbed[ANCHORS - 1], a.word[ANCHORS - 1]), taken = 0.0;
    for (int k = 0; k < ANCHORS; ++k) {
        whole_key key = KEY_AT(first, k);
        taken = taken + (IS_KEY(least) && ARE_SAME(key, least) ? one : 0.0);
    }
    for (int c = 0; c < ANCHORS + CELLS; ++c) {
        float sum = min(float(load_words(first + uint(ANCHORS + 2 + c))), ANCHOR_FULL);
        a.cell[c] = sum < ANCHOR_FULL && float(c) == twin ? sum - taken : sum;
    }
    float own = is_kept(key_of(z, alpha), least) ? -1.0 : absorbance(alpha);
    return exponential(-anchor_absorbed(ANCHORS, CELLS, a, word_of(z), own));
}

#include "engine/let_through.glsl"
