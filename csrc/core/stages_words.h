/* Stages of moments in words of 16 bits: lanes are pixels, as the fragments of one come one by one. */

#define NODES 2
#include "kernels/moment_words.h"
#undef NODES
#define NODES 3
#include "kernels/moment_words.h"
#undef NODES
#define NODES 4
#include "kernels/moment_words.h"
#undef NODES

/* The fragments that the pixels from `first` on have, a pixel a lane: of `least` all have one. */
typedef struct {
    int start[LANES];
    truth count;
    int least, most;
} pixel_lanes;

FN pixel_lanes pixel_lanes_from(int first, int pixels, const int32_t *offsets) {
    pixel_lanes r;
    for (int lane = 0; lane < LANES; ++lane) {
        bool there = first + lane < pixels;
        r.start[lane] = there ? offsets[first + lane] : 0;
        int n = there ? offsets[first + lane + 1] - r.start[lane] : 0;
        r.count[lane] = n;
        r.least = lane && r.least < n ? r.least : n;
        r.most = lane && r.most > n ? r.most : n;
    }
    return r;
}

/* The first of `width` numbers of fragment i of each pixel; of one that has none, of its first or of
 * the tile's. */
FN real fragment_of(const pixel_lanes *r, const SCALAR *numbers, const int width, int i) {
    SCALAR lanes[LANES];
    for (int lane = 0; lane < LANES; ++lane)
        lanes[lane] = numbers[(r->start[lane] + (i < r->count[lane] ? i : 0)) * width];
    return load(lanes);
}

#define WORDS_OF(n) \
    FN void words_of##n(int half_b0, int pixels, const int32_t *offsets, const SCALAR *a, \
                        const SCALAR *z, uint16_t *words, SCALAR *b0) { \
        for (int p = 0; p < pixels; p += LANES) { \
            pixel_lanes r = pixel_lanes_from(p, pixels, offsets); \
            stored##n s; \
            for (int k = 0; k < 2 * n; ++k) s.word[k] = K(0.0); \
            s.b0 = K(0.0); \
            for (int i = 0; i < r.most; ++i) { \
                terms##n t = power_terms##n(fragment_of(&r, z, 1, i)); \
                stored##n next = blended##n(s, t, fragment_of(&r, a, 1, i), half_b0); \
                truth there = r.count > i; \
                for (int k = 0; k < 2 * n; ++k) \
                    s.word[k] = select(there, next.word[k], s.word[k]); \
                s.b0 = select(there, next.b0, s.b0); \
            } \
            for (int lane = 0; lane < LANES && p + lane < pixels; ++lane) { \
                for (int k = 0; k < 2 * n; ++k) \
                    words[(p + lane) * 2 * n + k] = (uint16_t)s.word[k][lane]; \
                b0[p + lane] = s.b0[lane]; \
            } \
        } \
    }
WORDS_OF(2)
WORDS_OF(3)
WORDS_OF(4)
#undef WORDS_OF

static void power_words_stage(int count, bool half_b0, int pixels, const int32_t *offsets,
                              const void *a, const void *z, uint16_t *words, void *b0) {
#define CASE(n) \
    case 2 * n: \
        if (half_b0) words_of##n(1, pixels, offsets, a, z, words, b0); \
        else words_of##n(0, pixels, offsets, a, z, words, b0); \
        break
    switch (count) {
        CASE(2);
        CASE(3);
        CASE(4);
    }
#undef CASE
}

#ifdef RULES /* double tables only */
#define DECODED_OF(n) \
    static void power_decoded_of##n(int pixels, const uint16_t *words, const double *b0, \
                                    double *b) { \
        for (int p = 0; p < pixels; p += LANES) { \
            stored##n s; \
            double lanes[2 * n + 1][LANES]; \
            for (int lane = 0; lane < LANES; ++lane) { \
                int ray = p + lane < pixels ? p + lane : p; \
                for (int k = 0; k < 2 * n; ++k) lanes[k][lane] = words[ray * 2 * n + k]; \
                lanes[2 * n][lane] = b0[ray]; \
            } \
            for (int k = 0; k < 2 * n; ++k) s.word[k] = load(lanes[k]); \
            s.b0 = load(lanes[2 * n]); \
            decoded##n d = power_decoded##n(s); \
            for (int lane = 0; lane < LANES && p + lane < pixels; ++lane) \
                for (int k = 0; k < 2 * n; ++k) b[(p + lane) * 2 * n + k] = d.b[k][lane]; \
        } \
    }
DECODED_OF(2)
DECODED_OF(3)
DECODED_OF(4)
#undef DECODED_OF

static void power_decoded_stage(int count, int pixels, const uint16_t *words, const double *b0,
                                double *b) {
    switch (count) {
    case 4: power_decoded_of2(pixels, words, b0, b); break;
    case 6: power_decoded_of3(pixels, words, b0, b); break;
    case 8: power_decoded_of4(pixels, words, b0, b); break;
    }
}
#define POWER_DECODED_STAGE power_decoded_stage
#else
#define POWER_DECODED_STAGE NULL
#endif
