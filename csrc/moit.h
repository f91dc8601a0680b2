/* moit's core: order-independent transparency on arrays of fragments, in plain C11.
 *
 * Nothing here knows Python or GL. Every function takes arrays that the caller owns, returns a
 * status, and keeps nothing between calls. Preconditions are asserted, not reported: the caller
 * checks (moit_check_fragments finds what is wrong with data from outside). */
#ifndef MOIT_H
#define MOIT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef enum moit_status {
    MOIT_OK = 0,
    MOIT_NO_MEMORY,   /* results are not complete */
    MOIT_INTERRUPTED, /* run->interrupted said so; results are not complete */
} moit_status;

/* What a number is in the arrays of a call. */
typedef enum moit_precision { MOIT_FLOAT32 = 0, MOIT_FLOAT64 = 1 } moit_precision;

/* How to run. Results are the same bits for every value of `threads`. */
typedef struct moit_run {
    int threads; /* at least 1 */
    /* Asked now and then from the calling thread; true stops the call. NULL: never. */
    bool (*interrupted)(void *context);
    void *context;
} moit_run;

#ifdef __cplusplus
}
#endif

#endif
