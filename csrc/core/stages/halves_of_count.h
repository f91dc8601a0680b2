/* What half_moments.h has of NODES nodes. */
#include "kernels/half_moments.h"

FN void NAMED(halves_of)(const int chebyshev, int pixels, const int32_t *offsets, const SCALAR *a,
                         const SCALAR *z, SCALAR *b0, SCALAR *b) {
    for (int p = 0; p < pixels; p += LANES) {
        pixel_lanes r = pixel_lanes_from(p, pixels, offsets);
        NAMED(half_sums) held = NAMED(nothing_in_halves)();
        for (int i = 0; i < r.most; ++i) {
            truth there = r.count > i;
            real own = select(there, fragment_of(&r, a, 1, i), K(0.0));
            NAMED(half_sums)
            terms = NAMED(half_terms)(chebyshev, own, fragment_of(&r, z, 1, i));
            held = NAMED(added_in_halves)(held, terms);
        }
        NAMED(moments) m = NAMED(moments_of_halves)(chebyshev, held);
        for (int lane = 0; lane < LANES && p + lane < pixels; ++lane) {
            for (int k = 0; k < 2 * NODES; ++k) b[(p + lane) * 2 * NODES + k] = m.b[k][lane];
            b0[p + lane] = held.b0[lane];
        }
    }
}
