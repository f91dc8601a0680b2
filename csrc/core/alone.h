/* Pixels with one fragment, in composites whose colours are scaled to what is covered. */
#ifndef MOIT_ALONE_H
#define MOIT_ALONE_H

#include "core/tile.h"

/* Whether a composite by the job's technique needs no curve of such pixels. */
bool moit_takes_alone(const moit_job *job);

/* Composites those of a tile, and leaves the others in it, unless such pixels are few. background:
 * (3), or `per_pixel` of the tile's first pixel on, as `out` is. */
void moit_composite_alone(const moit_job *job, moit_tile *tile, const double *background,
                          bool per_pixel, void *out);

#endif
