/* What pixels read between the middles of blocks: of the four around each the shares, which may go
 * by how near the blocks' opaque surfaces are to the pixel's (kernels/upsampling.h). */
#ifndef MOIT_UPSAMPLING_H
#define MOIT_UPSAMPLING_H

#include "core/squares.h"
#include "core/tile.h"

typedef struct moit_guides {
    double *farthest;  /* (blocks) of opaque surfaces, infinite where a pixel has none; or NULL */
    double no_surface; /* how far it is where there is none: twice the farthest that is there */
    bool guided;       /* shares go by how far `farthest` is, and a pixel's own opaque surface */
} moit_guides;

/* Up to so many pixels at once. */
enum { MOIT_AROUND = 64 };

typedef struct moit_blocks_around {
    int64_t place[4][MOIT_AROUND]; /* blocks */
    double share[4][MOIT_AROUND + MOIT_PADDING];
} moit_blocks_around;

/* Fills `farthest`. Where all surfaces are as far as they are anywhere there is nothing to go by,
 * and `guided` is false then. */
moit_status moit_guides_find(const moit_job *job, const moit_squares *squares, moit_guides *guides);

/* Of n of the tile's pixels, at most MOIT_AROUND. */
void moit_find_blocks_around(const moit_job *job, const moit_squares *squares,
                             const moit_guides *guides, const moit_tile *tile, int first, int n,
                             moit_blocks_around *of);

#endif
