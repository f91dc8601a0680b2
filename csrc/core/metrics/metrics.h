/* What the metrics of images share. */
#ifndef MOIT_METRICS_H
#define MOIT_METRICS_H

#include "moit_errors.h"

/* Row y of one channel (0, 1 or 2) as `width` doubles. */
void moit_image_row(const moit_image *image, int64_t y, int channel, double *row);

/* The sum of sums[0] to sums[rows - 1], in this order, over `count`. Sums per row keep a mean the
 * same for every number of threads. */
double moit_mean_of_rows(const double *sums, int64_t rows, int64_t count);

/* How many threads may take part in `items` items: the scratch to allocate. */
int64_t moit_most_workers(const moit_run *run, int64_t items);

/* Means over all values of squared and absolute differences. */
typedef struct {
    double square, magnitude;
} moit_mean_differences;
moit_status moit_differences(const moit_image *image, const moit_image *reference,
                             moit_mean_differences *means, const moit_run *run);
double moit_decibel(double mean_square);

/* Each takes a reference that may have been used before, and gives what a moit_image_error does,
 * `map` being of the image's precision. */
typedef moit_status moit_error_of_block(const moit_image *image, moit_reference *reference,
                                        void *map, double *error, const moit_run *run);
moit_error_of_block moit_ssim_of, moit_flip_of, moit_hdr_flip_of;

#endif
