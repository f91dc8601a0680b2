/* What a thick fragment fills of its ray, and how its absorbance is spread there: evenly, or as a
 * normal distribution, cut to what a picture looks at. */
#ifndef MOIT_EXTENTS_H
#define MOIT_EXTENTS_H

#include "moit.h"

typedef struct {
    bool is_gaussian;
    double front, back;     /* a surface where they are one */
    double mean, deviation; /* of a Gaussian, before it is cut */
    double mass;            /* what of the whole distribution lies between */
} moit_extent;

/* Farther from its mean a Gaussian is not there: 2e-9 of one. */
#define MOIT_DEVIATIONS 6.0

/* Of what is opaque it is a surface, of a volume too but for where it ends. */
moit_extent moit_extent_of(const moit_fragments *fragments, int64_t i);

/* What share of the fragment lies between two depths within its extent, in [0, 1]. */
double moit_share_between(const moit_extent *extent, double near, double far);

/* The same for depths that a sweep passes: what it knows of the last, where it begins empty. */
typedef struct {
    bool known;
    double depth, tail;
} moit_tail;

double moit_share_passed(const moit_extent *extent, double near, double far, moit_tail *last);

/* The same if it were as dense everywhere between them as it is at a depth, for each of some. */
void moit_shares_at(const moit_extent *extent, int points, const double *depth, double near,
                    double far, double *share);

#endif
