/* Loops backwards over the fragments of a tile, whatever the technique: one table per instruction
 * set, of the same bits. */
#ifndef MOIT_ADJOINTS_TILES_H
#define MOIT_ADJOINTS_TILES_H

#include "core/tile.h"

/* Of sums over the fragments of each pixel of T (emission color, alpha). `color`, `alpha` and
 * `emission` may be a caller's: nothing beyond their end is read. */
typedef struct moit_pulled_sums {
    int pixels;
    const int32_t *offsets;
    const double *by_sum; /* (pixels, 4) */
    const double *T, *alpha, *emission, *color;
    bool absorbed;                                    /* by -ln T in place of T */
    double *by_T, *by_color, *by_emission, *by_alpha; /* are filled; padded */
} moit_pulled_sums;

typedef struct moit_tile_adjoints {
    /* T of what is absorbed in front, of which the least of each pixel's fragments with alpha above
     * 0 is left out. T: padded. */
    void (*relative_weights)(int pixels, const int32_t *offsets, const double *absorbed,
                             const double *alpha, double *T);
    void (*pull_sums)(const moit_pulled_sums *of);
    /* Of n absorbances of min(alpha, most), or if scaled of most alpha: adds to by_alpha (padded).
     */
    void (*pull_absorbance)(int n, bool scaled, double most, const double *alpha, const double *by,
                            double *by_alpha);
    /* Of n z that rise by `rise`: adds to by_depth (padded). */
    void (*pull_warp)(int n, const moit_warp_map *map, double rise, const double *depth,
                      const double *by_z, double *by_depth);
} moit_tile_adjoints;

extern const moit_tile_adjoints moit_tile_adjoints_base, moit_tile_adjoints_avx2,
    moit_tile_adjoints_avx512;

const moit_tile_adjoints *moit_tile_adjoints_of(moit_isa isa);

#endif
