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

#include "moit_technique.h"

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

/* ---- Instruction sets ------------------------------------------------------------------------ */

/* Which of the compiled loops run. Results of one precision are the same bits for all. */
typedef enum moit_isa {
    MOIT_ISA_BASE = 0,
    MOIT_ISA_AVX2,
    MOIT_ISA_AVX512,
    MOIT_ISA_COUNT
} moit_isa;

bool moit_isa_supported(moit_isa isa); /* by this build and this processor */
moit_isa moit_isa_best(void);
const char *moit_isa_name(moit_isa isa); /* "base", "avx2", "avx512" */

/* How to run. Results are the same bits for every value of `threads` and `isa`. */
typedef struct moit_run {
    int threads;  /* at least 1 */
    moit_isa isa; /* moit_isa_best() is the fastest; one that is not supported runs as zero */
    /* Asked now and then from the calling thread; true stops the call. NULL: never. */
    bool (*interrupted)(void *context);
    void *context;
    /* Composites add how many pixels keep more than half floats hold, 65504; NULL: nobody asks. */
    int64_t *overflows;
} moit_run;

/* -- Fragments --------------------------------------------------------------------------------
 * Pixel p owns the fragments offsets[p] to offsets[p + 1], in arrival order. Questions look at
 * neither back, emission nor deviation: see moit_split_volumes and moit_thin. */
typedef struct moit_fragments {
    moit_precision precision; /* of depth, alpha, color, transmission */
    int64_t pixels;
    const int64_t *offsets; /* (pixels + 1): 0 first, never decreasing */
    /* (N) finite; larger is farther; in [near, far], but that opaque ones may lie anywhere */
    const void *depth;
    const void *alpha;        /* (N) in [0, 1] */
    const void *color;        /* (N, 3) finite, not multiplied by alpha; or NULL */
    const void *transmission; /* (N, 3) in [0, 1]; or NULL */
    const void *back;         /* (N) where each ends, at least depth, in [near, far]; or NULL */
    const void *emission;     /* (N, 3) finite: light added to alpha color; or NULL */
    /* (N) at least 0: of a normal distribution of absorbance, where back is depth; or NULL */
    const void *deviation;
    double near, far;  /* depth_range, of what is not opaque */
    int64_t width;     /* of the image, a divisor of pixels; 0: all are one row */
    int64_t top, left; /* display coordinates of the first pixel */
} moit_fragments;

/* The arrays of a moit_fragments, in the order in which they are checked. */
typedef enum moit_array {
    MOIT_NO_ARRAY = 0,
    MOIT_OFFSETS,
    MOIT_DEPTH,
    MOIT_ALPHA,
    MOIT_COLOR,
    MOIT_TRANSMISSION,
    MOIT_BACK,
    MOIT_EMISSION,
    MOIT_DEVIATION,
} moit_array;

typedef struct moit_fault {
    moit_array array; /* MOIT_NO_ARRAY: none */
    int64_t index;    /* of the first offending number, in the flat array */
} moit_fault;

/* The first number that breaks what moit_fragments says. `count` is the length of depth; the
 * range's ends are rounded to the precision before depth is compared with them, and may be
 * infinite. Other arrays are not looked at when offsets are at fault. */
moit_fault moit_check_fragments(const moit_fragments *fragments, int64_t count);

/* The depth range of fragments for which nobody gave one. */
typedef struct moit_span {
    bool known;       /* whether the rest is: not where numbers had to be looked at one by one */
    bool transparent; /* not all are opaque, and near and far are those of what is not */
    double near, far; /* the least depth and the greatest back; 1 where there is no fragment */
} moit_span;

/* The same fault, by threads, and where there is none as fast as memory is read; *span, unless
 * NULL, is what the fragments span. Others may change offsets meanwhile: unless `copy` is NULL,
 * they are copied there, and it is the copy that is looked at. */
moit_status moit_survey_fragments(const moit_fragments *fragments, int64_t count, int64_t *copy,
                                  moit_fault *fault, moit_span *span, const moit_run *run);

/* An array of n numbers, and between what they must be. */
typedef struct moit_range_check {
    const void *x;
    int64_t n;
    double low, high;
} moit_range_check;

