// The strongest fragments of a pixel: the greatest of their keys, found by atomic maxima in any
// order, and where the pixel begins and ends.
//
// ANCHORS  how many are kept; WORDS: of a pixel, which begins with their keys, how near it begins
//          and how far it ends
// OUTWARD_ENDS  where defined these are words around it; else the words of its fragments
// LARGE_KEYS    1: keys tell depths within a word apart, in 8 bits more, and have two words: the
//               first is found first, then the second, which stand from LOWERS on
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

#if LARGE_KEYS
#define whole_key uvec2
#define IS_KEY(key) key.x > 0u
#define ARE_SAME(key, other) key.x == other.x && key.y == other.y
#define KEY_AT(first, k) key_at(first, k)

// Depth as a word, 0 to 65535, with eight binary digits.
float word_of(float z) { return fine_word(0.5 * z + 0.5); }

uvec2 key_of(float z, float alpha) {
    float word = word_of(z);
    anchor_key key = anchor_key_of(alpha, 0.5 * z + 0.5, word, DECAY);
    uint upper = (uint(key.upper) << 8) | uint(anchor_fine(key, word));
    return uvec2(key.lower > 0.0 ? upper + 1u : 0u, uint(key.lower));
}

uvec2 key_at(uint first, int k) {
    return uvec2(load_words(first + uint(k)), load_words(first + uint(LOWERS + k)));
}

float word_of_key(uvec2 key) {
    uint upper = key.x - 1u;
    float digits = float(255u - (upper & 255u)) * 0.00390625;
    return key.x > 0u ? float(65535u - ((upper >> 8) & 65535u)) + digits : ANCHOR_NOWHERE;
}

float absorbance_of_key(uvec2 key) {
    float absorbed = anchor_absorbance(float(key.y), 1.0 - MAX_ALPHA);
    return key.x > 0u ? absorbed : 0.0;
}

bool is_kept(uvec2 key, uvec2 least) {
    return key.x > 0u && (key.x > least.x || (key.x == least.x && key.y >= least.y));
}

// What a key's second word is where its first is kept: of several with one first the greatest.
void keep_rest(uvec2 pixel, uvec2 size, float z, float alpha) {
    uint first = first_word(pixel, size);
    uvec2 key = key_of(z, alpha);
    uint rest = key.y;
    for (int k = 0; k < ANCHORS; ++k) {
        if (key.x > 0u && load_words(first + uint(k)) == key.x) {
            uint held = max_words(first + uint(LOWERS + k), rest);
            rest = min(held, rest);
        }
    }
}
#define FIRST_WORD_OF(key) key.x
#else
#define whole_key uint
#define IS_KEY(key) key > 0u
#define ARE_SAME(key, other) key == other
#define KEY_AT(first, k) load_words(first + uint(k))
#define FIRST_WORD_OF(key) key

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
#endif

// A fragment's key goes where a lesser one is, which goes on; what none keeps is left over.
void keep(uvec2 pixel, uvec2 size, float z, float alpha) {
    if (alpha > 0.0) {
#ifdef OUTWARD_ENDS
        uint first = first_word(pixel, size);
        max_words(first + uint(ANCHORS), 65535u - uint(whole_below(words_from_end(z))));
        max_words(first + uint(ANCHORS + 1), uint(-whole_below(-words_from_end(z))));
#else
        uint first = first_word(pixel, size), word = uint(word_of(z));
        max_words(first + uint(ANCHORS), 65535u - word);
        max_words(first + uint(ANCHORS + 1), word);
#endif
        uint key = FIRST_WORD_OF(key_of(z, alpha));
        for (int k = 0; k < ANCHORS; ++k) {
            uint held = max_words(first + uint(k), key);
            key = min(held, key);
        }
    }
}
