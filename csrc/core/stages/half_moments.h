/* Stages of moments that blending adds up in half floats: lanes are pixels, as the fragments of one
 * come one by one. Behind words.h. */

#include "kernels/own_extent.h"

#define TEXT "core/stages/halves_of_count.h"
#include "core/stages/each_power_count.h"

static void half_moments_stage(int count, bool chebyshev, int pixels, const int32_t *offsets,
                               const void *a, const void *z, void *b0, void *b) {
    switch (count) {
    case 2: halves_of1(chebyshev, pixels, offsets, a, z, b0, b); break;
    case 4: halves_of2(chebyshev, pixels, offsets, a, z, b0, b); break;
    case 6: halves_of3(chebyshev, pixels, offsets, a, z, b0, b); break;
    case 8: halves_of4(chebyshev, pixels, offsets, a, z, b0, b); break;
    }
}

FN void within_extent(int n, own_extent e, SCALAR *z) {
    for (int i = 0; i < n; i += LANES) store_at_most(z + i, depth_within(e, load(z + i)), n - i);
}

FN void widen(bool counts, SCALAR z, SCALAR *least, SCALAR *most) {
    *least = counts && z < *least ? z : *least;
    *most = counts && z > *most ? z : *most;
}

/* The extent of numbers in [-1, 1], of all or where there is `alpha` of those that cover anything.
 * Four chains of comparisons, as one waits for itself. */
FN own_extent extent_of(int n, const SCALAR *z, const SCALAR *alpha) {
    SCALAR least[4] = {1, 1, 1, 1}, most[4] = {-1, -1, -1, -1};
    int i = 0;
    for (; i + 4 <= n; i += 4)
        for (int k = 0; k < 4; ++k)
            widen(!alpha || alpha[i + k] > 0, z[i + k], least + k, most + k);
    for (int k = 0; i < n; ++i, ++k) widen(!alpha || alpha[i] > 0, z[i], least + k, most + k);
    for (int k = 1; k < 4; ++k) {
        least[0] = least[k] < least[0] ? least[k] : least[0];
        most[0] = most[k] > most[0] ? most[k] : most[0];
    }
    return extent_of_words(word_at_most(K(least[0])), word_at_least(K(most[0])));
}

/* The ends of z in each pixel, and z within these. */
static void own_extents_stage(int pixels, const int32_t *offsets, void *z_, double *extents) {
    SCALAR *z = z_;
    for (int p = 0; p < pixels; ++p) {
        own_extent e = extent_of(offsets[p + 1] - offsets[p], z + offsets[p], NULL);
        extents[2 * p] = (double)e.nearest[0];
        extents[2 * p + 1] = (double)e.farthest[0];
        within_extent(offsets[p + 1] - offsets[p], e, z + offsets[p]);
    }
}

static void within_extent_stage(int n, const double *extent, void *z) {
    within_extent(n, (own_extent){K((SCALAR)extent[0]), K((SCALAR)extent[1])}, z);
}
