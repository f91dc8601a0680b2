/* What coincides between two depths where densities change: Gaussians among others. */
#ifndef MOIT_PANELS_H
#define MOIT_PANELS_H

#include "core/extents.h"

/* What coincides, as one: what it hides of all and of each channel, and the light seen of it. */
typedef struct {
    double alpha, opacity[3];
    double color[3], emission[3];
} moit_mixture;

/* Of fragments `active` with their extents between two depths, so close that each of their
 * densities is a polynomial there. Light is in units of `unit`. */
moit_mixture moit_mix_panel(const moit_fragments *fragments, const int64_t *active,
                            const moit_extent *extents, int64_t count, double near, double far,
                            double unit);

#endif
