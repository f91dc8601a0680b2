/* Which techniques there are, and the options of each. */
#ifndef MOIT_TECHNIQUE_H
#define MOIT_TECHNIQUE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "kernels/options.h" /* the numbers that options have for passes on a GPU, too */

/* How depth becomes z. */
typedef enum moit_warp {
    MOIT_WARP_LOG = WARP_LOG,
    MOIT_WARP_LINEAR = WARP_LINEAR,
    MOIT_WARP_NONE = WARP_NONE,
} moit_warp;

/* Every technique: its member of moit_kind, and the name of its row, moit_NAME_row, which stands
 * where its `weigh` does (core/techniques). */
// clang-format off
#define MOIT_KINDS(KIND)                                                                          \
    KIND(SORTED, sorted)                           /* exact; equal depths in arrival order */     \
    KIND(ALPHA_BLEND, unsorted)                    /* over, in arrival order */                   \
    KIND(WEIGHTED_SUM, weighted_sum)               /* Meshkin 2007 */                             \
    KIND(WEIGHTED_AVERAGE, weighted_average)       /* Bavoil and Myers 2008 */                    \
    KIND(WEIGHTED_BLENDED, wboit)                  /* McGuire and Bavoil 2013 */                  \
    KIND(POWER_MOMENTS, power)                     /* Muenstermann et al. 2018 */                 \
    KIND(TRIGONOMETRIC_MOMENTS, trig)              /* the same */                                 \
    KIND(FOURIER_OPACITY, fourier)                 /* Jansen and Bavoil 2010 */                   \
    KIND(FUNCTION_MAP, transmittance_function_map) /* Delalandre et al. 2011 */                   \
    KIND(DEEP_SHADOW_MAP, deep_shadow)             /* Lokovic and Veach 2000 */                   \
    KIND(HAAR_WAVELETS, wavelet)                   /* Aizenshtein, Smal and McGuire 2022 */       \
    KIND(STOCHASTIC, stochastic)                   /* Enderton et al. 2011 */                     \
    KIND(HASHED_ALPHA, hashed_alpha)               /* Wyman and McGuire 2017 */                   \
    KIND(MOMENT_TRANSPARENCY, moment_transparency) /* Sharpe 2018; max_alpha scales */            \
    KIND(DEPTH_PEELING, depth_peeling)             /* Everitt 2001 */                             \
    KIND(ADAPTIVE, adaptive)                       /* Salvi et al. 2011 */                        \
    KIND(MLAB, mlab)                               /* Salvi and Vaidyanathan 2014 */              \
    KIND(KBUFFER, kbuffer)                         /* Bavoil et al. 2007 */                       \
    KIND(HYBRID, hybrid)                           /* Maule et al. 2013 */                        \
    KIND(NEURAL_MOMENTS, neural)                   /* Tsopouridis et al. 2024 */                  \
    KIND(DEEP_FRAGMENTS, dfa)                      /* as the same describe DFA */                 \
    KIND(BOUNDED_NEURAL, neural_bounded)           /* ours: a network between moments' bounds */  \
    KIND(AVBOIT, avboit)                           /* Drobot 2025 */                              \
    KIND(SLICES, slices)                           /* ours: slices of optical depth */            \
    KIND(ANCHORS, anchors)                         /* ours: the strongest; cells of the rest */   \
    KIND(STRONG, strong)                           /* ours: the strongest; moments of the rest */ \
    KIND(FRONT, front)                             /* ours: the nearest; moments of the rest */
// clang-format on

typedef enum moit_kind {
#define MEMBER(KIND, row) MOIT_##KIND,
    MOIT_KINDS(MEMBER)
#undef MEMBER
        MOIT_KIND_COUNT,
} moit_kind;

/* Equations: csrc/kernels/weights.h. */
typedef enum moit_weight {
    MOIT_WEIGHT_BLOG = WEIGHT_BLOG,
    MOIT_WEIGHT_EQ7 = WEIGHT_EQ7,
    MOIT_WEIGHT_EQ8 = WEIGHT_EQ8,
    MOIT_WEIGHT_EQ9 = WEIGHT_EQ9,
    MOIT_WEIGHT_EQ10 = WEIGHT_EQ10,
    MOIT_WEIGHT_PHENOMENOLOGICAL = WEIGHT_PHENOMENOLOGICAL,
    MOIT_WEIGHT_GIVEN = WEIGHT_GIVEN, /* `weights` of the options */
} moit_weight;

