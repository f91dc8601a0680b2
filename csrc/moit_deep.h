/* The samples of deep files: held out by others, and fewer of them.
 *
 * What files hold is light, colour multiplied by alpha, in any number of channels, and much that is
 * not light. So these functions see depths and opacities, say which sample each of theirs comes
 * from and what its light is to be multiplied by, and leave channels to who knows their names. */
#ifndef MOIT_DEEP_H
#define MOIT_DEEP_H

#include "moit.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Samples of pixels, pixel p's at [offsets[p], offsets[p + 1]), in any order. Numbers are not NaN;
 * infinite depths are taken for the greatest finite one. Alphas beyond [0, 1] are moved there. */
typedef struct moit_deep {
    int64_t pixels;
    const int64_t *offsets;
    const float *front; /* (samples) */
    const float *back;  /* (samples) a volume's end; NULL: all are surfaces */
    int alphas;         /* 1, or 3: one for each colour */
    const float *alpha; /* (alphas, samples) */
} moit_deep;

enum { MOIT_MOST_ALPHAS = 3 };

/* What is left of samples: one each, in parts where something begins or ends inside a volume. */
typedef struct moit_held_out {
    int64_t *source;     /* (pieces) the sample that each is of */
    float *front, *back; /* (pieces) */
    double *alpha;       /* (alphas, pieces) */
    double *gain;        /* (alphas, pieces) what the sample's light is multiplied by */
} moit_held_out;

/* The samples that do not hold out, as they are seen through those that do (`holds`), front to
 * back.
 *
 * Let T be the transmittance of all samples and S of what is given here. Flattened up to any depth
 * at which a sample begins or ends, these pieces give the light of their samples that reaches the
 * eye through all in front of it, of both kinds, and as alpha what they themselves hide of it. So
 * S is not T: it is 1 less what the pieces hide, the sum of T alpha over those in front. What
 * coincides, of both kinds, is mixed as moit_split_volumes has it. Pieces that nothing is seen of
 * are left out. Pixels without samples that hold out stay as they are.
 *
 * moit_held_out_offsets gives the pieces' offsets (pixels + 1), with which moit_hold_out fills
 * `out`. Their cost a pixel is that of sorting and of the pieces. */
moit_status moit_held_out_offsets(const moit_deep *samples, const bool *holds, int64_t *offsets,
                                  const moit_run *run);
moit_status moit_hold_out(const moit_deep *samples, const bool *holds, const int64_t *offsets,
                          const moit_held_out *out, const moit_run *run);

/* How samples are to be made fewer. */
typedef struct moit_simplifying {
    double error;       /* of transmittance; of light, times the pixel's scale */
    double depth_error; /* how far depths may move, by their size; 0: not at all */
    int lights;
    const float *light;      /* (lights, samples), multiplied by alpha */
    const int *dimmed_by;    /* (lights) which alpha dims each */
    const int64_t *identity; /* (samples) what is never mixed with others; NULL: anything may be */
    bool alpha_is_half;      /* how the file that is made holds alphas ... */
    const bool *light_is_half; /* (lights) ... light ... */
    bool depth_is_half;        /* ... and depths, which are such already: else as floats */
    bool volumes;              /* whether volumes may stand for surfaces */
    bool shortest; /* numbers have as few digits as the error allows, which files hold in less */
} moit_simplifying;

/* Where samples go: pixel p's are counts[p] from offsets[p] of the samples given on, and are no
 * more than those. */
typedef struct moit_simplified {
    int64_t *counts;     /* (pixels) */
    int64_t *source;     /* (samples) the sample that each takes after in all but these: */
    float *front, *back; /* (samples) */
    float *alpha;        /* (alphas, samples) */
    float *light;        /* (lights, samples) */
    double *worst; /* (pixels, 2) the greatest error of transmittance, and of light by scale */
} moit_simplified;

/* Fewer samples of each pixel, tidy, with
 *
 *     |T(z) - T'(z)| <= error  and  |C(z) - C'(z)| <= error scale
 *
 * at every depth z, for every alpha and light: T is the transmittance in front of z, and C the
 * light that is seen of what is there: all of it where something black and opaque is at z. scale
 * is the greatest |C| of the pixel, at least 1. Both are checked for the numbers as a file holds
 * them; a pixel of which they are not so, or which would have more samples, stays as it is.
 *
 * With a depth_error all this is so of depths that have moved, without changing their order, to
 * such as have fewer digits: by at most that share of the greatest |z| of a volume, or of a
 * surface's.
 *
 * The method: T and C are steps at surfaces and exponentials in volumes. By dynamic programming
 * along depth each pixel gets the least number of surfaces, each of which stands for what comes
 * until the corridor of that error ends, and of volumes, where a slope reaches farther; that is the
 * least of all sets of surfaces. What ends opaque stays opaque. Lokovic and Veach, Deep Shadow Maps
 * (2000), have the corridor, for T alone and greedily. */
enum { MOIT_MOST_DEEP_LIGHTS = 60 };

moit_status moit_simplify(const moit_deep *samples, const moit_simplifying *how,
                          const moit_simplified *out, const moit_run *run);

#ifdef __cplusplus
}
#endif

#endif
