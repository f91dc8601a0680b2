/* Structural similarity of blocks, for ssim.c. */
#ifndef MOIT_METRICS_SSIM_H
#define MOIT_METRICS_SSIM_H

#include "core/metrics/blocks.h"

enum {
    SSIM_REACH = 5, /* taps on either side, and the border that the mean leaves out */
    SSIM_ROWS = BLOCK_SIDE + 2 * SSIM_REACH,
};

/* What a reference's block gives every image that it is compared with. */
typedef struct {
    uint64_t rows; /* bit y: the means of row y are there, and what is encoded round it */
    double encoded[3][SSIM_ROWS][BLOCK_STRIDE];
    double means[3][2][BLOCK_SIDE][BLOCK_SIDE]; /* of values and of squares */
} ssim_seen;

/* What a table for one instruction set has; the bits are the same in all. */
typedef struct {
    /* Linear values, clipped to [0, 1], encoded as sRGB: a row round a block. */
    void (*encode)(const double linear[BLOCK_STRIDE], double encoded[BLOCK_STRIDE]);
    void (*multiply)(const double a[BLOCK_STRIDE], const double b[BLOCK_STRIDE],
                     double product[BLOCK_STRIDE]);
    /* The weighted sum of 2 SSIM_REACH + 1 rows of a block, weights from the centre on. */
    void (*filter)(const double weights[SSIM_REACH + 1],
                   const double *const lines[2 * SSIM_REACH + 1], double out[BLOCK_SIDE]);
    /* Adds eq. 13 of means of a, a a and a b, and of b and b b. */
    void (*add)(const double *const ours[3], const double *const theirs[2],
                double similarity[BLOCK_SIDE]);
} ssim_lines;

const ssim_lines *moit_ssim_lines_of(moit_isa isa);

#endif
