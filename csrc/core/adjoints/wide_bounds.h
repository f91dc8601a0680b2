/* Bounds of moments whose polynomial is not the best one. */
#ifndef MOIT_ADJOINTS_WIDE_BOUNDS_H
#define MOIT_ADJOINTS_WIDE_BOUNDS_H

/* Where bounds keep nodes within, as kernels/power_bounds.h does. */
#define MOIT_FARTHEST_NODE 2.0

/* Moments b, the rule of them biased, of which they are the share `keeps`, and the nodes y of the
 * distribution through z but z. */
typedef struct moit_touched {
    int nodes;
    const double *rule, *b, *y;
    double keeps, z;
} moit_touched;

typedef struct moit_mean_slopes {
    double z, b[8];
} moit_mean_slopes;

/* The mean of the polynomial that is 0 at z and touches values at nodes, in [0, 1], and its
 * derivatives. */
double moit_touching_mean(const moit_touched *given, const double *value, moit_mean_slopes *by);

/* The most that may lie at z, as a share. */
double moit_weight_at(int nodes, const double *rule, double z);

#endif
