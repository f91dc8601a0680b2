/* What half_moments.h has of NODES nodes. */
#include "kernels/half_moments.h"

/* Which polynomials is asked of each fragment: two texts of all would be no faster. */
FN void NAMED(halves_of)(bool chebyshev, int pixels, const int32_t *offsets, const SCALAR *a,
                         const SCALAR *z, SCALAR *b0, SCALAR *b) {
    int order[COLUMN_PIXELS];
    for (int first = 0; first < pixels; first += COLUMN_PIXELS) {
        int n = pixels_by_count(first, pixels, offsets, order);
        for (int p = 0; p < n; p += LANES) {
            pixel_columns c = columns_from(n - p, order + p, offsets);
            NAMED(half_sums) held = NAMED(nothing_in_halves)();
            for (int from = 0; from < c.most; from += LANES) {
                real own[LANES], at[LANES];
                number_columns(&c, a, from, own);
                number_columns(&c, z, from, at);
                for (int i = 0; i < LANES && from + i < c.most; ++i) {
                    truth there = c.counts > from + i;
                    real x = select(there, own[i], K(0.0)), y = select(there, at[i], K(0.0));
                    NAMED(half_sums) terms;
                    if (chebyshev) terms = NAMED(half_terms)(1, x, y);
                    else terms = NAMED(half_terms)(0, x, y);
                    held = NAMED(added_in_halves)(held, terms);
                }
            }
            NAMED(moments) m = NAMED(moments_of_halves)(chebyshev, held);
            for (int lane = 0; lane < LANES && p + lane < n; ++lane) {
                SCALAR *to = b + c.pixel[lane] * 2 * NODES;
                for (int k = 0; k < 2 * NODES; ++k) to[k] = m.b[k][lane];
                b0[c.pixel[lane]] = held.b0[lane];
            }
        }
    }
}
