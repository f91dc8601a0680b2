// The strongest fragments of a pixel: the greatest of their keys, found by atomic maxima in any
// order, and where the pixel begins and ends.
//
// ANCHORS  how many are kept; WORDS: of a pixel, which begins with their keys, how near it begins
//          and how far it ends
// OUTWARD_ENDS  where defined these are words around it; else the words of its fragments
#include "engine/dialect.glsl"
#define KEPT_ROOM ANCHORS
#define CELL_ROOM (ANCHORS + CELLS)
#include "kernels/anchors.h"
#ifdef OUTWARD_ENDS
#include "kernels/own_extent.h"
#endif

// How much nearness counts beside opacity: importance is alpha exp(-DECAY u), u of [0, 1].
#ifndef DECAY
#define DECAY 3.5
#endif

#include "engine/pixel_words.glsl"

// Depth as a word, 0 to 65535.
float word_of(float z) { return unorm16_word(0.5 * z + 0.5); }

uint key_of(float z, float alpha) {
    anchor_key key = anchor_key_of(alpha, 0.5 * z + 0.5, word_of(z), DECAY);
    return (uint(key.upper) << 10) | uint(key.lower);
}

float word_of_key(uint key) {
    return key > 0u ? float(65535u - ((key >> 10) & 65535u)) : ANCHOR_NOWHERE;
}

float absorbance_of_key(uint key) {
    float absorbed = anchor_absorbance(float(key & 1023u), 1.0 - MAX_ALPHA);
    return key > 0u ? absorbed : 0.0;
}

bool is_kept(uint key, uint least) { return key > 0u && key >= least; }

// A fragment's key goes where a lesser one is, which goes on; what none keeps is left over.
void keep(uvec2 pixel, uvec2 size, float z, float alpha) {
    if (alpha > 0.0) {
#ifdef OUTWARD_ENDS
        uint first = first_word(pixel, size), key = key_of(z, alpha);
        max_words(first + uint(ANCHORS), 65535u - uint(word_at_most(z)));
        max_words(first + uint(ANCHORS + 1), uint(word_at_least(z)));
#else
        uint first = first_word(pixel, size), word = uint(word_of(z)), key = key_of(z, alpha);
        max_words(first + uint(ANCHORS), 65535u - word);
        max_words(first + uint(ANCHORS + 1), word);
#endif
        for (int k = 0; k < ANCHORS; ++k) {
            uint held = max_words(first + uint(k), key);
            key = min(held, key);
        }
    }
}
