/* The loops over fragments, as one table per precision and instruction set.
 *
 * Tables of one precision give the same bits; a wider one is only faster. A stage works on a tile:
 * some hundred pixels whose numbers stay in cache. Array arguments written `void *` hold numbers of
 * the table's precision. `offsets` are a tile's own, from 0, pixels + 1 of them. Arrays marked
 * "padded" are read and written up to MOIT_PADDING numbers beyond their end. */
#ifndef MOIT_STAGES_H
#define MOIT_STAGES_H

#include "core/elementary.h"
#include "core/raster.h"
#include "core/splats.h"
#include "core/strokes.h"
#include "moit.h"

enum { MOIT_PADDING = 16 };

/* The most layers or nodes that a pixel keeps; numbers of a blended layer: depth, premultiplied
 * colour, transmittance. */
enum { MOIT_MOST_LAYERS = MOST_LAYERS, MOIT_LAYER_NUMBERS = 5 };

/* Numbers of a pixel of anchors (kernels/anchors.h). */
#define MOIT_ANCHOR_NUMBERS(kept, cells) (2 + 3 * (kept) + (cells))

/* z = low + scale * (warped depth - warped near), into [low, high]. */
typedef struct moit_warp_map {
    moit_warp warp;
    double near, far; /* what maps to low and high */
    double low, high;
} moit_warp_map;

/* What a map comes to in numbers of the precision (kernels/warp.h). */
moit_warp_steps moit_warp_steps_of(const moit_warp_map *map, moit_precision precision);

/* What the Gauss rule of n nodes takes: n nodes, n residues, the pivot
 * (kernels/power_moments.h). */
#define MOIT_RULE_SIZE(count) ((count) + 1)

/* The same rules as transmittance in floats reads them: rows of floats, in each a number of every
 * pixel, MOIT_ROW(pixels) apart. They are the nodes, what a float rounds off these, the residues
 * and the pivot. */
#define MOIT_RULE_ROWS(count) (3 * (count) / 2 + 1)
#define MOIT_ROW(pixels) (((pixels) + MOIT_PADDING - 1) / MOIT_PADDING * MOIT_PADDING)

/* The same of n trigonometric moments: n nodes as depths and as points of a line, n residues, the
 * pivot, and two numbers about the wrapping zone (kernels/trigonometric_moments.h). */
#define MOIT_CIRCLE_RULE_SIZE(count) (3 * (count) + 3)

/* What bounded neural transmittance makes of a rule: numbers that fragments share, with what the
 * network's first layer has summed of them, and what it has seen (kernels/bounded_neural.h). */
enum { MOIT_OUTLINE_SHARED = 3 + 8, MOIT_OUTLINE_SIZE = MOIT_OUTLINE_SHARED + 6 };

/* What neural moment transparency keeps of a pixel, and deep fragments while a question takes. */
enum { MOIT_NEURAL_RAY = 4, MOIT_DEEP_RAY = 28 };
/* What deep fragments make of a pixel: its colour and what it lets through. */
enum { MOIT_DEEP_COLOR = 20, MOIT_DEEP_TOTAL = MOIT_DEEP_COLOR + 3 };
/* What derivatives take of it. */
enum {
    MOIT_DEEP_LAST_Z = 2,
    MOIT_DEEP_B0 = 3,
    MOIT_DEEP_TAIL = 17,
    MOIT_DEEP_SHARE = 18,
    MOIT_DEEP_COVERED = 19
};
/* The sums of its tail, in half floats. */
enum { MOIT_DEEP_NEAR = 10, MOIT_DEEP_SUMS = 7 };

/* The wrapping zone of trigonometric moments as kernels/trigonometric_moments.h has it, and real
 * and imaginary parts of the powers 1 to 4 of the point of the unit circle that z = 0 is. */
typedef struct moit_wrapping_zone {
    double turns, edge, scale, middle[8];
} moit_wrapping_zone;

/* The families of moments: powers of depth, and of points of the unit circle. */
enum { MOIT_POWER, MOIT_TRIGONOMETRIC, MOIT_MOMENT_FAMILIES };

