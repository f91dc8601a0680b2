/* What techniques do backwards with a tile. */
#ifndef MOIT_ADJOINTS_H
#define MOIT_ADJOINTS_H

#include "core/tile.h"

/* The derivatives of a loss by a tile's numbers, of whose job and tile all numbers are double. The
 * technique's `weigh` has been asked of the tile. Where it `absorbs` it has given -ln T, and T here
 * is by that. */
typedef struct moit_adjoint {
    /* is given, and may be written over: (fragments), or where the job has some (pixels, depths) */
    double *T;
    double *total;             /* (pixels) is given, and may be written over */
    const double *depth_given; /* (fragments), which `weigh` may have made others of */
    /* added to: by alpha as the tile has it, by depth, by emission, and (3) by color */
    double *alpha, *depth, *emission, *color;
    double *work[3]; /* (fragments) to work with; padded */
    double *network; /* (weights) is added to, or NULL */
    double *curve_z; /* (pixels, depths) by z of the job's depths */
    double *kept;    /* (columns, `apart`) that `weigh_again` has left */
    int64_t apart;
    double *low; /* (pixels, nodes + 1) of rules that `weigh_again` has sought so; or NULL */
    const struct moit_block_slopes *blocks; /* where pixels read blocks; else NULL */
} moit_adjoint;

/* What is behind a picture's pixels, and where derivatives by it go. */
typedef struct moit_behind {
    const double *color; /* (pixels, 3), or (3) for all of them */
    bool per_pixel;
    double *by;  /* (pixels, 3) is filled, or (runs, 3) added to; NULL: not asked for */
    int64_t run; /* as many pixels make a run */
} moit_behind;

/* by_pixel: (pixels, 3) of a tile. What is behind opaque surfaces gets 0. */
void moit_behind_give(const moit_behind *behind, const moit_tile *tile, const double *by_pixel);

/* Where a pixel's state is read: at n places z, less the absorbances `own` of what lies there
 * (NULL: nothing). by: the derivatives by what is absorbed in front of each. Adds to by_z and, with
 * own, by_own. kept: columns, `apart` numbers from one to the next, of what has been found at the
 * places already; NULL: it is sought again. All are padded. */
typedef struct moit_readings {
    int n;
    const double *z, *own, *by;
    double *by_z, *by_own;
    const double *kept;
    int64_t apart;
} moit_readings;

/* Clears what techniques of states add to: by z in work[1], by absorbances in work[2], and by z of
 * a job's depths. */
void moit_adjoint_begin(const moit_job *job, const moit_tile *tile, const moit_adjoint *by);

/* Pixel p's: at its fragments, or at the job's depths. */
moit_readings moit_readings_of(const moit_job *job, const moit_tile *tile, const moit_adjoint *by,
                               int p, bool excludes);

/* 1 - total of a total exp(-b0), to its last digits where that is next to 1, too: of a b0 that is
 * less than that it is not the difference. */
#define MOIT_LITTLE_COVERED 1e-3
double moit_covered_by(double b0, double total);

/* Of an absorbance by alpha, which counts at `most` or up to it. */
double moit_absorbance_slope(const moit_technique *technique, double most, double alpha);

/* From the derivatives by absorbances, in work[2], to those by alpha. */
void moit_adjoint_of_absorbance(const moit_job *job, const moit_tile *tile, const moit_adjoint *by);

/* Of T[k] and the pixel's total, the products of 1 - alpha over those before in an order: adds to
 * `by_alpha` of the pixel's n. order[k]: the k-th; NULL: they are as they stand. by_T: NULL: 0. */
void moit_adjoint_of_products(int n, const int32_t *order, const double *alpha, const double *by_T,
                              double by_total, double *by_alpha, double *through);

/* The same of the total alone, of all pixels of a tile. */
void moit_adjoint_of_totals(const moit_tile *tile, const moit_adjoint *by, const double *by_total);

/* By a curve of pixel p that reads the products over `kept` fragments in tile->order: fills by_T,
 * by those in front of each of these, and gives that by the product of all. */
double moit_adjoint_read_curve(const moit_job *job, const moit_tile *tile, const moit_adjoint *by,
                               int p, int kept, double *by_T);

/* Of moit_averaged_coverage by the sum, and of the share that it is of the sum. */
double moit_averaged_slope(double sum, int n);
double moit_averaged_share_slope(double sum, int n);

/* The share that what a pixel's n fragments cover is of their sum of alpha, (1 - product of 1 -
 * alpha) / sum; 1 of nothing. Adds by_share times what that changes by with each to by_alpha, in an
 * order as above. work: (n). Nothing is a difference of what is nearly equal, so no digits are lost
 * where alpha is next to nothing, and nothing is infinite. */
double moit_adjoint_of_share(int n, const int32_t *order, const double *alpha, double by_share,
                             double *by_alpha, double *work);

/* How fast z rises: this, by depth itself where it is by logarithms; 0 where there is but one z. */
double moit_warp_rise(const moit_warp_map *map);
/* How fast z of such a map moves with depth there. */
double moit_warp_slope(const moit_warp_map *map, double rise, double depth);

/* From the derivatives by z, in work[1], to those by depth. */
void moit_adjoint_of_warp(const moit_job *job, const moit_tile *tile, const moit_adjoint *by);

/* From the derivative by the logarithm of the length that p's own range has in the image's. */
void moit_adjoint_of_unit(const moit_job *job, const moit_tile *tile, int p, double by_logarithm,
                          const moit_adjoint *by);

/* What moments may keep of a fragment. */
enum { MOIT_KEPT = 6 };

typedef void moit_pull_back(const moit_job *job, moit_tile *tile, const moit_adjoint *by);

moit_pull_back moit_sorted_pull_back, moit_alpha_blend_pull_back, moit_weighted_sum_pull_back,
    moit_weighted_average_pull_back, moit_weighted_blended_pull_back, moit_moments_pull_back,
    moit_fourier_pull_back, moit_haar_pull_back, moit_function_map_pull_back, moit_slices_pull_back,
    moit_peeling_pull_back, moit_hybrid_pull_back, moit_bounded_pull_back, moit_neural_pull_back,
    moit_deep_pull_back, moit_front_pull_back, moit_stochastic_pull_back,
    moit_neural_slices_pull_back;

/* As the technique's `weigh`, and keeps what its `pull_back` takes. */
void moit_moments_weigh_again(const moit_job *job, moit_tile *tile, const moit_adjoint *by);

/* Of slices within what moments prove: takes out of by->T what is kept at a bound, into
 * tile->bounds (lower, upper); and pulls that back, with z of the tile as slices have it. */
void moit_slices_take_bounded(const moit_job *job, const moit_tile *tile, const moit_adjoint *by);
void moit_slices_pull_bounds(const moit_job *job, moit_tile *tile, const moit_adjoint *by);

/* Of slices of a pixel, which n fragments have added `near` to, at slot / 2, and `far` to the next:
 * from derivatives by the sums before each, (MOIT_MOST_SLICES + 4), to those by what is added, in
 * place. One that has its most stays at that. */
void moit_slices_pull_sums(int n, const int32_t *slot, const double *near, const double *far,
                           double most, double *by_sum);

/* Why a technique has no derivatives; NULL: it has. */
const char *moit_weighted_blended_refusal(const moit_technique *technique);
const char *moit_front_refusal(const moit_technique *technique);
const char *moit_mt_refusal(const moit_technique *technique);
const char *moit_bounded_refusal(const moit_technique *technique);
const char *moit_slices_refusal(const moit_technique *technique);

#endif
