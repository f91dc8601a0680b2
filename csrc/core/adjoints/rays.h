/* The way back through power moments with lanes over the fragments of several pixels: loops in
 * floats and in doubles, of the same bits for each instruction set. */
#ifndef MOIT_ADJOINTS_RAYS_H
#define MOIT_ADJOINTS_RAYS_H

#include "core/tile.h"

/* Pixels whose rules and totals b0 are double. Arrays of fragments are of the table's precision,
 * and padded. */
typedef struct moit_ray_state {
    int count, pixels;
    const int32_t *offsets;
    const void *z, *own; /* own: absorbances, where a surface does not occlude itself; or NULL */
    const double *rules, *b0;
    const double *low; /* (pixels, nodes + 1) of moit_exact_rays; or NULL */
    double beta;
    void *kept; /* columns, `apart` numbers from one to the next */
    int64_t apart;
} moit_ray_state;

typedef struct moit_ray_pull {
    const void *by, *a;  /* by what is absorbed in front; absorbances */
    const double *by_b0; /* (pixels) by totals */
    double keeps;        /* of means */
    bool leaves_depths;  /* of rays that moments say all of, and no exact rule more: by_z is 0
                          * (moit_leave_depths) */
    void *by_a, *by_z;   /* are filled */
    bool *is_hard;       /* of floats: (pixels) whether these have too few digits: those that are
                           * known to be hard get no answer, of the others it is told; or NULL */
} moit_ray_pull;

typedef struct moit_ray_adjoints {
    /* What is absorbed in front of each fragment; keeps what has been sought. */
    void (*absorbance)(const moit_ray_state *state, void *A);
    /* false: a pixel has too many fragments for that, and nothing has been answered. */
    bool (*pull)(const moit_ray_state *state, const moit_ray_pull *of);
} moit_ray_adjoints;

#endif