/* Stochastic transparency keeps a depth for each of so many samples, in rows that lanes divide. */
enum { MOIT_MOST_SAMPLES = MOST_SAMPLES };
#define MOIT_SAMPLE_ROW(samples) (((samples) + MOIT_PADDING - 1) / MOIT_PADDING * MOIT_PADDING)

/* What one family does. A pixel's moments are `numbers` numbers, its rule `rule_size` doubles
 * (moments.h has both). zone: not read by families that have none. */
typedef struct moit_moment_stages {
    /* Per pixel the sum b0 of a and the means b of the family's functions of z weighted by a; b is
     * 0 where b0 is. Summed in double, in one order for all tables; in double tables with what that
     * rounds off, so that the order of fragments does not show. a, z: padded. */
    void (*sums)(int count, const moit_wrapping_zone *zone, int pixels, const int32_t *offsets,
                 const void *a, const void *z, void *b0, void *b);
    /* Per pixel b0 and words (pixels, numbers) when fragments are blended in order of arrival
     * (kernels/moment_words.h). a, z: padded. */
    void (*words)(int count, const moit_wrapping_zone *zone, bool b0_is_half, int pixels,
                  const int32_t *offsets, const void *a, const void *z, uint16_t *words, void *b0);
    /* What words stand for: b (pixels, numbers), 0 where b0 is. Double tables only. */
    void (*decoded)(int count, int pixels, const uint16_t *words, const double *b0, double *b);
    /* Rules of moments b (pixels, numbers), biased toward `safe` (numbers); a pivot of their matrix
     * below `least` is rounding alone. floats: b are such as floats hold, and `least` or the bias
     * outweigh what those round off. Double tables only. */
    void (*rules)(int count, const moit_wrapping_zone *zone, bool floats, int pixels,
                  const double *b, double bias, const double *safe, double least, double *rules);
    /* The least pivot of the matrix of moments b (pixels, numbers), each pixel's biased toward
     * `safe` by bias[pixel]; the first that is not positive is the last that counts. Double tables
     * only. */
    void (*pivots)(int count, const moit_wrapping_zone *zone, int pixels, const double *b,
                   const double *bias, const double *safe, double *pivot);
    /* T of each z (padded) from its pixel's rule and b0; own: absorbance of the surface that asks
     * (padded), or NULL for none. absorbed: T gets what is absorbed in front, -ln T. T: padded. */
    void (*transmittance)(int count, const moit_wrapping_zone *zone, int pixels,
                          const int32_t *offsets, const void *z, const void *own,
                          const double *rules, const void *b0, double beta, bool absorbed, void *T);
    /* Rules of moments that are floats, as rows of floats, and T by these; offsets: NULL where each
     * pixel has one z. NULL: a family has none. Double tables, and float tables only. */
    void (*rule_rows)(int count, int pixels, const float *b, double bias, const double *safe,
                      double least, float *rows);
    void (*transmittance_by_rows)(int count, int pixels, const int32_t *offsets, const float *z,
                                  const float *own, const float *rows, const float *b0, double beta,
                                  bool absorbed, float *T);
} moit_moment_stages;

/* Where a cell's slices are: `slot` is twice the place of the slice at its front, and one more
 * where there is anything in it; of a cell with nothing in it that is the next slice behind. The
 * cell is part of a joined one that begins `from` cells before it, a share 1 / cells of it. */
typedef struct moit_slice_entry {
    uint16_t slot, from;
    float share;
} moit_slice_entry;

/* The least and the greatest of depths, and of those alone whose alpha is not 1. */
typedef struct moit_depth_ends {
    double near, far, clear_near, clear_far;
} moit_depth_ends;

