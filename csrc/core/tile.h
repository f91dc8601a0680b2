/* A tile: some hundred neighbouring pixels, prepared for a technique. */
#ifndef MOIT_TILE_H
#define MOIT_TILE_H

#include "core/stages/stages.h"

#include <float.h>

/* The most numbers that one pixel's moments take beside b0, and doubles that its rule takes with
 * what is made of it. */
enum { MOIT_MOST_NUMBERS = 9, MOIT_MOST_RULE = 26 };

/* A question about fragments, the same for all tiles and threads. */
typedef struct moit_job {
    const moit_fragments *fragments;
    const moit_technique *technique; /* NULL: none is asked */
    const moit_run *run;
    const moit_stages *stages;  /* of the fragments' precision */
    const moit_stages *precise; /* of double */
    size_t scalar;              /* bytes of a number */
    moit_precision given;       /* of the fragments that a technique is asked of, or their twins */
    bool cull_opaque;
    bool skips_empty; /* tiles leave out pixels without fragments */
    double bias;      /* of techniques that store moments */
    double max_alpha; /* technique->max_alpha as this precision holds it, below 1 */
    int64_t depths;   /* of a curve, or 0 */
    const double *depth;
    moit_warp_map warp;      /* of the image's depth range */
    moit_wrapping_zone zone; /* of moments that have one */
    const void *weights;     /* (N), given by the caller; or NULL */
    /* How many bytes tile->own has, for tiles of up to so many fragments and pixels; NULL: none. */
    size_t (*scratch)(const struct moit_job *job, int fragments, int pixels);
    void *prepared; /* what the technique's `prepare` has made of the whole image */
    void *blocks;   /* states of blocks of pixels, that pixels read; NULL: they read their own */
    const void *making; /* the same while they are made, of what tiles gather */
    /* Of a pixel the depth behind which its fragments are left out, and all opaque ones if the job
     * culls; NULL: that of the pixel's own opaque surface. */
    double (*limit)(const struct moit_job *job, int64_t pixel);
} moit_job;

/* A question that no technique is asked (of techniques: techniques/table.h). */
moit_job moit_plain_job(const moit_fragments *fragments, bool cull_opaque, const moit_run *run);

/* What a technique sees: the fragments that the opaque surface does not hide, in arrival order, and
 * room for what it computes. Scratch of fragments is padded (stages.h).
 *
 * A fragment emits `emission` times its color and dims what is behind it by 1 - `alpha`. The two
 * are the same array unless there is transmission: then each channel has its own opacity, alpha (1
 * - transmission), and `alpha` is their mean, the net coverage that coverage weights and curves are
 * made of (McGuire and Mara 2016). Where the three are equal it is bit for bit what they are. */
typedef struct moit_tile {
    int64_t first_pixel, first_fragment; /* in the whole image */
    int pixels, fragments, given;        /* `given` counts culled fragments too */
    int cut;              /* pixels that it was cut with: all, or some are left out */
    const int32_t *place; /* (pixels) of each among those; NULL: none is left out */
    int32_t *offsets;     /* (pixels + 1), of the surviving fragments */
    const void *depth, *alpha, *emission, *color, *weights;
    const void *opacity[3]; /* (fragments) of each channel; NULL: there is no transmission */
    const int32_t *source;  /* (fragments) place among the given ones; NULL: none was culled */
    const int32_t *opaque;  /* (pixels) place of the opaque one, -1: none; NULL: none anywhere */
    int32_t *curve_offsets; /* (pixels + 1), multiples of the number of depths */
    bool absorbed;          /* asked of a technique that `absorbs`: T gets -ln T */
    /* a technique's results */
    void *T;                             /* (fragments) */
    double *total;                       /* (pixels) */
    double *channel_total, *channel_sum; /* (3, pixels), where there is transmission */
    void *curve;                         /* (pixels, depths) */
    /* a technique's scratch */
    void *absorbance, *z, *curve_z; /* (fragments), (fragments), (pixels, depths) */
    void *b0, *b;                   /* state as stored: (pixels), (pixels, MOIT_MOST_NUMBERS) */
    double *double_b0, *double_b;   /* the same in double */
    double *rules;                  /* (pixels, MOIT_MOST_RULE) */
    double *sums;                   /* (pixels, 4) */
    double *points[3], *bounds[2];  /* (fragments), or (pixels, depths) where that is more */
    int32_t *rank, *order;          /* (fragments) */
    char *own;                      /* as many bytes as the technique's `scratch` asked for */
    /* for the tile's own use */
    int32_t *kept, *hides, *filled, *alone, *alone_at;
    void *kept_depth, *kept_alpha, *kept_color, *kept_weights;
    void *net, *channel[3]; /* (fragments), where there is transmission */
} moit_tile;

