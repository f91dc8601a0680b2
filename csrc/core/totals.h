/* What a pixel lets through, and the sum over its fragments: of any technique. */
#ifndef MOIT_TOTALS_H
#define MOIT_TOTALS_H

#include "core/tile.h"

/* After T is known, fills tile->sums with (r, g, b, w), the sum of T (emission color, alpha), in
 * double. */
void moit_blend(const moit_job *job, moit_tile *tile);

/* Fills tile->total with the exact total, the product of 1 - alpha. */
void moit_total_product(const moit_job *job, moit_tile *tile);

/* The total of the tile's pixel p, known but for the last digits. */
void moit_bounds_of_total(const moit_tile *tile, int p, double *low, double *high);

/* What the exact total alone proves of each fragment, or of each depth where the job has some. */
void moit_total_bounds(const moit_job *job, moit_tile *tile, double *lower, double *upper);

#endif
