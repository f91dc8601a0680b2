/* Loops of moments backwards, as one table per instruction set, of the same bits. */
#ifndef MOIT_ADJOINTS_MOMENTS_H
#define MOIT_ADJOINTS_MOMENTS_H

#include "core/stages/stages.h"

/* Numbers of the polynomial of one pixel, at most (dual_of_count.h). */
enum { MOIT_MOST_TERMS = 15 };

/* Of a family of moments, as moit_stages.moments has them. */
typedef struct moit_moment_adjoints {
    /* Of one pixel's n places: z, own (NULL: none) and `by`, by what is absorbed in front of each;
     * adds to by_z and by_own, fills S and gives what b0 changes by. Sums run in the order of
     * places. */
    double (*sum_pulled)(int count, const moit_wrapping_zone *zone, int n, const double *rule,
                         double b0, const double *z, const double *own, double beta,
                         const double *by, double *S, double *by_z, double *by_own);
    /* The polynomial of S and its slope at each z. */
    void (*read_polynomial)(int count, const moit_wrapping_zone *zone, int n, const double *rule,
                            const double *S, const double *z, double *value, double *slope);
} moit_moment_adjoints;

extern const moit_moment_adjoints moit_moment_adjoints_base[2], moit_moment_adjoints_avx2[2],
    moit_moment_adjoints_avx512[2];

/* Those of a technique that stores moments. */
const moit_moment_adjoints *moit_moment_adjoints_of(const moit_technique *technique, moit_isa isa);

#endif