/* What Moment Transparency reads its moments from. */
typedef enum moit_storage {
    MOIT_STORAGE_FLOAT = STORAGE_FLOAT32, /* as gathered */
    MOIT_STORAGE_NONLINEAR =
        STORAGE_NLQM, /* nodes, weight and offset of 16 bits; the total a half */
    MOIT_STORAGE_UNORM16 = STORAGE_UNORM16, /* moments of 16 bits; the total a half */
} moit_storage;

/* A quarter of the circle: beyond, MBOIT eq. 6 would need its other branches. */
#define MOIT_MOST_WRAPPING_ZONE 1.5707963267948966

/* ---- Options, as kinds share them */

typedef struct moit_weighted_options {
    moit_weight weight;
    double depth_scale;  /* scene units of the weight per unit of depth */
    int bits;            /* 16: the published targets; 32: numbers */
    const void *weights; /* (N), for MOIT_WEIGHT_GIVEN */
} moit_weighted_options;

/* What all that store moments share. */
typedef struct moit_moment_options {
    double bias;           /* share of a safe distribution mixed in; moit_default_bias */
    double overestimation; /* beta in [0, 1] */
    bool exclude_self;     /* a fragment does not occlude itself */
    int bits;              /* 16: words; 32: numbers of the precision */
    bool b0_is_half;       /* with 16 bits; else their b0 is a float */
    bool halves; /* power moments: half floats, to which blending adds terms; bits is 32 then */
    double wrapping_zone; /* theta of MBOIT 5.2, radians in [0, MOIT_MOST_WRAPPING_ZONE] */
} moit_moment_options;

typedef struct moit_transparency_options {
    moit_moment_options moments;
    int passes;           /* 1 or 2 */
    moit_storage storage; /* nonlinear: with resolution 1 only */
    bool average;         /* moments of a block are the mean of its pixels', not the middle one's */
    bool symmetric;       /* depth is warped to [-1, 1], not to [0, 1] */
} moit_transparency_options;

/* A network: layer by layer, output by output the weights of its inputs, then its bias;
 * moit_network_weights numbers. */
typedef struct moit_bounded_options {
    moit_moment_options moments;
    const float *network;
} moit_bounded_options;

/* The nearest `count` fragments, and of what reads the tail the options, as its kind has them. */
typedef struct moit_front_options {
    moit_moment_options moments;
    const float *network;
    moit_kind tail;
    int moment_count;
    bool small_keys; /* a key has 32 bits: depth and alpha are rounded, in moments, too; then not
                        with range_per_pixel */
} moit_front_options;

typedef struct moit_neural_options {
    const float *network;
    bool range_in_words; /* moments are of each pixel's own range of z, held in 16 bits an end */
} moit_neural_options;

typedef struct moit_series_options {
    int bits;          /* 16: half floats; 32: numbers of the precision */
    bool exclude_self; /* a fragment does not occlude itself */
    bool density;      /* wavelets of the absorbance at a depth, not in front of it */
} moit_series_options;

/* What has a table of its own of where slices stand. */
typedef enum moit_slice_table_of {
    MOIT_TABLE_IMAGE = TABLE_IMAGE,
    MOIT_TABLE_TILE = TABLE_TILE,   /* squares of pixels */
    MOIT_TABLE_PIXEL = TABLE_PIXEL, /* a pixel, or the block of those that share slices */
} moit_slice_table_of;

typedef struct moit_slice_options {
    int bits;        /* of a slice, from 2 to 16 */
    bool half_total; /* with full_total, that is kept as a half float */
    bool byte_total; /* with full_total, that is kept in a byte beside the block's */
    moit_slice_table_of table;
    int tile;     /* a side in pixels of MOIT_TABLE_TILE's squares, a multiple of the resolution */
    int cells;    /* of depth, that slices stand at the borders of: from 64 to 8192, a power of 2 */
    bool inside;  /* transmittance is kept within what four power moments prove */
    double bias;  /* MOIT_AVBOIT: slices that fragments read nearer than they are */
    bool average; /* MOIT_AVBOIT: blocks have the mean of their pixels, not the middle one's */
    bool cubic;   /* MOIT_AVBOIT: what is read is a cubic B-spline's, not the line between two */
} moit_slice_options;

