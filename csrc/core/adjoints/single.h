/* The way back from pictures through power moments in floats, where these hold digits enough: one
 * table of loops per instruction set, of the same bits. */
#ifndef MOIT_ADJOINTS_SINGLE_H
#define MOIT_ADJOINTS_SINGLE_H

#include "moit_gradients.h"

#include "core/adjoints/moments.h"

/* A tile's pixels, whose rules and totals b0 are double. Arrays of fragments are floats, padded but
 * for those of a caller. */
typedef struct moit_single_state {
    int count, pixels;
    const int32_t *offsets;
    const float *z, *own; /* own: absorbances, where a surface does not occlude itself; or NULL */
    const double *rules, *b0;
    double beta;
    float *kept; /* columns, `apart` numbers from one to the next */
    int64_t apart;
} moit_single_state;

/* Of sums over the fragments of each pixel of T (alpha color, alpha). */
typedef struct moit_single_sums {
    int pixels;
    const int32_t *offsets;
    const double *by_sum;   /* (pixels, 4) */
    const float *T, *alpha; /* alpha, color: a caller's */
    const float *emission, *color;
    float *by_A, *by_alpha; /* are filled; by what is absorbed in front in place of T */
    float *by_color;        /* (fragments, 3) is filled; a caller's */
} moit_single_sums;

/* What alpha and depth change by, from what is read of states. */
typedef struct moit_single_pull {
    const float *by, *a; /* by what is absorbed in front; absorbances */
    const double *by_b0; /* (pixels) by totals */
    double keeps, most;  /* of means; the most alpha that counts */
    const moit_warp_map *warp;
    double rise;                /* of z */
    const float *alpha, *depth; /* a caller's */
    float *by_alpha;            /* is added to; a caller's */
    float *by_depth;            /* is filled; a caller's */
    bool *is_hard; /* (pixels) is filled of those with fragments: floats have too few digits */
} moit_single_pull;

typedef struct moit_single_adjoints {
    /* What is absorbed in front of each fragment; keeps what has been sought. */
    void (*absorbance)(const moit_single_state *state, float *A);
    /* T of that, of which the least of each pixel's fragments with alpha above 0 is left out; or
     * as it is. A is written over. */
    void (*weights)(bool relative, int pixels, const int32_t *offsets, const float *alpha, float *A,
                    float *T);
    void (*sums)(const moit_single_sums *of);
    /* Whether all of it is finite. */
    bool (*pull)(const moit_single_state *state, const moit_single_pull *of);
} moit_single_adjoints;

extern const moit_single_adjoints moit_single_adjoints_base, moit_single_adjoints_avx2,
    moit_single_adjoints_avx512;

/* What the way back is asked with: of a picture, or of the transmittance in front of fragments. */
typedef struct moit_single_asked {
    const double *background; /* of a picture; else NULL */
    bool per_pixel;
    const float *seed; /* (pixels, 4) of a picture; or of each fragment */
    const moit_gradients *out;
} moit_single_asked;

/* Whether floats are enough for a job's technique. */
bool moit_is_single(const moit_job *job);

/* Answers a tile, in room that its twin would have; false: some number was too large for floats,
 * and nothing has been answered. */
bool moit_single_backwards(const moit_job *job, moit_tile *tile, const moit_single_asked *asked);

#endif