/* *within: whether all numbers of all arrays are; NaN is nowhere. As fast as memory is read. */
moit_status moit_are_within(moit_precision precision, int count, const moit_range_check *arrays,
                            bool *within, const moit_run *run);

/* order (N): within each pixel the indices of its fragments from the least depth to the greatest,
 * equal depths in arrival order. Looks at offsets and depth only. NaN leaves an order unspecified,
 * but a permutation. */
moit_status moit_depth_order(const moit_fragments *fragments, int64_t *order, const moit_run *run);

/* Groups `count` fragments by their pixel, in arrival order: offsets (pixels + 1), and order
 * (count) such that order[i] is where fragment i of the grouped arrays is in the given ones.
 * Returns `count`, or the first index whose pixel is not in [0, pixels). */
int64_t moit_group_by_pixel(const int64_t *pixel, int64_t count, int64_t pixels, int64_t *offsets,
                            int64_t *order);

/* -- Deep images ------------------------------------------------------------------------------
 * A fragment whose back is behind its depth is a volume, else a surface. */

typedef struct moit_splitting {
    bool tidy;    /* surfaces that coincide are mixed too, and every pixel goes front to back */
    int64_t cuts; /* more depths at which volumes are cut */
    const double *cut; /* (cuts) increasing */
} moit_splitting;

/* Where pieces go, of the fragments' precision. Those that the fragments do not have are NULL; back
 * may be NULL and may be asked for. */
typedef struct moit_pieces {
    void *depth, *alpha;        /* (pieces) */
    void *color, *transmission; /* (pieces, 3) */
    void *back;                 /* (pieces) */
    void *emission;             /* (pieces, 3) */
    int64_t *first;             /* (N) the piece that each fragment begins with, or NULL */
} moit_pieces;

/* Volumes are split wherever another fragment of the pixel begins or ends inside them, and what
 * then coincides is mixed. Such a pixel's pieces come front to back, surfaces before the volumes
 * that begin at their depth; these, unless it is to be `tidy`, at the next number, so that depth
 * alone tells the order. Pixels without volumes, or with `tidy` those that are tidy, keep their
 * fragments. A pixel of n fragments gives less than 2 n pieces and one for each cut, and costs
 * n log n.
 *
 * A Gaussian is a volume cut to 6 deviations. Among such, depth is cut at their means and into
 * panels of a deviation, in each of which what coincides is mixed by quadrature: what is hidden is
 * exact, the light of panels to 1e-6 of the brightest. `first` of a Gaussian is the piece that
 * begins at its depth. With `tidy` pieces are volumes of constant density.
 *
 * moit_piece_offsets gives the pieces' offsets (pixels + 1), with which moit_split_volumes fills
 * `pieces`, and whether any fragment is not as it was. */
moit_status moit_piece_offsets(const moit_fragments *fragments, const moit_splitting *how,
                               int64_t *offsets, bool *changes, const moit_run *run);
moit_status moit_split_volumes(const moit_fragments *fragments, const moit_splitting *how,
                               const int64_t *offsets, const moit_pieces *pieces,
                               const moit_run *run);

/* Volumes and Gaussians as points of Gauss' rule of their absorbance in warped depth, in their
 * place: each a surface that has its share of it. Moments of degree up to 2 n - 1 of n points are
 * those of the thick fragment. Or as points that cells of warped depth tell apart: what is linear
 * within each cell is of the points what it is of the thick fragment, to a step of absorbance. */
typedef struct moit_thinning {
    bool volumes;     /* too; else they stay what they are */
    int points;       /* of each fragment, at most 48 */
    double frequency; /* with points 0: as many as waves of up to so many radians over the range of
                         depth need to have integrals to 1e-9, at least 3 */
    moit_warp warp;   /* of depth; depths that are not positive are not warped */
    bool range_per_pixel; /* the range is the pixel's own */
    int cells;            /* of depth, which has points of a step at least; 0: Gauss' rule */
    double step;          /* in nepers, with cells */
} moit_thinning;

/* moit_point_offsets gives the offsets (pixels + 1) of what there is then, with which moit_thin
 * fills `pieces`, and whether any fragment is not as it was. `first` of a thick fragment is the
 * point nearest to its depth. */
moit_status moit_point_offsets(const moit_fragments *fragments, const moit_thinning *how,
                               int64_t *offsets, bool *changes, const moit_run *run);