typedef struct moit_layer_options {
    bool quantized;   /* layers are held in 16 bits a number */
    bool by_energy;   /* the two merge that do least for the picture, not as published */
    double min_alpha; /* in [0, 1]: fragments of lesser alpha are no layers */
    /* MOIT_MLAB, of two layers at least: the foremost is of what lies in front of the first with
     * front_alpha; the others of what does not, up to the first with back_alpha; the rest is
     * dropped. */
    bool buckets;
    double front_alpha, back_alpha; /* in [0, 1] */
} moit_layer_options;

typedef struct moit_sampling_options {
    uint32_t seed;   /* of what is random */
    bool stratified; /* a fragment covers alpha of the samples, not each with chance alpha */
} moit_sampling_options;

typedef struct moit_anchor_options {
    int cells;       /* 1 to MOST_CELLS, of a pixel's extent, beside those that the kept ones cut */
    double gamma;    /* importance is alpha exp(-gamma u), u warped depth */
    bool large_keys; /* a key has 64 bits, 24 of them of depth, instead of 32 and 16 */
} moit_anchor_options;

typedef struct moit_strong_options {
    double gamma;         /* as of anchors */
    bool large_keys;      /* likewise */
    const float *network; /* as of bounded neural transmittance with six moments */
} moit_strong_options;

/* A technique: its kind, what questions ask of any kind (0 where it has no use for it), and the
 * options of the kind. */
typedef struct moit_technique {
    moit_kind kind;
    int count;        /* moments (2, 4, 6, 8; trigonometric 2, 3, 4), layers, nodes, samples .. */
    bool normalize;   /* scale colours so that weights sum to what is covered (MBOIT eq. 2) */
    double max_alpha; /* in (0, 1): larger alpha is taken for this in logarithms */
    moit_warp warp;
    bool range_per_pixel; /* warp each pixel's own range of depth, not the image's */
    int resolution;       /* a side in pixels of the blocks that have states of their own; 0 and 1:
                             pixels have; else not with range_per_pixel, nor moments of 16 bits */
    bool full_total;      /* with blocks each pixel has its own total absorbance beside */
    bool depth_aware; /* with blocks those count whose opaque surfaces are as far as the pixel's;
                             their depths are positive */
    union {
        moit_weighted_options weighted;         /* MOIT_WEIGHTED_BLENDED */
        moit_moment_options moments;            /* whatever stores moments */
        moit_transparency_options transparency; /* MOIT_MOMENT_TRANSPARENCY */
        moit_bounded_options bounded;           /* MOIT_BOUNDED_NEURAL */
        moit_front_options front;               /* MOIT_FRONT */
        moit_neural_options neural;     /* MOIT_NEURAL_MOMENTS; MOIT_DEEP_FRAGMENTS: its network */
        moit_series_options series;     /* MOIT_FOURIER_OPACITY, _FUNCTION_MAP, _HAAR_WAVELETS */
        moit_slice_options slices;      /* MOIT_AVBOIT, MOIT_SLICES */
        moit_layer_options layers;      /* MOIT_ADAPTIVE, MOIT_MLAB */
        moit_sampling_options sampling; /* MOIT_STOCHASTIC, MOIT_HASHED_ALPHA */
        moit_anchor_options anchors;    /* MOIT_ANCHORS */
        moit_strong_options strong;     /* MOIT_STRONG */
        double tolerance;  /* MOIT_DEEP_SHADOW_MAP: how far a curve may lie from the exact one */
        double core_alpha; /* MOIT_HYBRID: what has less alpha is never of the foremost */
    };
} moit_technique;

typedef enum moit_option_type {
    MOIT_WHOLE,   /* int, from `least` to `most` */
    MOIT_NUMBER,  /* double */
    MOIT_TRUTH,   /* bool */
    MOIT_NETWORK, /* const float *; where moit_network_weights says that there is one */
} moit_option_type;

/* An option by its name: where moit_technique has it. */
typedef struct moit_option {
    const char *name;
    moit_option_type type;
    size_t offset;
    int least, most;
} moit_option;

/* All that a kind must have beside its weights, MOIT_WEIGHT_GIVEN, ended by one without a name. */
const moit_option *moit_options_of(moit_kind kind);

#endif
