/* The way back from pictures through power moments in floats, where these hold digits enough: one
 * table of loops per instruction set, of the same bits. */
#ifndef MOIT_ADJOINTS_SINGLE_H
#define MOIT_ADJOINTS_SINGLE_H

#include "moit_gradients.h"

#include "core/adjoints/moments.h"

/* The state of each pixel: b0 and means of powers of z, in double. */
typedef struct moit_single_state {
    int count, pixels;
    const int32_t *offsets;
    const float *a, *z; /* padded */
    double *b0, *b;     /* (pixels), (pixels, count) are filled */
} moit_single_state;

/* A picture's pixels, by sums over their fragments of T (emission color, alpha). */
typedef struct moit_single_pixels {
    int pixels;
    const int32_t *pixel;     /* of the tile's: of which seeds and what is behind are */
    bool scales;              /* to what is covered */
    const float *seed;        /* (the tile's pixels, 4) */
    const double *sums;       /* (pixels, 4) */
    const double *shown;      /* (pixels, 4) colours behind, and how alpha moves with the total */
    const double *b0, *total; /* (pixels) */
    double *by_sums, *by_b0, *by_behind; /* are filled; (the tile's pixels, 3) */
} moit_single_pixels;

/* Of sums over the fragments of each pixel of T (alpha color, alpha). */
typedef struct moit_single_sums {
    int pixels;
    const int32_t *offsets;
    const double *by_sum;   /* (pixels, 4) */
    const float *T, *alpha; /* alpha, color: a caller's */
    const float *emission, *color;
    float *by_A, *by_alpha; /* are filled; by what is absorbed in front in place of T */
    float *by_color;        /* (fragments, 3) is filled; a caller's */
} moit_single_sums;

/* From absorbances and z of n fragments to alpha and depth. */
typedef struct moit_single_slopes {
    int n;
    double most; /* the most alpha that counts */
    const moit_warp_map *warp;
    double rise; /* of z */
    const float *by_a, *by_z;
    const float *alpha, *depth; /* a caller's */
    float *by_alpha;            /* is added to; a caller's */
    float *by_depth;            /* is filled; a caller's */
} moit_single_slopes;

/* Beyond that exp(-x) is nothing of floats. */
#define MOIT_MOST_ABSORBED 87.0f

typedef struct moit_single_adjoints {
    moit_ray_adjoints rays;
    void (*state)(const moit_single_state *of);
    void (*pixels)(const moit_single_pixels *of);
    /* T of n numbers that are absorbed in front. */
    void (*weights)(int n, const float *A, float *T);
    void (*sums)(const moit_single_sums *of);
    /* Whether all of it is finite. */
    bool (*slopes)(const moit_single_slopes *of);
} moit_single_adjoints;

extern const moit_single_adjoints moit_single_adjoints_base, moit_single_adjoints_avx2,
    moit_single_adjoints_avx512;

/* What the way back is asked with: of a picture, or of the transmittance in front of fragments. */
typedef struct moit_single_asked {
    const moit_behind *behind; /* of a picture; else NULL */
    const float *seed;         /* (pixels, 4) of a picture; or of each fragment */
    const moit_gradients *out;
} moit_single_asked;

/* Whether floats are enough for a job's technique. */
bool moit_is_single(const moit_job *job);

/* Bytes of room for a tile of so many padded fragments and pixels. */
size_t moit_single_scratch(int fragments, int pixels);

/* Answers a tile, in its own room, where there are so many bytes; false: some number was too large
 * for floats, and nothing has been answered. */
bool moit_single_backwards(const moit_job *job, const moit_tile *whole,
                           const moit_single_asked *asked);

#endif