moit_status moit_thin(const moit_fragments *fragments, const moit_thinning *how,
                      const int64_t *offsets, const moit_pieces *pieces, const moit_run *run);

/* ---- Techniques ------------------------------------------------------------------------------ */

/* The kind's name without options: "sorted", "power". */
const char *moit_kind_name(moit_kind kind);
/* Counts that a kind is used with, ended by 0; {0} where it has none. */
const int *moit_usual_counts(moit_kind kind);
/* Whether the kind can do with the technique's options: a guard for callers who do not know. */
bool moit_technique_fits(const moit_technique *technique);
/* The bias that goes with moments (kind, count, bits) stored in `precision`, and that which was
 * published for their bits: of 16 the same; for float32 where matrices are factorised in double, a
 * tenth to a hundredth of it will do. */
double moit_default_bias(const moit_technique *technique, moit_precision precision);
double moit_published_bias(const moit_technique *technique);
/* How many weights the technique's network has; 0: it has none. */
int moit_network_weights(const moit_technique *technique);
/* How many numbers tell what its network sees of a fragment. */
int moit_network_columns(const moit_technique *technique);
/* What is so of a kind whatever its options are; a row of the table says it once. */
typedef enum moit_arrival {
    MOIT_ANY_ORDER,     /* fragments may arrive in any order */
    MOIT_TIES_IN_ORDER, /* those of distinct depths may; of equal depths the earlier is in front */
    MOIT_IN_ORDER,      /* answers hang on the order of arrival */
} moit_arrival;

/* What becomes of fragments of one depth. */
typedef enum moit_ties {
    MOIT_TIES_TOGETHER, /* they are one layer: seen through what lies in front of it, each as its
                           alpha says */
    MOIT_TIES_EARLIER,  /* the earlier is in front */
    MOIT_TIES_LATER,    /* the later is */
} moit_ties;

/* What a technique is given of thick fragments. Volumes are pieces where not all is said to be
 * points, and all are pieces for what proves bounds. */
typedef enum moit_thick {
    MOIT_THICK_POINTS,  /* Gaussians are three points */
    MOIT_THICK_MIDDLE,  /* Gaussians are surfaces at their depth: what is kept knows no other */
    MOIT_THICK_PIECES,  /* all is split and mixed: moit_split_volumes */
    MOIT_THICK_MOMENTS, /* all is points of which powers of depth up to the technique's are exact */
    MOIT_THICK_WAVES,   /* all is points of which the technique's waves are exact to 1e-9 */
    MOIT_THICK_CELLS,   /* all is points that the technique's cells tell apart, exact to a step */
} moit_thick;

typedef struct moit_technique_facts {
    bool proves_bounds;      /* moit_bounds says more than that it lies between the total and 1 */
    bool has_curve;          /* a transmittance at every depth, not only at fragments */
    bool is_random;          /* answers hang on a seed, and are right on the mean over seeds only */
    bool takes_transmission; /* fragments may have it */
    bool knows_channels;     /* with it, fragments are seen through each channel's own */
    bool uses_warp;          /* it works on depth warped to unit_range; "log" needs depth > 0 */
    bool stores_moments;
    bool has_network;
    bool adds_targets; /* what it keeps adds up between pictures: moit_target_sums */
    bool adds_texels;  /* what it keeps can be filtered: moit_texel_sums */
    bool takes_points; /* fragments of alpha 0 change no answer: they may ask for points */
    moit_arrival arrival;
    moit_ties ties;
    /* Up to so many fragments images are those of MOIT_SORTED but for last digits; `exact_counts`:
     * up to so many more than the technique counts. */
    int exact_up_to;
    bool exact_counts;
    /* How often transparent geometry is drawn, as published, to composite; `passes_count`: so many
     * times more than that as the technique counts. */
    int geometry_passes;
    bool passes_count;
    double unit_range[2]; /* what depth is warped to, unless an option says otherwise */
    moit_thick thick;
} moit_technique_facts;

enum { MOIT_EXACT = INT32_MAX }; /* exact_up_to of what always is */

moit_technique_facts moit_facts_of(moit_kind kind);

/* ---- What passes on a GPU are given --------------------------------------------------------
 * The constants of a technique, in double; the passes' texts are those of csrc/kernels. */

