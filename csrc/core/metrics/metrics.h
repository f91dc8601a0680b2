/* What the metrics of images share. */
#ifndef MOIT_METRICS_H
#define MOIT_METRICS_H

#include "moit.h"

/* Row y of one channel (0, 1 or 2) as `width` doubles. */
void moit_image_row(const moit_image *image, int64_t y, int channel, double *row);

/* Stores `width` values as row y of a map that has the precision of `image`; NULL: nothing. */
void moit_store_map_row(void *map, const moit_image *image, int64_t y, const double *row);

/* Linear values, clipped to [0, 1], encoded as sRGB, in place. `count` is in whole lanes. */
enum { MOIT_SRGB_LANES = 2 };
void moit_encode_srgb(double *row, int64_t count);

/* The sum of sums[0] to sums[rows - 1], in this order, over `count`. Sums per row keep a mean the
 * same for every number of threads. */
double moit_mean_of_rows(const double *sums, int64_t rows, int64_t count);

/* How many threads may take part in `items` items: the scratch to allocate. */
int64_t moit_most_workers(const moit_run *run, int64_t items);

void moit_assert_comparable(const moit_image *image, const moit_image *reference);

#endif