/* Calls `answer` with every tile of the job, from several threads. */
moit_status moit_for_tiles(const moit_job *job,
                           void (*answer)(const moit_job *, moit_tile *, void *), void *context);

/* The same, with every run of pixels taken by one thread, from the first to the last. A run begins
 * `length` pixels after the one before it, the first at pixel `first`, which may be negative. */
typedef struct moit_runs {
    int64_t first, length;
} moit_runs;

moit_status moit_for_tiles_of(const moit_job *job, const moit_runs *runs,
                              void (*answer)(const moit_job *, moit_tile *, void *), void *context);

/* What to warp depth with in pixel `p` of the tile, if its own range of depth is to be warped: that
 * of its fragments which are not opaque, or where all are, of all. */
moit_warp_map moit_pixel_warp(const moit_job *job, const moit_tile *tile, int p);

/* Opaque fragments that the job does not take apart may lie beyond what depth warps from: widens a
 * range to all fragments of pixel `p` then. */
void moit_widen_range(const moit_job *job, const moit_tile *tile, int p, double *near, double *far);

/* Which pixel of the image is the tile's p-th. */
static inline int64_t moit_pixel_at(const moit_tile *tile, int p) {
    return tile->first_pixel + (tile->place ? tile->place[p] : p);
}

/* Where in the display the pixels of fragments are; row, column: (fragments), padded. */
void moit_display_places(const moit_job *job, const moit_tile *tile, uint32_t *row,
                         uint32_t *column);

/* Numbers of either precision. */
static inline size_t moit_scalar_size(moit_precision precision) {
    return precision == MOIT_FLOAT64 ? sizeof(double) : sizeof(float);
}

static inline double moit_number(moit_precision precision, const void *array, int64_t i) {
    return precision == MOIT_FLOAT64 ? ((const double *)array)[i]
                                     : (double)((const float *)array)[i];
}

static inline void moit_set_number(moit_precision precision, void *array, int64_t i, double x) {
    if (precision == MOIT_FLOAT64) ((double *)array)[i] = x;
    else ((float *)array)[i] = (float)x;
}

/* As the precision holds it: at most the largest number. */
static inline void moit_put_number(moit_precision precision, void *array, int64_t i, double x) {
    double most = precision == MOIT_FLOAT64 ? DBL_MAX : (double)FLT_MAX;
    moit_set_number(precision, array, i, x > most ? most : x < -most ? -most : x);
}

/* A max_alpha as numbers of the precision have it. 1 would have infinite absorbance. */
static inline double moit_held_max_alpha(moit_precision precision, double max_alpha) {
    if (precision == MOIT_FLOAT64) return max_alpha;
    double held = (double)(float)max_alpha;
    return held < 1.0 ? held : 1.0 - 0x1p-24;
}

/* Relative error of a product of `factors` numbers in double. */
static inline double moit_product_slack(int64_t factors) {
    return factors ? 0x1p-52 * (double)(factors + 2) : 0.0;
}

/* Stores bounds so that rounding to the precision only widens them, within [0, 1]. */
static inline void moit_set_bounds(moit_precision precision, void *lower, void *upper, int64_t i,
                                   double low, double high) {
    double unit = precision == MOIT_FLOAT64 ? 0x1p-52 : 0x1p-23;
    double least = precision == MOIT_FLOAT64 ? 0x1p-1022 : 0x1p-126; /* below, ulps are coarser */
    moit_set_number(precision, lower, i,
                    low == 1.0          ? 1.0
                    : low < 2.0 * least ? 0.0
                                        : low * (1.0 - unit));
    high = (high + least) * (1.0 + unit);
    moit_set_number(precision, upper, i, high > 1.0 ? 1.0 : high);
}

#endif