/* How depth becomes z in numbers of one precision (kernels/warp.h). Beyond what the precision can
 * do by steps of its own the map is extreme: moit_warped alone knows z. */
typedef enum moit_steps_kind {
    MOIT_STEPS_NONE = STEPS_NONE,   /* z is depth */
    MOIT_STEPS_LEVEL = STEPS_LEVEL, /* all depths are one, and low is z */
    MOIT_STEPS_LINEAR = STEPS_LINEAR,
    MOIT_STEPS_LOG = STEPS_LOG,
    MOIT_STEPS_EXTREME = STEPS_EXTREME,
} moit_steps_kind;

typedef struct moit_warp_steps {
    moit_steps_kind kind;
    double near, low, high, scale, inverse;
} moit_warp_steps;

/* Of depths in [near, far] where the technique warps; else MOIT_STEPS_NONE. */
moit_warp_steps moit_technique_warp(const moit_technique *technique, moit_precision precision,
                                    double near, double far);

/* max_alpha as the precision holds it, below 1. */
double moit_technique_max_alpha(const moit_technique *technique, moit_precision precision);

/* Of techniques with moments: the pivots below which is rounding alone, the moments that bias mixes
 * in (as many as the family's most), and where trigonometric moments begin and end on their circle:
 * turns, edge and scale, and the powers 1 to 4 of the point that z = 0 is. */
typedef struct moit_moment_steps {
    double least, safe[8];
    double turns, edge, scale, middle[8];
} moit_moment_steps;

moit_moment_steps moit_technique_moments(const moit_technique *technique, moit_precision precision);

/* What techniques see of fragments: kept (N) is 1 where no opaque surface hides the fragment, nor
 * is it one; occluder (pixels) the index of the pixel's opaque surface, or -1. With transmission,
 * opacity (N, 3) is that of each channel and net (N) their mean; both may be NULL without. */
moit_status moit_surviving(const moit_fragments *fragments, bool cull_opaque, bool *kept,
                           int64_t *occluder, void *opacity, void *net, const moit_run *run);

/* z (N) of fragments, or with depths (pixels, depths) of those in each pixel, of techniques that
 * warp. Nothing is culled. */
moit_status moit_warped(const moit_fragments *fragments, const moit_technique *technique,
                        int64_t depths, const double *depth, void *z, const moit_run *run);

/* What of an image has its own table of where slices stand: squares of pixels, or the image. */
typedef struct moit_slice_regions {
    int64_t count, side; /* side 0: the image is one */
    int64_t top, left;   /* pixels that the first has above and to the left of the image */
    int64_t across;      /* how many stand side by side */
} moit_slice_regions;

moit_slice_regions moit_slice_regions_of(const moit_fragments *fragments,
                                         const moit_technique *technique);

/* Where slices of MOIT_SLICES or MOIT_AVBOIT stand, out (regions, cells, 3): of each cell twice the
 * place of the slice at its front and one more where there is anything, how many cells a joined one
 * begins before it, and one part of that in it; `joined`: how many cells are, of MOIT_AVBOIT. */
moit_status moit_slice_tables(const moit_fragments *fragments, const moit_technique *technique,
                              bool cull_opaque, float *out, int *joined, const moit_run *run);

/* ---- Questions -------------------------------------------------------------------------------
 *
 * `cull_opaque`: the nearest fragment of alpha 1 is the pixel's opaque surface. Its colour is the
 * background, what is farther is culled (transmittance 0), and it lets nothing through (total 0).
 * With transmission only what lets nothing of any channel through is opaque.
 *
 * Transmission: channel c of what is behind a fragment is dimmed by 1 - alpha (1 -
 * transmission[c]). Transmittances, bounds and moments are those of the net coverage, the mean over
 * the channels of alpha (1 - transmission); fragments are seen through these, but by sorted and
 * unsorted, which know each channel's own. Of kinds that do not take it (takes_transmission)
 * nothing may be asked with it. Results have the precision of the fragments. */

/* out (pixels, 4): colour over the background, and 1 - total (the mean of the channels'). The
 * background is (3) or, with `background_per_pixel`, (pixels, 3). Needs color. */
