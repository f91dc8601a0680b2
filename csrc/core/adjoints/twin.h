/* A tile in double: what techniques are asked of backwards, whatever fragments' precision is. */
#ifndef MOIT_ADJOINTS_TWIN_H
#define MOIT_ADJOINTS_TWIN_H

#include "moit_gradients.h"

#include "core/techniques/table.h"

/* A job whose numbers are double, and its tile. */
typedef struct moit_twin {
    moit_fragments fragments;
    moit_job job;
    moit_tile tile;
    moit_adjoint by;
    double *by_opacity[3], *by_total[3]; /* (fragments), (pixels) of each channel */
    double *total;                       /* (pixels) by that of the net coverage */
    double *color_by;                    /* (pixels, 3) by what is behind */
    double *sums, *by_sums;              /* (pixels, 4) of T (emission color, alpha) */
} moit_twin;

/* As moit_job.scratch, of a job whose tiles have twins. */
size_t moit_twin_scratch(const moit_job *job, int fragments, int pixels);

/* As moit_technique_row.prepare of a job that is to have twins, if there is one. */
moit_status moit_twin_prepare(moit_job *job);

/* The twin of a tile, in its own room; derivatives are 0. */
void moit_twin_begin(const moit_job *job, const moit_tile *tile, moit_twin *t);

/* Derivatives by fragments to where these came from; the others get 0. */
void moit_twin_give(const moit_job *job, const moit_tile *tile, moit_twin *t,
                    const moit_gradients *out);

#endif
