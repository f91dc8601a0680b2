/* What is seen along a ray through deep samples, as a function of depth. */
#ifndef MOIT_DEEP_CURVES_H
#define MOIT_DEEP_CURVES_H

#include "core/deep_groups.h"

/* A ray's transmittances, one for each alpha, and after them its lights, `width` numbers in all.
 * Piece b leads from state b to state b + 1: at a depth, where near and far are equal, or as a
 * medium of constant density in between. */
typedef struct {
    int alphas, width;
    const int *dimmed_by; /* (width - alphas) which transmittance dims each light */
    int64_t count, room;
    double *near, *far; /* (count) not decreasing */
    double *state;      /* (count + 1, width) */
} moit_ray_curve;

/* Room for `count` pieces; what was there is lost. false: there is no memory. */
bool moit_curve_room(moit_ray_curve *curve, int64_t count);
void moit_free_curve(moit_ray_curve *curve);
double *moit_state(const moit_ray_curve *curve, int64_t b);

/* Sets piece b, which begins at state b, and state b + 1 from what it hides, of each alpha, and
 * from its light, of each light, as one sees them without anything in front. */
void moit_add_piece(moit_ray_curve *curve, int64_t b, double near, double far, const double *alpha,
                    const double *light);

/* The greatest |f - g| / tolerance, of all numbers and depths, of pieces [begin, end) of f from the
 * state in front of them to that behind, and all of g. Each of the two halves, transmittance and
 * light, is put into `worst` if that is there. Ends early, above 1, once it is beyond 1. */
double moit_curves_differ(const moit_ray_curve *f, int64_t begin, int64_t end,
                          const moit_ray_curve *g, const double *tolerance, double worst[2]);

#endif