typedef struct moit_stages {
    const char *name;

    /* Whether all of n numbers are in [low, high]; NaN is in no interval. */
    bool (*all_within)(int64_t n, const void *x, double low, double high);
    /* The same of depths x, of which those whose alpha is 1 may be any finite numbers; widens
     * `ends` to all. */
    bool (*depths_within)(int64_t n, const void *x, const void *alpha, double low, double high,
                          moit_depth_ends *ends);
    /* Whether back[i] is at least depth[i] for all n. */
    bool (*none_nearer)(int64_t n, const void *back, const void *depth);

    /* What a fragment covers of each channel, alpha (1 - transmission), and their mean, which is
     * exactly theirs where they agree. transmission: (n, 3). */
    void (*opacities)(int n, const void *alpha, const void *transmission, void *red, void *green,
                      void *blue, void *net);
    /* out[i] = -ln(1 - min(alpha[i], max_alpha)). out: padded. */
    void (*absorbance)(int n, const void *alpha, double max_alpha, void *out);
    /* out[i] = z of depth[i]. out: padded. */
    void (*warp)(int n, const void *depth, const moit_warp_map *map, void *out);
    /* out[i] = exp(-x[i]). */
    void (*decay)(int n, const void *x, void *out);

    moit_moment_stages moments[MOIT_MOMENT_FAMILIES];
    /* `sums` of four power moments for those who keep floats of them: what double rounds off is
     * lost. Double tables only. */
    void (*plain_power_sums)(int pixels, const int32_t *offsets, const void *a, const void *z,
                             void *b0, void *b);
    /* What moments b (pixels, count) prove about the share of absorbance in front of each z
     * (padded) without and with what lies at z itself; rules: of the same moments, biased. z is
     * known to within blur, b to within slack (pixels). at_least, at_most: padded. Double tables
     * only. */
    void (*power_bounds)(int count, int pixels, const int32_t *offsets, const double *z,
                         const double *b, const double *rules, double blur, const double *slack,
                         double *at_least, double *at_most);

    /* b0 and mean powers b (pixels, count) of sums that are held in half floats, to which fragments
     * are added as they arrive (kernels/half_moments.h). a, z: padded. */
    void (*half_moments)(int count, bool chebyshev, int pixels, const int32_t *offsets,
                         const void *a, const void *z, void *b0, void *b);
    /* Depths z in [-1, 1] (padded), in place, in each pixel's own extent, which is held in words;
     * extents (pixels, 2): where it begins and ends. */
    void (*own_extents)(int pixels, const int32_t *offsets, void *z, double *extents);
    /* The same of n more, all of one pixel. */
    void (*within_extent)(int n, const double *extent, void *z);

    /* Outlines (pixels, MOIT_OUTLINE_SIZE) of Gauss rules and totals; extents (pixels, 2): where
     * the network's z are those of pixels' own extents; NULL: the image's. Double tables only. */
    void (*bounded_outlines)(int count, int pixels, const double *rules, const double *b0,
                             const double *extents, const float *network, double *outlines);
    /* T of each z (padded) between the bounds of its pixel's moments; own, absorbed: as above. T:
     * padded. */
    void (*bounded_transmittance)(int count, int pixels, const int32_t *offsets, const void *z,
                                  const void *own, const double *rules, const double *outlines,
                                  const void *b0, const float *network, bool absorbed, void *T);
    /* What the network sees and the bounds, number by number, `stride` apart. */
    void (*bounded_features)(int count, int pixels, const int32_t *offsets, const void *z,
                             const void *own, const double *rules, const double *outlines,
                             const void *b0, const float *network, int64_t stride, void *features);
    /* Rules of moments that are floats with their outlines, as rows of floats: MOIT_RULE_ROWS, then
     * what fragments share of outlines; and T by these. Double tables, and float tables only. */
    void (*bounded_rows)(int count, int pixels, const float *b, const float *b0, double bias,
                         const double *safe, double least, const double *extents,
                         const float *network, float *rows);
    void (*bounded_by_rows)(int count, int pixels, const int32_t *offsets, const float *z,
                            const float *own, const float *rows, const float *b0,
                            const float *network, bool absorbed, float *T);

    /* Neural moment transparency. A pixel's ray (MOIT_NEURAL_RAY) is the extent of z as it is held,
     * in half floats or in words, the count and b0. This fills the extent, and `own` with z as
     * moments are taken of it. z, own: padded. */
    void (*neural_extents)(bool words, int pixels, const int32_t *offsets, const void *z,
                           void *rays, void *own);
    /* T of each z from its pixel's ray and moments b (pixels, 4); z, T: padded. */
    void (*neural_transmittance)(bool words, const float *network, int pixels,
                                 const int32_t *offsets, const void *z, const void *rays,
                                 const void *b, void *T);
    /* What the network sees of each z, number by number, `stride` apart. */
    void (*neural_features)(bool words, int pixels, const int32_t *offsets, const void *z,
                            const void *rays, const void *b, int64_t stride, void *features);
    /* Per pixel the two nearest fragments and what the others leave in sums: rays (pixels,
     * MOIT_DEEP_RAY), and rank 0, 1, or 2 for those others. color: (n, 3), or NULL. a, z:
     * padded. */
    void (*deep_capture)(int pixels, const int32_t *offsets, const void *depth, const void *alpha,
                         const void *a, const void *z, const void *color, int32_t *rank,
                         void *rays);
    /* The pixels' colours and totals, in their rays. */
    void (*deep_resolve)(const float *network, int pixels, void *rays);
    /* What fragments' colours count with in these. a, z, T: padded. */
    void (*deep_transmittance)(int pixels, const int32_t *offsets, const void *alpha, const void *a,
                               const void *z, const int32_t *rank, const void *rays, void *T);
    /* What the network sees of each fragment's pixel, and the fragment's T where the share is 0 and
     * how much more it is where that is 1: number by number, `stride` apart. */
    void (*deep_features)(int pixels, const int32_t *offsets, const void *alpha, const void *a,
                          const void *z, const int32_t *rank, const void *rays, int64_t stride,
                          void *features);

    /* Per pixel the 2^levels Haar coefficients c (pixels, 2^levels) of the absorbance in front of z
     * in [0, 1], or of its density; summed in double, or in half floats fragment by fragment. a, z:
     * padded. */
    void (*haar_sums)(int levels, bool density, bool as_half, int pixels, const int32_t *offsets,
                      const void *a, const void *z, void *c);
    /* In place, what answers go to at the end of each of the pixel's 2^levels cells. */
    void (*haar_cells)(int levels, bool density, int pixels, void *c);
    /* T of each z from its pixel's cells; own, absorbed: as above. T: padded. */
    void (*haar_transmittance)(int levels, bool density, int pixels, const int32_t *offsets,
                               const void *z, const void *own, const void *ends, bool absorbed,
                               void *T);
    /* out[i] = -ln(1 - max_alpha alpha[i]). out: padded. */
    void (*scaled_absorbance)(int n, const void *alpha, double max_alpha, void *out);
    /* out[i] = b0[i] as a half float keeps it. */
    void (*half_absorbance)(int n, const void *b0, void *out);
    /* out[i] = a[i] T[i]. All padded. */
    void (*occluded)(int n, const void *a, const void *T, void *out);
    /* T (padded) in place, where it is 0 as little as normal numbers allow. */
    void (*dimmest)(int n, void *T);
    /* T from that of second moments, whose total is `second`, in place. */
    void (*second_pass)(int pixels, const int32_t *offsets, const void *b0, const void *second,
                        void *T);
    /* Four moments b (pixels, 4) of depths in [-1, 1] or [0, 1], in place what words of 16 bits
     * keep of them; words (pixels, 4), or NULL. Double tables only. */
    void (*unorm16_moments)(bool symmetric, int pixels, double *b, double *words);
    /* Rules of four moments of depths in [low, low + extent], in place what non-linearly
     * quantised moments keep of them; words (pixels, 4), or NULL. Double tables only. */
    void (*nonlinear_moments)(double low, double extent, int pixels, double *rules, double *words);

    /* Weights of weighted blending; color may be NULL where the kind needs none. out: padded. */
    void (*blend_weights)(int kind, int n, const void *depth, const void *alpha,
                          const void *emission, const void *color, double near, double far,
                          double depth_scale, void *out);
    /* T of each fragment and the pixel's total, from an order: rank[i] is the fragment's place in
     * its pixel counted from the front. */
    void (*depth_ranks)(int pixels, const int32_t *offsets, const void *depth, int32_t *rank,
                        int32_t *scratch);
    void (*ranked_transmittance)(int pixels, const int32_t *offsets, const void *alpha,
                                 const int32_t *rank, int32_t *scratch, void *T, double *total);
    /* The same of what nobody else asks for T of, with what `blend` makes of it. T is scratch. */
    void (*ranked_blend)(int pixels, const int32_t *offsets, const void *alpha, const void *color,
                         const int32_t *rank, int32_t *scratch, void *T, double *total,
                         double *sum);
    /* T when each fragment is laid over those that arrived before it. */
    void (*arrival_transmittance)(int pixels, const int32_t *offsets, const void *alpha, void *T,
                                  double *total);
    /* The same of what nobody else asks for T of. */
    void (*arrival_blend)(int pixels, const int32_t *offsets, const void *alpha, const void *color,
                          void *T, double *total, double *sum);
    /* Products of 1 - alpha. */
    void (*products)(int pixels, const int32_t *offsets, const void *alpha, double *total);
    /* Sums of alpha, or of alpha times weight (NULL: 1). */
    void (*weight_sums)(int pixels, const int32_t *offsets, const void *alpha, const void *weight,
                        double *sum);
    /* Both; weight: NULL, 1. */
    void (*products_and_sums)(int pixels, const int32_t *offsets, const void *alpha,
                              const void *weight, double *total, double *sum);
    /* What n layers of the mean of this sum of alpha cover (table.h). Double tables only. */
    void (*averaged_coverage)(int pixels, const double *sum, const double *n, double *covered);
    /* What `blend` makes of weights times one factor a pixel, with which they sum to what all
     * cover, and the products. T is scratch. */
    void (*covered_blend)(int pixels, const int32_t *offsets, const void *alpha, const void *weight,
                          const void *color, void *T, double *total, double *sum);
    /* Products of 1 - alpha in a byte of 255 steps, rounded at every fragment as it arrives. */
    void (*revealage)(int pixels, const int32_t *offsets, const void *alpha, double *total);
    /* Per pixel (r, g, b, w), the sum of weight (emission color, alpha), in half floats, rounded
     * likewise. color: NULL for w alone. */
    void (*accumulation)(int pixels, const int32_t *offsets, const void *alpha,
                         const void *emission, const void *weight, const void *color, double *sum);
    /* T[i] = factor of the pixel times weight[i] (NULL: 1); 1 where the factor is 0. */
    void (*spread)(int pixels, const int32_t *offsets, const double *factor, const void *weight,
                   void *T);
    /* What `blend` makes of the same T, which nobody else asks for. */
    void (*spread_blend)(int pixels, const int32_t *offsets, const double *factor,
                         const void *weight, const void *alpha, const void *emission,
                         const void *color, double *sum);

    /* Coefficients b (pixels, count) of Fourier opacity maps, from fragments of absorbance a at z
     * in [0, 1]: sums of a, a cos(2 pi k z), a sin(2 pi k z), k = 1 .. (count - 1) / 2, in double
     * and one order, or held in half floats as fragments arrive. a, z: padded. */
    void (*fourier_sums)(int count, bool half, int pixels, const int32_t *offsets, const void *a,
                         const void *z, void *b);
    /* T of each z (padded); own, absorbed: as above. T: padded. */
    void (*fourier_transmittance)(int count, int pixels, const int32_t *offsets, const void *z,
                                  const void *own, const void *b, bool absorbed, void *T);
    /* Coefficients b (pixels, count) of transmittance function maps, from the exact transmittance T
     * (padded) in front of each fragment; with `half` these and total are rounded to half floats.
     * z: padded. */
    void (*function_sums)(int count, bool half, int pixels, const int32_t *offsets,
                          const void *alpha, const void *T, const void *z, void *b, double *total);
    /* T of each z (padded); alpha: of the surface that asks, NULL for none. T: padded. */
    void (*function_transmittance)(int count, int pixels, const int32_t *offsets, const void *z,
                                   const void *alpha, double max_alpha, const void *b,
                                   const double *total, void *T);
    /* Cells of z in [0, 1] and how far in them; of fragments, at row and column of the display,
     * codes of absorbance too, `scale` steps to one and `most` the largest. code: NULL, they are
     * none. All that is written is padded. */
    void (*slice_codes)(int cells, double scale, double most, int n, const void *z,
                        const void *absorbance, const uint32_t *row, const uint32_t *column,
                        void *cell, void *inside, void *code);
    /* How far in joined cells, and of a code what the slices in front and behind get; code, near,
     * far: or NULL. */
    void (*slice_shares)(int n, const void *from, const void *share, const void *code,
                         const void *inside, void *joined, void *near, void *far);
    /* Twice the steps in front of places, from sums before the slices around them. */
    void (*slice_depths)(int n, const void *before, const void *at, const void *behind,
                         const void *inside, void *twice);
    /* T of places, or with `absorbed` -ln T, of others than the place's own code, or NULL. */
    void (*slice_absorbance)(int n, const void *twice, const void *near, const void *code,
                             const void *inside, double half_step, bool absorbed, void *T);
    /* The same from blocks of total `low`, of pixels with the total `total`. */
    void (*block_absorbance)(int n, const void *twice, const void *low, const void *total,
                             const void *own, double half_step, bool absorbed, void *T);
    /* sum += weight * twice. */
    void (*slice_blend)(int n, const void *weight, const void *twice, void *sum);
    /* Absorbance in whole steps of 1 / 65536. */
    void (*fine_codes)(int n, const void *absorbance, void *out);
    /* Sets the bits of words that are cells of fragments first to end with any alpha. */
    void (*slice_marks)(int cells, int first, int end, const void *alpha, const void *cell,
                        uint64_t *words);
    /* What the table of each pixel says of cells. */
    void (*slice_join)(int pixels, const int32_t *offsets, const moit_slice_entry *const *table,
                       const void *cell, int32_t *slot, void *from, void *share);
    /* Sums around places, of the sums before slices that each pixel reads. */
    void (*slice_fetch)(int pixels, const int32_t *offsets, const uint32_t *const *sums,
                        const int32_t *slot, void *before, void *at, void *behind);
    /* Sums around the places asked about, of pixels' fragments; a slice has `most` at most. sums
     * (slots + 3, padded): of the last pixel, before each slice; unless `all`, as far as it has
     * any. */
    void (*slice_sums)(int slots, uint32_t most, int pixels, const int32_t *offsets,
                       const int32_t *slot, const void *near, const void *far,
                       const int32_t *asked_offsets, const int32_t *asked_slot, bool all,
                       void *before, void *at, void *behind, uint32_t *sums);
    /* Of slices that stand in the extent (pixels, 2) of what covers anything in each pixel, and
     * which a network reads: codes of fragments at z in [-1, 1]; where z is among `count` slices,
     * twice the first of the two around it, and what these two get of codes, or of NULL nothing.
     * slot, inside, near, far: padded. */
    void (*own_codes)(double scale, double most, int n, const void *z, const void *absorbance,
                      const uint32_t *row, const uint32_t *column, void *code);
    void (*covered_extents)(int pixels, const int32_t *offsets, const void *z, const void *alpha,
                            double *extents);
    void (*own_places)(int count, int pixels, const int32_t *offsets, const void *z,
                       const double *extents, const void *code, int32_t *slot, void *inside,
                       void *near, void *far);
    /* Sums around the places asked about, as kernels/slice_network.h has them, `stride` apart;
     * sums: of the last pixel that has such places, as slice_sums. */
    void (*sums_around)(int count, uint32_t most, int pixels, const int32_t *offsets,
                        const int32_t *slot, const void *near, const void *far,
                        const int32_t *asked_offsets, const int32_t *asked_slot, int64_t stride,
                        void *around, uint32_t *sums);
    /* T of places, or with `absorbed` -ln T, by what the network says; code: NULL where there are
     * no fragments. And what it sees, number by number, `column` apart. */
    void (*learnt_absorbance)(int n, const void *around, int64_t stride, const void *inside,
                              const void *near, const void *code, const void *absorbance,
                              double quantum, const float *network, bool absorbed, void *T);
    void (*slice_features)(int n, const void *around, int64_t stride, const void *inside,
                           const void *near, const void *code, const void *absorbance,
                           double quantum, int64_t column, void *features);
    /* Of AVBOIT: what the slices in front and behind get of absorbance, each rounded by itself. */
    void (*voxel_codes)(int n, const void *absorbance, const void *joined, double scale,
                        double most, void *near, void *far);
    /* z of places to read at, `shift` nearer. */
    void (*voxel_places)(int n, const void *z, double shift, void *out);
    /* Light at places between two slices (255 steps each), nothing before where z is below 0. */
    void (*voxel_light)(int n, const void *z, const void *first, const void *second,
                        const void *joined, void *T);
    void (*voxel_cubic_light)(int n, const void *z, const void *before, const void *first,
                              const void *second, const void *behind, const void *joined, void *T);
    /* key[i] = what the random numbers of a fragment hang on; row, column: of its pixel in the
     * display. row, column, key: padded. */
    void (*fragment_keys)(int n, uint32_t seed, const uint32_t *row, const uint32_t *column,
                          const void *depth, const void *alpha, uint32_t *key);
    /* The samples that each fragment covers, as bits of low and high; twin[i]: how many fragments
     * of the same key came before. key, twin, low, high: padded. */
    void (*coverage)(int samples, bool stratified, int n, const void *alpha, const uint32_t *key,
                     const uint32_t *twin, uint32_t *low, uint32_t *high);
    /* nearest (pixels, MOIT_SAMPLE_ROW): depth of the nearest fragment that covers each sample,
     * infinite where none does. */
    void (*nearest_covering)(int samples, int pixels, const int32_t *offsets, const void *depth,
                             const uint32_t *low, const uint32_t *high, void *nearest);
    /* T[i] = the share of the pixel's samples that hold nothing nearer than depth[i]. T: padded. */
    void (*shares_seen)(int samples, int pixels, const int32_t *offsets, const void *depth,
                        const void *nearest, void *T);
    /* Anchors: z in [0, 1] becomes the word that holds it, and each fragment's key, of 32 bits, or
     * large, of 64. z, keys: padded. */
    void (*anchor_keys)(bool large, double gamma, int n, const void *alpha, void *z, void *keys);
    /* Per pixel what is kept, MOIT_ANCHOR_NUMBERS: extent, words, absorbances, cells. own (padded),
     * absorbance, becomes -1 of fragments that are kept. shrink: 1 - max_alpha. word: padded. */
    void (*anchors)(bool large, int kept, int cells, double shrink, int pixels,
                    const int32_t *offsets, const void *alpha, const void *word, const void *keys,
                    void *own, void *numbers);
    /* T of each word (padded) from what its pixel keeps; own: as above, NULL for none. T:
     * padded. */
    void (*anchor_transmittance)(int kept, int cells, int pixels, const int32_t *offsets,
                                 const void *word, const void *own, const void *numbers, void *T);
    /* To out[i] comes what is kept in front of word[i] without cells, in double, by the order of
     * keys. word: padded. */
    void (*anchors_in_front)(int kept, int pixels, const int32_t *offsets, const void *word,
                             const void *numbers, void *out);
    /* z in [0, 1] becomes the word that holds it, 0 to 65535. z: padded. */
    void (*words)(int n, void *z);
    /* The same with eight binary digits behind the point, as large keys have it. */
    void (*fine_words)(int n, void *z);
    /* Per pixel the layers of multi-layer alpha blending, from the nearest (pixels, layers,
     * MOIT_LAYER_NUMBERS): in half floats where quantized; color may be NULL; alpha below `least`
     * is skipped. */
    void (*mlab)(int layers, bool quantized, bool by_energy, int pixels, const int32_t *offsets,
                 const void *depth, const void *alpha, const void *color, double least,
                 void *state);
    /* Per pixel the steps of adaptive transparency (pixels, nodes, 2): depth, T behind it. */
    void (*adaptive)(int nodes, bool quantized, bool by_energy, int pixels, const int32_t *offsets,
                     const void *depth, const void *alpha, void *steps);
    /* T of each z from its pixel's steps (pixels, count, 2), nearest first. T: padded. */
    void (*steps)(int count, int pixels, const int32_t *offsets, const void *z, const void *steps,
                  void *T);
    /* Ranks in the order in which a buffer of so many layers, the farthest leaving it over those
     * that left before, puts fragments one over the other. */
    void (*kbuffer_ranks)(int layers, int pixels, const int32_t *offsets, const void *depth,
                          int32_t *rank);
    /* From ranks by depth, T of the first `layers`, in `through` what these let through together,
     * which is T of all others, and in `behind` the sum of alpha of these others. Ranks of such as
     * have an alpha below `least`, which come after all others, become `layers` or more. */
    void (*foremost)(int layers, double least, int pixels, const int32_t *offsets,
                     const void *alpha, int32_t *rank, int32_t *scratch, void *T, double *through,
                     double *behind);
    /* T[i] = factor of the pixel for all but its first `layers`. */
    void (*tail)(int layers, int pixels, const int32_t *offsets, const int32_t *rank,
                 const double *factor, void *T);

    /* Per pixel (r, g, b, w), the sum of T (emission color, alpha), in double. color: NULL for w
     * alone; emission: often alpha itself. */
    void (*blend)(int pixels, const int32_t *offsets, const void *alpha, const void *emission,
                  const void *T, const void *color, double *sum);
    /* Pixels of an image out (.., 4): sums over a background (3), or (.., 3) with one `per_pixel`,
     * that is seen through `total`, and 1 - total. The p-th pixel is at place[p]; NULL: at p. sums
     * and total NULL: there is the background alone. scaling: one of SCALE_NOT .. of colours whose
     * weights do not sum to 1 - total. */
    void (*over)(int pixels, const int32_t *place, const double *total, const double *sums,
                 int scaling, const double *background, bool per_pixel, void *out);

    /* Of pixels between four of a smaller picture (upper left and right, lower left and right) each
     * one's share; across, along: where between them, in [0, 1); depth_aware: by depth, too, of the
     * pixel's opaque surface and of the four's (corner). All padded. */
    void (*upsampling)(bool depth_aware, int n, const void *across, const void *along,
                       const void *depth, const void *const corner[4], void *const share[4]);

    /* The pixels of a triangle among columns [left, right) and rows [top, bottom), at most a tile.
     * Returns how many. Double tables only. */
    int (*cover)(const moit_projected_triangle *triangle, int left, int top, int right, int bottom,
                 moit_covered *out);
    /* Their colour (3, MOIT_REACHED, padded), lit, and alpha (padded). view: a pixel's middle
     * (x, y) is seen along (view[0] x + view[1], view[2] y + view[3], 1). reached (lights,
     * MOIT_REACHED, padded): the share of each light there; NULL: all. Double tables only. */
    void (*shade)(int n, const moit_corners *corners, const moit_covered *at, const double view[4],
                  const moit_lights *lights, const double *reached, double *color, double *alpha);
    /* What of an image multiplies their colour, or for what is not lit their colour (as above), and
     * their alpha (padded), the image's and their own. Double tables only. */
    void (*sample)(int n, const moit_corners *corners, const moit_covered *at,
                   const moit_sampling *sampling, double *color, double *alpha);

    /* What a splat has in those pixels of the tile at (left, top), and in some beside them: its
     * alpha, 0 where it is not there, and where depth is not NULL how far it is. through: what
     * those before it let through, which it multiplies; below 0 where none follows any more: front
     * to back, where one would leave less than LEAST_SEEN. Arrays of MOIT_SPLAT_PIXELS, row by row.
     * Float only. */
    void (*splat)(const moit_screen_splat *splat, int left, int top, const moit_tile_pixels *pixels,
                  bool front_to_back, float *through, float *alpha, float *depth);

    /* What a part of a stroke has at n places (x + dx[i], y + dy[i]) of the screen, at most
     * MOIT_SAMPLES, dx and dy padded. Double tables only. */
    void (*stroke_points)(const moit_screen_stroke *stroke, const moit_stroke_sight *sight,
                          double x, double y, int n, const double *dx, const double *dy,
                          moit_stroke_points *out);
    /* A bit for each of MOIT_SAMPLES such places where something is met; any: or for some of them,
     * if for one. Double tables only. */
    uint64_t (*stroke_met)(const moit_screen_stroke *stroke, const moit_stroke_sight *sight,
                           double x, double y, const double *dx, const double *dy, bool any);
    /* How far the middles of n pixels from (left, top) to the right are from its outline on the
     * screen (padded). Double tables only. */
    void (*stroke_away)(const moit_screen_stroke *stroke, int left, int top, int n, double *away);
} moit_stages;

/* The base table where build or processor lack the instruction set. */
const moit_stages *moit_stages_of(moit_precision precision, moit_isa isa);

#endif
