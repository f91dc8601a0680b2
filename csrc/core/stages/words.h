/* Stages of moments in words of 16 bits: lanes are pixels, as the fragments of one come one by
 * one. */

/* The fragments that the pixels from `first` on have, a pixel a lane: of `least` all have one. */
typedef struct {
    int start[LANES];
    truth count;
    int least, most;
} pixel_lanes;

FN pixel_lanes pixel_lanes_from(int first, int pixels, const int32_t *offsets) {
    pixel_lanes r;
    for (int lane = 0; lane < LANES; ++lane) {
        int p = first + lane < pixels ? first + lane : first;
        int n = first + lane < pixels ? offsets[p + 1] - offsets[p] : 0;
        r.start[lane] = n ? offsets[p] : 0; /* nothing is read behind the last fragment */
        r.count[lane] = n;
        r.least = lane && r.least < n ? r.least : n;
        r.most = lane && r.most > n ? r.most : n;
    }
    return r;
}

/* The first of `width` numbers of fragment i of each pixel; of one that has no such, of its first,
 * or of the tile's, which must have one. */
FN real fragment_of(const pixel_lanes *r, const SCALAR *numbers, const int width, int i) {
    SCALAR lanes[LANES];
    for (int lane = 0; lane < LANES; ++lane)
        lanes[lane] = numbers[(r->start[lane] + (i < r->count[lane] ? i : 0)) * width];
    return load(lanes);
}

#define TEXT "core/stages/words_of_count.h"
#include "core/stages/each_count.h"

#define CASE(n, circle) \
    words_of##n(circle, scale, half_b0, pixels, offsets, a, z, words, b0); \
    break
static void power_words_stage(int count, const moit_wrapping_zone *zone, bool half_b0, int pixels,
                              const int32_t *offsets, const void *a, const void *z, uint16_t *words,
                              void *b0) {
    const real scale = K(0.0);
    (void)zone;
    switch (count) {
    case 4: CASE(2, 0);
    case 6: CASE(3, 0);
    case 8: CASE(4, 0);
    }
}

static void circle_words_stage(int count, const moit_wrapping_zone *zone, bool half_b0, int pixels,
                               const int32_t *offsets, const void *a, const void *z,
                               uint16_t *words, void *b0) {
    const real scale = K(zone->turns * (4.0 * 3.1415926535897932385));
    switch (count) {
    case 2: CASE(2, 1);
    case 3: CASE(3, 1);
    case 4: CASE(4, 1);
    }
}
#undef CASE

#ifdef RULES
static void power_decoded_stage(int count, int pixels, const uint16_t *words, const double *b0,
                                double *b) {
    switch (count) {
    case 4: decoded_of2(0, pixels, words, b0, b); break;
    case 6: decoded_of3(0, pixels, words, b0, b); break;
    case 8: decoded_of4(0, pixels, words, b0, b); break;
    }
}

static void circle_decoded_stage(int count, int pixels, const uint16_t *words, const double *b0,
                                 double *b) {
    switch (count) {
    case 2: decoded_of2(1, pixels, words, b0, b); break;
    case 3: decoded_of3(1, pixels, words, b0, b); break;
    case 4: decoded_of4(1, pixels, words, b0, b); break;
    }
}
#define POWER_DECODED_STAGE power_decoded_stage
#define CIRCLE_DECODED_STAGE circle_decoded_stage
#else
#define POWER_DECODED_STAGE NULL
#define CIRCLE_DECODED_STAGE NULL
#endif
