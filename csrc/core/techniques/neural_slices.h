/* A tile's own room where a network reads slices, filled by what weighs or asks of curves. */
#ifndef MOIT_NEURAL_SLICES_H
#define MOIT_NEURAL_SLICES_H

#include "core/tile.h"

/* A network of two layers of 8, of 10 numbers of a fragment; those lie `AROUND` sums apart. */
enum { MOIT_SLICE_INPUTS = 10, MOIT_SLICE_HIDDEN = 8, MOIT_SLICE_AROUND = 6 };

/* Places of fragments and of what is asked about, in the job's numbers; the ends of pixels are in
 * tile->sums, two of each. */
typedef struct moit_neural_slice_rows {
    char *features; /* first: who asks for them finds them there */
    char *code, *near, *far, *inside, *asked_inside;
    char *around; /* sums around what is asked about, as slice_sums has them in order */
    int32_t *slot, *asked_slot;
    uint32_t *row, *column, *sums;
    int64_t asked; /* from one of `around` to the next */
} moit_neural_slice_rows;

moit_neural_slice_rows moit_neural_slice_rows_of(const moit_job *job, const moit_tile *tile);

#endif