moit_status moit_composite(const moit_fragments *fragments, const moit_technique *technique,
                           bool cull_opaque, const double *background, bool background_per_pixel,
                           void *out, const moit_run *run);
/* out (N): what the technique holds for the transmittance in front of each fragment. */
moit_status moit_transmittance(const moit_fragments *fragments, const moit_technique *technique,
                               bool cull_opaque, void *out, const moit_run *run);
/* out (pixels, depths): transmittance in front of each depth; has_curve. */
moit_status moit_curve(const moit_fragments *fragments, const moit_technique *technique,
                       bool cull_opaque, int64_t depths, const double *depth, void *out,
                       const moit_run *run);
/* out (pixels), or with transmission (pixels, 3). */
moit_status moit_total_transmittance(const moit_fragments *fragments,
                                     const moit_technique *technique, bool cull_opaque, void *out,
                                     const moit_run *run);
/* lower, upper (N): what the stored state proves about the exact transmittance in front of each
 * fragment, widened for rounding. */
moit_status moit_bounds(const moit_fragments *fragments, const moit_technique *technique,
                        bool cull_opaque, void *lower, void *upper, const moit_run *run);
/* lower, upper (pixels, depths). */
moit_status moit_curve_bounds(const moit_fragments *fragments, const moit_technique *technique,
                              bool cull_opaque, int64_t depths, const double *depth, void *lower,
                              void *upper, const moit_run *run);

/* out (N, moit_network_columns): what the technique's network sees of each fragment, as its kernel
 * says; of MOIT_BOUNDED_NEURAL its inputs, the least absorbance in front of the fragment, and what
 * more may be there. 0 where an opaque surface hides the fragment, and for that surface itself. */
moit_status moit_network_features(const moit_fragments *fragments, const moit_technique *technique,
                                  bool cull_opaque, double *out, const moit_run *run);

/* -- Pixels one by one -------------------------------------------------------------------------
 * For those who choose a technique for each pixel. */

/* What a cheap pass knows of a pixel's surviving fragments, without their order; means are over
 * absorbance, colour is as it is, not multiplied by alpha, and 0 where there is none. */
typedef enum moit_fact {
    MOIT_FACT_COUNT,        /* how many */
    MOIT_FACT_ABSORBANCE,   /* their sum, alpha bounded as moments have it */
    MOIT_FACT_COVERED,      /* 1 - the product of 1 - alpha */
    MOIT_FACT_OVERLAP,      /* what the sum of alpha is more than that */
    MOIT_FACT_MOST_ALPHA,   /* the greatest */
    MOIT_FACT_DEPTH_SPREAD, /* deviation of depth, in shares of the image's range */
    MOIT_FACT_DEPTH_SKEW,   /* third and fourth standardised moment of depth */
    MOIT_FACT_DEPTH_TAILS,
    MOIT_FACT_COLOR_RANGE,  /* greatest less least, of the channel where that is most; so below */
    MOIT_FACT_COLOR_SPREAD, /* deviation of colour */
    MOIT_FACT_COLOR_SLOPE,  /* its covariance with depth, and with depth squared, standardised */
    MOIT_FACT_COLOR_CURVATURE,
    MOIT_FACT_TINT, /* with transmission: sum of how far channels' opacities are from their mean */
    MOIT_PIXEL_FACTS,
} moit_fact;

/* facts (pixels, MOIT_PIXEL_FACTS). */
moit_status moit_pixel_facts(const moit_fragments *fragments, bool cull_opaque, double *facts,
                             const moit_run *run);

/* The fragments of pixels `pixel` (count), each below fragments->pixels, in this order: fills
 * depth, alpha (offsets[count]), and where the fragments have them color and transmission
 * (offsets[count], 3). offsets (count + 1): 0, then sums of the pixels' counts. */
moit_status moit_take_pixels(const moit_fragments *fragments, const int64_t *pixel, int64_t count,
                             const int64_t *offsets, void *depth, void *alpha, void *color,
                             void *transmission, const moit_run *run);

/* low, high (pixels, 4): between which values the exact composite lies, as moit_composite gives it,
 * if the exact transmittance in front of each fragment lies between lower and upper: (N), or with
 * transmission (N, 3), of each channel's own opacities. They are widened for rounding, here and in
 * MOIT_SORTED. Needs color. */
