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

/* -- Fragments --------------------------------------------------------------------------------
 * Pixel p owns the fragments offsets[p] to offsets[p + 1], in arrival order. */
typedef struct moit_fragments {
    moit_precision precision; /* of depth, alpha, color, transmission */
    int64_t pixels;
    const int64_t *offsets;   /* (pixels + 1): 0 first, never decreasing */
    const void *depth;        /* (N) finite, in [near, far]; larger is farther */
    const void *alpha;        /* (N) in [0, 1] */
    const void *color;        /* (N, 3) finite, not multiplied by alpha; or NULL */
    const void *transmission; /* (N, 3) in [0, 1]; or NULL */
    double near, far;         /* depth_range */
} moit_fragments;

/* The arrays of a moit_fragments, in the order in which they are checked. */
typedef enum moit_array {
    MOIT_NO_ARRAY = 0,
    MOIT_OFFSETS,
    MOIT_DEPTH,
    MOIT_ALPHA,
    MOIT_COLOR,
    MOIT_TRANSMISSION,
} moit_array;

typedef struct moit_fault {
    moit_array array; /* MOIT_NO_ARRAY: none */
    int64_t index;    /* of the first offending number, in the flat array */
} moit_fault;

/* The first number that breaks what moit_fragments says. `count` is the length of depth; the
 * range's ends are rounded to the precision before depth is compared with them, and may be
 * infinite. Other arrays are not looked at when offsets are at fault. */
moit_fault moit_check_fragments(const moit_fragments *fragments, int64_t count);

/* order (N): within each pixel the indices of its fragments from the least depth to the greatest,
 * equal depths in arrival order. NaN leaves an order unspecified, but a permutation. */
moit_status moit_depth_order(const moit_fragments *fragments, int64_t *order, const moit_run *run);

/* Groups `count` fragments by their pixel, in arrival order: offsets (pixels + 1), and order
 * (count) such that order[i] is where fragment i of the grouped arrays is in the given ones.
 * Returns `count`, or the first index whose pixel is not in [0, pixels). */
int64_t moit_group_by_pixel(const int64_t *pixel, int64_t count, int64_t pixels, int64_t *offsets,
                            int64_t *order);

/* -- Deep images ------------------------------------------------------------------------------
 * Samples of pixels as files hold them: sample i fills front[i] <= z < back[i], or is a surface at
 * front[i] where back[i] is not greater. */
typedef struct moit_deep_samples {
    int64_t pixels;
    const int64_t *offsets; /* (pixels + 1): 0 first, never decreasing */
    const float *front;     /* (N) finite */
    const float *back;      /* (N) finite */
    const float *alpha;     /* (N) in [0, 1] */
    const float *color;     /* (N, 3) finite, not multiplied by alpha; or NULL */
} moit_deep_samples;

/* Volumes are split wherever another sample of the pixel begins or ends inside them, and what then
 * coincides is mixed; each piece becomes a fragment at its front. Such a pixel's fragments come
 * front to back, surfaces before the pieces that begin at their depth. Pixels without volumes keep
 * their samples, in their order: equal surfaces are not mixed.
 *
 * moit_volume_offsets gives the fragments' offsets (pixels + 1), with which moit_split_volumes
 * fills depth, alpha (offsets[pixels]) and, where samples have it, color (offsets[pixels], 3). */
moit_status moit_volume_offsets(const moit_deep_samples *samples, int64_t *offsets,
                                const moit_run *run);
moit_status moit_split_volumes(const moit_deep_samples *samples, const int64_t *offsets,
                               float *depth, float *alpha, float *color, const moit_run *run);

#ifdef __cplusplus
}
#endif

#endif
