/* What numbers of fragments must be. */
#ifndef MOIT_CHECK_H
#define MOIT_CHECK_H

#include "moit.h"

/* An array of n numbers, and between what they must be; x: NULL, it is not there. */
typedef struct {
    moit_array array;
    const void *x;
    int64_t n;
    double low, high;
} moit_number_check;

enum { MOIT_CHECKS = MOIT_DEVIATION - MOIT_OFFSETS };

/* All MOIT_CHECKS, in the order of moit_array. Depths outside may be those of opaque fragments. */
void moit_checks_of(const moit_fragments *fragments, int64_t count, moit_number_check *checks);

#endif
