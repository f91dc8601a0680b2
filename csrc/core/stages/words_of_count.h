/* What words.h has of NODES nodes. */
#include "kernels/moment_words.h"

/* `scale`: half the angle of all depths, for the circle's. */
FN void NAMED(words_of)(const int circle, real scale, bool half_b0, int pixels,
                        const int32_t *offsets, const SCALAR *a, const SCALAR *z, uint16_t *words,
                        SCALAR *b0) {
    for (int p = 0; p < pixels; p += LANES) {
        pixel_lanes r = pixel_lanes_from(p, pixels, offsets);
        NAMED(stored) s;
        for (int k = 0; k < 2 * NODES; ++k) s.word[k] = K(0.0);
        s.b0 = K(0.0);
        for (int i = 0; i < r.most; ++i) {
            real depth = fragment_of(&r, z, 1, i);
            NAMED(terms) t = circle ? NAMED(circle_terms)(scale, depth) : NAMED(power_terms)(depth);
            NAMED(stored) next = NAMED(blended)(s, t, fragment_of(&r, a, 1, i), half_b0);
            truth there = r.count > i;
            for (int k = 0; k < 2 * NODES; ++k) s.word[k] = select(there, next.word[k], s.word[k]);
            s.b0 = select(there, next.b0, s.b0);
        }
        for (int lane = 0; lane < LANES && p + lane < pixels; ++lane) {
            for (int k = 0; k < 2 * NODES; ++k)
                words[(p + lane) * 2 * NODES + k] = (uint16_t)s.word[k][lane];
            b0[p + lane] = s.b0[lane];
        }
    }
}

#ifdef RULES /* double tables only */
FN void NAMED(decoded_of)(const int circle, int pixels, const uint16_t *words, const double *b0,
                          double *b) {
    for (int p = 0; p < pixels; p += LANES) {
        NAMED(stored) s;
        double lanes[2 * NODES + 1][LANES];
        for (int lane = 0; lane < LANES; ++lane) {
            int ray = p + lane < pixels ? p + lane : p;
            for (int k = 0; k < 2 * NODES; ++k) lanes[k][lane] = words[ray * 2 * NODES + k];
            lanes[2 * NODES][lane] = b0[ray];
        }
        for (int k = 0; k < 2 * NODES; ++k) s.word[k] = load(lanes[k]);
        s.b0 = load(lanes[2 * NODES]);
        NAMED(decoded) d = circle ? NAMED(circle_decoded)(s) : NAMED(power_decoded)(s);
        for (int lane = 0; lane < LANES && p + lane < pixels; ++lane)
            for (int k = 0; k < 2 * NODES; ++k) b[(p + lane) * 2 * NODES + k] = d.b[k][lane];
    }
}
#endif
