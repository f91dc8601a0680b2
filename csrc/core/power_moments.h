/* Constants of the power moments, and what reads a stored state. */
#ifndef MOIT_POWER_MOMENTS_H
#define MOIT_POWER_MOMENTS_H

#include "core/tile.h"

typedef struct moit_power_constants {
    double published_bias;   /* for float32 storage */
    double default_bias[2];  /* by precision of the storage: measured, see README */
    double covering_bias[2]; /* what outweighs rounding of the storage by itself */
    double safe[8];          /* moments of the distribution that bias mixes in */
} moit_power_constants;

const moit_power_constants *moit_power_constants_of(int count);

/* The stored moments of `pixels` in double, and the rules that reconstruction works with. */
void moit_power_read(const moit_stages *precise, moit_precision precision, int count, double bias,
                     int pixels, const void *b, double *wide_b, double *rules);

/* The same for a tile, with its totals. */
void moit_power_read_tile(const moit_job *job, moit_tile *tile);

/* z of the job's depths in each pixel, into tile->curve_z. */
void moit_power_warp_curve(const moit_job *job, moit_tile *tile);

#endif
