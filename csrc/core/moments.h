/* Families of moments: what is stored, its constants, and what reads a stored state. */
#ifndef MOIT_MOMENTS_H
#define MOIT_MOMENTS_H

#include "core/tile.h"

typedef struct moit_moment_constants {
    double published_bias;          /* for float32 storage */
    double default_bias[2];         /* by precision of the storage: measured, see README */
    double covering_bias[2];        /* what outweighs rounding of the storage by itself */
    double safe[MOIT_MOST_NUMBERS]; /* moments of the distribution that bias mixes in */
} moit_moment_constants;

typedef struct moit_moment_family {
    int stages; /* its place in moit_stages.moments */
    int (*numbers)(int count);
    int (*rule_size)(int count);
    const moit_moment_constants *(*constants)(int count);
} moit_moment_family;

extern const moit_moment_family moit_power_moments;

const moit_moment_family *moit_family_of(const moit_technique *technique);

/* Fills tile->absorbance, z, b0 and b. */
void moit_moments_gather(const moit_job *job, moit_tile *tile);

/* The stored moments of `pixels` in double, and the rules that reconstruction works with. */
void moit_moments_read(const moit_stages *precise, moit_precision precision,
                       const moit_technique *technique, double bias, int pixels, const void *b,
                       double *wide_b, double *rules);

/* z of the tile's fragments, into tile->z. */
void moit_warp_tile(const moit_job *job, moit_tile *tile);

/* z of the job's depths in each pixel, into tile->curve_z. */
void moit_moments_warp_curve(const moit_job *job, moit_tile *tile);

#endif