moit_status moit_color_bounds(const moit_fragments *fragments, bool cull_opaque,
                              const double *background, bool background_per_pixel,
                              const void *lower, const void *upper, double *low, double *high,
                              const moit_run *run);

/* ---- Moments by themselves ------------------------------------------------------------------- */

/* Numbers that one pixel's moments take beside b0; 0: the technique has none. */
int moit_moment_numbers(const moit_technique *technique);

/* Pass 1: b0 (pixels), b (pixels, numbers), b divided by b0, 0 where b0 is. */
moit_status moit_gather(const moit_fragments *fragments, const moit_technique *technique,
                        bool cull_opaque, void *b0, void *b, const moit_run *run);
/* The words (pixels, numbers) behind b, of techniques with 16 bits; 0 where there is no fragment.
 */
moit_status moit_gather_words(const moit_fragments *fragments, const moit_technique *technique,
                              bool cull_opaque, void *b0, uint16_t *words, const moit_run *run);
/* The words (pixels, 4) that Moment Transparency's storage keeps of four moments b (pixels, 4); not
 * with MOIT_STORAGE_FLOAT. */
moit_status moit_moment_words_kept(const moit_technique *technique, moit_precision precision,
                                   int64_t pixels, const void *b, uint16_t *words,
                                   const moit_run *run);
/* Pass 2: out (pixels, depths) for z (pixels, depths). */
moit_status moit_moments_transmittance(const moit_technique *technique, moit_precision precision,
                                       int64_t pixels, int64_t depths, const void *b0,
                                       const void *b, const void *z, void *out,
                                       const moit_run *run);
/* -ln of it, of a technique whose moments are power or trigonometric ones, read in one pass. */
moit_status moit_moments_absorbance(const moit_technique *technique, moit_precision precision,
                                    int64_t pixels, int64_t depths, const void *b0, const void *b,
                                    const void *z, void *out, const moit_run *run);
/* How far moments are from impossible. Of each pixel's moments b (one set: of two passes either
 * one) and the bias of the technique the least pivot of their Hankel or Toeplitz matrix: where it
 * is not positive, rounding has made them those of no distribution, or of one with no more nodes
 * than determine it. Later pivots than that do not count. 1 where b0 is 0. What Moment Transparency
 * keeps in unorm16 is rounded to it first. */
moit_status moit_moments_pivots(const moit_technique *technique, moit_precision precision,
                                int64_t pixels, const void *b0, const void *b, double *pivot,
                                const moit_run *run);
/* The least bias, to within a thousandth of itself, with which the least pivot is positive; 0 where
 * it is without, infinite where it is with none; of less than 2^-60 only that there is one. */
moit_status moit_moments_least_bias(const moit_technique *technique, moit_precision precision,
                                    int64_t pixels, const void *b0, const void *b, double *bias,
                                    const moit_run *run);
/* How many numbers one set of moments takes beside b0. */
int moit_moment_set(const moit_technique *technique);
/* lower, upper (pixels, depths); alpha (pixels, depths) of surfaces known to be at z, or NULL. */
moit_status moit_moments_bounds(const moit_technique *technique, moit_precision precision,
                                int64_t pixels, int64_t depths, const void *b0, const void *b,
                                const void *z, const void *alpha, void *lower, void *upper,
                                const moit_run *run);

/* -- Shadow maps -------------------------------------------------------------------------------
 * Fragments seen from a light, a texel each pixel. Of some techniques what a texel holds adds up:
 * b0 and moments times b0 (power and trigonometric), or coefficients (Fourier opacity); so it can
 * be filtered, and read between texels. */

/* How many numbers that is; 0: the technique has no such. */
int moit_texel_numbers(const moit_technique *technique);

typedef struct moit_texels {
    moit_precision precision;
    int64_t width, height;
    int numbers;
    const void *sums; /* (height, width, numbers) */
} moit_texels;

/* sums (pixels, moit_texel_numbers), of the fragments' precision. Nothing is culled. */
moit_status moit_texel_sums(const moit_fragments *fragments, const moit_technique *technique,
                            void *sums, const moit_run *run);
/* filtered (height, width, numbers): sums over taps x taps texels (odd) with products of weights
 * (taps). Beyond the map its border goes on. */
