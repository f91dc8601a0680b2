// The strongest fragments of a pixel, by their keys (kernels/anchors.h), and its extent: a fragment
// a thread, they come together by atomic maxima and minima, in any order.
//
// Before it ANCHORS, how many are kept, WHOLE_NUMBERS, how many a pixel needs of `indices`, and
// place_on_ray(depth), in [0, 1].

uniform number importance_decay; // gamma
uniform number shrink;           // 1 - max_alpha

// While a pixel's fragments come together its whole numbers lie where its first fragment's do:
// keys, the nearest and the farthest word, and what a technique has behind these. Sums of 32 bits
// do not overflow while several threads find that a cell is not yet full; where targets hold two
// cells in a number, adding is to compare and exchange.
#define NEAREST_WORD ANCHORS
#define FARTHEST_WORD (ANCHORS + 1)
uint place_of(uint p, int k) { return INDICES_SIZE * offsets[p] + uint(k); }

number word_of(surface s) { return unorm16_word(place_on_ray(s.depth)); }

uint whole_key(surface s) {
    anchor_key key = anchor_key_of(s.alpha, place_on_ray(s.depth), word_of(s), importance_decay);
    return uint(key.upper) << 10 | uint(key.lower);
}

number word_of_key(uint key) {
    return key > 0u ? number(65535u - (key >> 10 & 65535u)) : K(ANCHOR_NOWHERE);
}

bool is_kept(uint key, uint least) { return key > 0u && key >= least; }

void empty_places(uint p) {
    if (offsets[p] == offsets[p + 1u]) return;
    for (int k = 0; k < WHOLE_NUMBERS; ++k)
        indices[place_of(p, k)] = k == NEAREST_WORD ? 65535u : 0u;
}

void keep(uint p, surface s) {
    if (!(s.alpha > K(0.0))) return;
    uint word = uint(word_of(s));
    atomicMin(indices[place_of(p, NEAREST_WORD)], word);
    atomicMax(indices[place_of(p, FARTHEST_WORD)], word);
    uint key = whole_key(s);
    for (int k = 0; k < ANCHORS; ++k) {
        uint held = atomicMax(indices[place_of(p, k)], key);
        key = min(held, key);
    }
}
