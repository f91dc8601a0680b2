/* States of blocks of pixels, which techniques read at low resolution: that of a block is the mean
 * of its pixels' own, and what a pixel reads lies between those of the blocks around it.
 *
 * A technique joins by a moit_block_family in its row, and by a call of moit_blocks_read behind
 * each gathering of its state; its options `resolution` and `full_total` are of moit_technique. */
#ifndef MOIT_BLOCKS_H
#define MOIT_BLOCKS_H

#include "core/squares.h"
#include "core/techniques/upsampling.h"

/* The most numbers of one set. */
enum { MOIT_MOST_BLOCK_NUMBERS = 256 };

/* Where a tile's state lies, in numbers of the job's precision. */
typedef struct moit_state {
    void *weight;  /* (pixels): what the means in `numbers` are of; NULL: numbers add up */
    void *numbers; /* (pixels, moit_block_family.numbers) */
} moit_state;

typedef struct moit_block_family {
    /* Fills the tile's state from its fragments alone, as at full resolution. Of a technique with
     * several sets of numbers the later may read the earlier: moit_own_block_read. */
    void (*gather)(const moit_job *job, moit_tile *tile, int set);
    /* Where that is. */
    moit_state (*state)(const moit_job *job, const moit_tile *tile, int set);
    int (*numbers)(const moit_technique *technique);
    /* Of numbers that add up: a pixel's total absorbance is their sum with these weights. */
    void (*total)(const moit_technique *technique, double *weights);
    /* In place what the storage keeps of blocks' states; NULL: numbers of the precision. */
    void (*hold)(const moit_job *job, int blocks, const moit_state *state);
    int (*sets)(const moit_technique *technique); /* NULL: one */
    /* What hides fragments from a block: the farthest of its pixels' opaque surfaces, if all have
     * one; else of each pixel its own. */
    bool of_farthest_surface;
    /* Whether a block has the state of the pixel at its middle; NULL: the mean of all. */
    bool (*of_middle)(const moit_technique *technique);
} moit_block_family;

/* Makes job->blocks of the whole image where the technique asks for blocks, and lets them go. */
moit_status moit_blocks_prepare(moit_job *job);
void moit_blocks_release(moit_job *job);

/* Puts what the tile's pixels read of blocks in the place of their own state, bilinear between the
 * middles of blocks. With `full_total` it is scaled to each pixel's own total absorbance. Nothing
 * where there are no blocks. */
void moit_blocks_read(const moit_job *job, moit_tile *tile, int set);

/* While blocks are made: the state of its block, in place of that of each pixel with fragments; of
 * the others nothing. */
void moit_own_block_read(const moit_job *job, moit_tile *tile, int set);

/* What a block keeps of a set, and the blocks around n of the tile's pixels, at most MOIT_AROUND:
 * of a job that has blocks. */
moit_state moit_block_state(const moit_job *job, int set, int64_t block);
void moit_blocks_find_around(const moit_job *job, const moit_tile *tile, int first, int n,
                             moit_blocks_around *of);

/* The total transmittance of pixels whose blocks do not keep theirs: the product of 1 - alpha.
 * Nothing where there are no blocks, or each pixel has its own total. */
void moit_blocks_total(const moit_job *job, moit_tile *tile);

#endif
