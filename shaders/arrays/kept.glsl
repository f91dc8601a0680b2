// The strongest fragments of a pixel, by their keys (kernels/anchors.h), and its extent: a fragment
// a thread, they come together by atomic maxima and minima, in any order.
//
// Before it ANCHORS, how many are kept, LARGE_KEYS, whether keys have 64 bits, BEHIND_KEYS, how
// many whole numbers a pixel needs of `indices` behind these, and place_on_ray(depth), in [0, 1].
//
// Atomics of 64 bits are no part of OpenGL 4.5: large keys are found by a thread a pixel.
//
// FROM_TRIANGLES, where it is defined: fragments are drawn, and pixels have their whole numbers one
// after the other, which are 0 before the first fragment.

uniform number importance_decay; // gamma
uniform number shrink;           // 1 - max_alpha

// While a pixel's fragments come together its whole numbers lie where its first fragment's do:
// keys, how near the nearest word is and the farthest, and what a technique has behind these. Sums
// of 32 bits do not overflow while several threads find that a cell is not yet full; where targets
// hold two cells in a number, adding is to compare and exchange.
#define KEY_WORDS (ANCHORS * (LARGE_KEYS + 1))
#define NEAREST_WORD KEY_WORDS
#define FARTHEST_WORD (KEY_WORDS + 1)
#define FIRST_BEHIND_KEYS (KEY_WORDS + 2)
#define WHOLE_NUMBERS (FIRST_BEHIND_KEYS + BEHIND_KEYS)
#ifdef FROM_TRIANGLES
uint place_of(uint p, int k) { return uint(WHOLE_NUMBERS) * p + uint(k); }
bool is_empty(uint p) { return false; } // one that is has keys and words of none
#else
uint place_of(uint p, int k) { return INDICES_SIZE * offsets[p] + uint(k); }
bool is_empty(uint p) { return offsets[p] == offsets[p + 1u]; }
#endif

uint nearest_word(uint p) { return 65535u - indices[place_of(p, NEAREST_WORD)]; }

number word_of(surface s) {
    real u = place_on_ray(s.depth);
    return LARGE_KEYS == 1 ? fine_word(u) : unorm16_word(u);
}

#if LARGE_KEYS
#define KEPT_KEY uvec2
const KEPT_KEY NO_KEY = uvec2(0u);

KEPT_KEY whole_key(surface s) {
    number word = word_of(s);
    anchor_key key = anchor_key_of(s.alpha, place_on_ray(s.depth), word, importance_decay);
    return uvec2(uint(key.upper), uint(anchor_fine(key, word)) << 10 | uint(key.lower));
}

number word_of_key(KEPT_KEY key) {
    number whole = number(65535u - (key.x & 65535u));
    number digits = number(255u - (key.y >> 10 & 255u));
    return key != NO_KEY ? whole + digits * K(0.00390625) : K(ANCHOR_NOWHERE);
}

number lower_of(KEPT_KEY key) { return number(key.y & 1023u); }
bool is_above(KEPT_KEY key, KEPT_KEY other) {
    return key.x > other.x || (key.x == other.x && key.y > other.y);
}
KEPT_KEY key_held(uint p, int k) {
    return uvec2(indices[place_of(p, 2 * k)], indices[place_of(p, 2 * k + 1)]);
}
#else
#define KEPT_KEY uint
const KEPT_KEY NO_KEY = 0u;

KEPT_KEY whole_key(surface s) {
    anchor_key key = anchor_key_of(s.alpha, place_on_ray(s.depth), word_of(s), importance_decay);
    return uint(key.upper) << 10 | uint(key.lower);
}

number word_of_key(KEPT_KEY key) {
    return key > 0u ? number(65535u - (key >> 10 & 65535u)) : K(ANCHOR_NOWHERE);
}

number lower_of(KEPT_KEY key) { return number(key & 1023u); }
bool is_above(KEPT_KEY key, KEPT_KEY other) { return key > other; }
KEPT_KEY key_held(uint p, int k) { return indices[place_of(p, k)]; }
#endif

bool is_kept(KEPT_KEY key, KEPT_KEY least) { return key != NO_KEY && !is_above(least, key); }

void keep(uint p, surface s) {
    if (!(s.alpha > K(0.0))) return;
    uint word = uint(word_of(s));
    atomicMax(indices[place_of(p, NEAREST_WORD)], 65535u - word);
    atomicMax(indices[place_of(p, FARTHEST_WORD)], word);
    KEPT_KEY key = whole_key(s);
    for (int k = 0; k < ANCHORS; ++k) {
#if LARGE_KEYS
        KEPT_KEY held = key_held(p, k);
        if (!is_above(key, held)) continue;
        indices[place_of(p, 2 * k)] = key.x;
        indices[place_of(p, 2 * k + 1)] = key.y;
        key = held;
#else
        uint held = atomicMax(indices[place_of(p, k)], key);
        key = min(held, key);
#endif
    }
}

#if PASS == OWN
// Before the first fragment; of large keys nobody else looks for the greatest.
void empty_places(uint p) {
    if (is_empty(p)) return;
    for (int k = 0; k < WHOLE_NUMBERS; ++k) indices[place_of(p, k)] = 0u;
    for (uint i = offsets[p]; LARGE_KEYS == 1 && i < offsets[p + 1u]; ++i) keep(p, surface_at(i));
}
#endif