moit_status moit_filter_texels(const moit_texels *texels, int taps, const double *weights,
                               void *filtered, const moit_run *run);
/* held (height, width, 4): what words of 16 bits keep of four power moments. */
moit_status moit_hold_texels(const moit_texels *texels, void *held, const moit_run *run);
/* out (points): what reaches places (points, 3): column and row, in texels from the map's corner,
 * and depth. Bilinear between texels; 1 outside the map, and as near as `near`; all in double.
 * near, far: what depth is warped from; beyond all of it is in front. alpha (points): opacity of
 * the surface that a point is on, which does not shadow it, or NULL. opaque: texels hold power
 * moments of depth alone, whose share in front is shadow. */
moit_status moit_shadow_at(const moit_texels *texels, const moit_technique *technique, double near,
                           double far, bool opaque, int64_t points, const double *place,
                           const double *alpha, double *out, const moit_run *run);

/* -- Mixed resolution --------------------------------------------------------------------------
 * Techniques of weights keep sums of a pixel, so that draws at several resolutions can go into
 * pictures of their own, which are joined when composited. */

/* Of weight (red, green, blue, 1) times alpha; and what is let through (weighted blending) or the
 * number of fragments (the others). */
enum { MOIT_TARGET_SUMS = 5 };

/* Whether a technique keeps such sums. */
bool moit_has_target_sums(const moit_technique *technique);
/* sums (pixels, MOIT_TARGET_SUMS). Nothing is culled. Fragments have colour. */
moit_status moit_target_sums(const moit_fragments *fragments, const moit_technique *technique,
                             double *sums, const moit_run *run);

/* A picture each of whose pixels stands for side x side of the whole picture's, width = ceil(whole
 * width / side) and likewise height; pictures have one middle. */
typedef struct moit_target_picture {
    int64_t width, height;
    int side;
    const double *sums; /* (height, width, MOIT_TARGET_SUMS) */
    const float *
        occluders; /* (height, width) depth of opaque surfaces over one scale, in (0, 1); 1: none */
} moit_target_picture;

/* The whole picture (side 1) with smaller ones read between their pixels, bilinearly or,
 * depth_aware, also by how near their opaque surfaces are to the pixel's. behind (height, width,
 * 3): opaque surfaces, or background. out (height, width, 4), as moit_composite. */
moit_status moit_join_targets(const moit_technique *technique, const moit_target_picture *whole,
                              int smaller, const moit_target_picture *small, bool depth_aware,
                              const double *behind, float *out, const moit_run *run);

/* -- Errors of images -------------------------------------------------------------------------
 * Images hold linear radiance; a fourth channel (alpha) is not read. */
typedef struct moit_image {
    const void *pixels;    /* (height, width, channels) finite */
    int64_t height, width; /* at least MOIT_LEAST_SIDE */
    int channels;          /* 3 or 4 */
    moit_precision precision;
} moit_image;

enum { MOIT_LEAST_SIDE = 11 }; /* the window of moit_ssim */

/* *error: the error of the whole image. map (height, width), of the images' precision: what each
 * pixel adds to it; or NULL. Both images are of one size and precision; channels may differ. */
typedef moit_status moit_image_error(const moit_image *image, const moit_image *reference,
                                     void *map, double *error, const moit_run *run);

/* Mean of squared or absolute differences of linear values; the map's pixel means its three. */
moit_image_error moit_mse, moit_mae;
/* Root of moit_mse, and -10 log10 of it in decibels (infinite where equal), pixel by pixel too. */
moit_image_error moit_rmse, moit_psnr;
/* Structural similarity (Wang et al. 2004) of sRGB-encoded values clipped to [0, 1]: 1 where equal.
 * The mean leaves out a border of 5 pixels, the map does not: it mirrors the image there. */
moit_image_error moit_ssim;
/* FLIP (Andersson et al. 2020) of values clipped to [0, 1], at 67.02 pixels per degree; in [0, 1].
 */
moit_image_error moit_flip;
/* HDR-FLIP (Andersson et al. 2021): the greatest FLIP error of each pixel over exposures that lead
 * the ACES curve from the reference's greatest luminance to its median. */
moit_image_error moit_hdr_flip;

#ifdef __cplusplus
}
#endif

#endif
