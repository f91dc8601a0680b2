/* The techniques as a table: what each does with a tile. */
#ifndef MOIT_TECHNIQUES_H
#define MOIT_TECHNIQUES_H

#include "core/tile.h"

typedef struct moit_technique_row {
    /* Fills tile->T and tile->total. */
    void (*weigh)(const moit_job *job, moit_tile *tile);
    /* Fills tile->curve and tile->total; NULL: the technique has no curve. */
    void (*curve)(const moit_job *job, moit_tile *tile);
    /* Fills lower and upper, (fragments) or, where the job has depths, (pixels, depths), and
     * tile->total; NULL: all it proves is that the transmittance lies between the total and 1. */
    void (*bounds)(const moit_job *job, moit_tile *tile, double *lower, double *upper);
    bool uses_warp;
    /* Whether weights need not sum to what is covered, so that `normalize` applies. */
    bool reconstructs;
} moit_technique_row;

extern const moit_technique_row moit_technique_rows[MOIT_KIND_COUNT];

/* power_moments.c */
void moit_power_weigh(const moit_job *job, moit_tile *tile);
void moit_power_curve(const moit_job *job, moit_tile *tile);
void moit_power_bounds(const moit_job *job, moit_tile *tile, double *lower, double *upper);
/* Fills tile->absorbance, z, b0 and b. */
void moit_power_gather(const moit_job *job, moit_tile *tile);

/* sorted.c */
void moit_sorted_weigh(const moit_job *job, moit_tile *tile);
void moit_sorted_curve(const moit_job *job, moit_tile *tile);
void moit_sorted_bounds(const moit_job *job, moit_tile *tile, double *lower, double *upper);

/* weighted.c */
void moit_alpha_blend_weigh(const moit_job *job, moit_tile *tile);
void moit_weighted_sum_weigh(const moit_job *job, moit_tile *tile);
void moit_weighted_average_weigh(const moit_job *job, moit_tile *tile);
void moit_weighted_blended_weigh(const moit_job *job, moit_tile *tile);

#endif
