/* Images by blocks of pixels, which stay in cache with the pixels round them that a filter reaches,
 * and in which rows that look the same in both images are left out. */
#ifndef MOIT_METRICS_BLOCKS_H
#define MOIT_METRICS_BLOCKS_H

#include "core/metrics/metrics.h"

enum {
    BLOCK_SIDE = 64,
    BLOCK_REACH = 10, /* the most pixels on either side that a filter reaches */
    BLOCK_ROWS = BLOCK_SIDE + 2 * BLOCK_REACH,
    BLOCK_STRIDE = (BLOCK_ROWS + 15) / 16 * 16, /* in whole lanes, whatever they are */
};

/* The pixels of one block that the image has. */
typedef struct {
    int64_t x, y;      /* of its first pixel */
    int width, height; /* at most BLOCK_SIDE */
} image_block;

/* A block and what is round it, row `reach` and column `reach` being its first. */
typedef double block_source[3][BLOCK_ROWS][BLOCK_STRIDE];

int64_t moit_blocks_across(const moit_image *image);
int64_t moit_blocks_of(const moit_image *image);
image_block moit_block_at(const moit_image *image, int64_t block);

/* Loads what lies up to `reach` pixels round a block of an image and of its reference; `inside`
 * says which row or column of `count` stands for one outside of them. For each row the least number
 * of those in which the two differ, of either; infinite where all are equal. */
void moit_load_both(const moit_image *image, const moit_image *reference, const image_block *block,
                    int reach, int64_t (*inside)(int64_t at, int64_t count), block_source of_image,
                    block_source of_reference, double least[BLOCK_ROWS]);

/* Rows of a block are bits; rows round it, BLOCK_SIDE + 2 reach, are marked one by one. Which of
 * the former have a marked one of the latter within reach, */
uint64_t moit_rows_within_reach(const image_block *block, int reach, const bool *marked);
/* and which of the latter are within reach of the former. */
void moit_rows_needed(uint64_t rows, int reach, bool *needed);

/* A pixel's part of an error, summed by rows of blocks, and the map; both in a fixed order, so
 * that threads change no bit. */
typedef struct {
    const moit_image *image;
    void *map;    /* NULL: none is wanted */
    double *sums; /* (height, blocks across) */
} block_errors;

/* false where memory is short. */
bool moit_begin_errors(block_errors *errors, const moit_image *image, void *map);
/* Row y of a block: `pixels` errors of it, of which the sum takes those from `first` to `end`. */
void moit_put_errors(const block_errors *errors, const image_block *block, int64_t index, int y,
                     const double *row, int first, int end);
/* The sum of all, and lets the memory go. */
double moit_end_errors(block_errors *errors);

#endif
