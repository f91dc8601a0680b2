/* Loops of power moments backwards, as one table per instruction set, of the same bits. */
#ifndef MOIT_ADJOINTS_POWER_H
#define MOIT_ADJOINTS_POWER_H

#include "moit.h"

/* Numbers of the polynomial of one pixel, at most (power_of_count.h). */
enum { MOIT_MOST_TERMS = 15 };

typedef struct moit_power_adjoints {
    /* Of one pixel's n fragments: z, own (NULL: none) and `by`, by what is absorbed in front of
     * each; adds to by_z and by_own, fills S and gives what b0 changes by. Sums run in the order of
     * fragments. */
    double (*sum_pulled)(int count, int n, const double *rule, double b0, const double *z,
                         const double *own, double beta, const double *by, double *S, double *by_z,
                         double *by_own);
    /* The polynomial of S and its slope at each z. */
    void (*read_polynomial)(int count, int n, const double *rule, const double *S, const double *z,
                            double *value, double *slope);
} moit_power_adjoints;

extern const moit_power_adjoints moit_power_adjoints_base, moit_power_adjoints_avx2,
    moit_power_adjoints_avx512;

#endif
