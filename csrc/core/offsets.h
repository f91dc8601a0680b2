/* Where pixels begin among fragments that were counted. */
#ifndef MOIT_OFFSETS_H
#define MOIT_OFFSETS_H

#include <stdint.h>

/* offsets (pixels + 1): from how many fragments pixel p has, in offsets[p + 1], to where they are,
 * from offsets[p] to offsets[p + 1]. */
static inline void moit_offsets_of_counts(int64_t *offsets, int64_t pixels) {
    offsets[0] = 0;
    for (int64_t p = 0; p < pixels; ++p) offsets[p + 1] += offsets[p];
}

#endif
