/* Backwards through states of blocks of pixels (techniques/blocks.h): what pixels read moves the
 * blocks around them, and these the fragments of all their pixels. So an image is gone through
 * twice: pixels give to blocks first, and fragments take from these then. */
#ifndef MOIT_ADJOINTS_BLOCKS_H
#define MOIT_ADJOINTS_BLOCKS_H

#include "core/adjoints/moments.h"
#include "core/squares.h"

/* The most numbers of one block's derivatives. */
enum { MOIT_MOST_BLOCK_SLOPES = 32 };

typedef struct moit_block_slopes {
    moit_squares squares;
    int numbers;    /* of a block */
    bool collects;  /* pixels give to blocks; else fragments take */
    int64_t strips; /* of rows of pixels, each between the middles of two rows of blocks */
    double *parts;  /* (strips, 2, across, numbers) what pixels of a strip give to either row */
    double *by;     /* (blocks, numbers) */
} moit_block_slopes;

/* Of a job that has blocks. Each strip is to be taken by one thread, from first to last. */
moit_status moit_block_slopes_begin(const moit_job *job, moit_block_slopes *slopes);
moit_runs moit_block_strips(const moit_block_slopes *slopes);
void moit_block_slopes_end(moit_block_slopes *slopes);

/* Adds up what strips hold; fragments take then. */
void moit_block_slopes_join(moit_block_slopes *slopes);

/* Of techniques whose numbers add up, by those that the tile's pixel p reads: gives to the blocks
 * around it, while they collect. mixed: what it reads of them, of which number `total` is all of
 * it. What the pixel's `own` total changes by, if that is what scales it; else 0. */
double moit_give_sums(const moit_job *job, const moit_tile *tile, const moit_adjoint *by, int p,
                      const double *mixed, int total, double own, const double *by_read);
/* Numbers (`count`) as the blocks around the tile's pixel p have them, mixed. */
void moit_mix_blocks(const moit_job *job, const moit_tile *tile, int p, int count, double *mixed);
/* By the numbers of the block that the tile's pixel p is in, as each of its fragments adds to them;
 * 0 while blocks collect. */
void moit_take_sums(const moit_tile *tile, const moit_adjoint *by, int p, double *by_numbers);

/* Of techniques of moments, in place of what goes back through pixels' own states. read: NULL: what
 * is absorbed in front of depths is read, as moments have it. */
void moit_moments_pull_blocks(const moit_job *job, const moit_tile *tile, const moit_adjoint *by,
                              moit_read_pixel *read);

#endif
