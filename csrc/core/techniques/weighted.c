/* Techniques that blend with weights which other fragments of the pixel have no part in. */
#include "core/techniques/options.h"
#include "core/techniques/table.h"

#include <float.h>
#include <math.h>

/* Over, each fragment in front of those that arrived before it. */
static void alpha_blend_weigh(const moit_job *job, moit_tile *tile) {
    job->stages->arrival_transmittance(tile->pixels, tile->offsets, tile->alpha, tile->T,
                                       tile->total);
}

static void alpha_blend_weigh_and_blend(const moit_job *job, moit_tile *tile) {
    if (tile->emission == tile->alpha && tile->color) {
        job->stages->arrival_blend(tile->pixels, tile->offsets, tile->alpha, tile->color, tile->T,
                                   tile->total, tile->sums);
        return;
    }
    alpha_blend_weigh(job, tile);
    moit_blend(job, tile);
}

/* What a weight of 1 counts where `sum` is the pixel's; a number, even where that is next to
 * nothing. What covers nothing occludes nothing; what weighs nothing is not seen. */
static double share_of(double covered, double sum) {
    return sum > 0.0 ? fmin(covered / sum, DBL_MAX) : covered > 0.0 ? 1.0 : 0.0;
}

/* Meshkin, "Sort-independent alpha blending", 2007: only first-order terms of the product of all
 * overs, sum of alpha c + (1 - sum of alpha) times the background. Renormalised the coverage is
 * exact, as in weighted blending, and all weigh the same, by no more than they are. */
static void find_sum_factors(const moit_job *job, moit_tile *tile, double *factor) {
    bool exact = job->technique->normalize;
    if (exact) {
        job->stages->products_and_sums(tile->pixels, tile->offsets, tile->alpha, NULL, tile->total,
                                       factor);
        for (int p = 0; p < tile->pixels; ++p)
            factor[p] = fmin(share_of(1.0 - tile->total[p], factor[p]), 1.0);
        return;
    }
    job->stages->weight_sums(tile->pixels, tile->offsets, tile->alpha, NULL, factor);
    for (int p = 0; p < tile->pixels; ++p) {
        tile->total[p] = 1.0 - factor[p];
        factor[p] = 1.0;
    }
}

static void weighted_sum_weigh(const moit_job *job, moit_tile *tile) {
    find_sum_factors(job, tile, tile->sums);
    job->stages->spread(tile->pixels, tile->offsets, tile->sums, NULL, tile->T);
}

/* What T of one factor a pixel, tile->double_b0, and of weights comes to. */
static void blend_spread(const moit_job *job, moit_tile *tile, const void *weights) {
    job->stages->spread_blend(tile->pixels, tile->offsets, tile->double_b0, weights, tile->alpha,
                              tile->emission, tile->color, tile->sums);
}

static void weighted_sum_weigh_and_blend(const moit_job *job, moit_tile *tile) {
    find_sum_factors(job, tile, tile->double_b0);
    blend_spread(job, tile, NULL);
}

/* n layers of the mean opacity, which cover no more than each for itself; of parts of a layer, as
 * joined pictures have them, that is not so. What is so thin that nothing overlaps has no mean,
 * which might not be a normal number; one layer is its own mean, without a logarithm's rounding. */
double moit_averaged_coverage(double sum, double n) {
    double covered;
    moit_stages_of(MOIT_FLOAT64, MOIT_ISA_BASE)->averaged_coverage(1, &sum, &n, &covered);
    return covered;
}

/* Bavoil and Myers, "Order Independent Transparency with Dual Depth Peeling", 2008: n layers of the
 * mean opacity, in the mean colour weighted by opacity. */
static void find_average_factors(const moit_job *job, moit_tile *tile, double *factor) {
    job->stages->weight_sums(tile->pixels, tile->offsets, tile->alpha, NULL, factor);
    double *covers = tile->total, *n = tile->double_b;
    for (int p = 0; p < tile->pixels; ++p) n[p] = tile->offsets[p + 1] - tile->offsets[p];
    job->precise->averaged_coverage(tile->pixels, factor, n, covers);
    for (int p = 0; p < tile->pixels; ++p) {
        double sum = factor[p], covered = covers[p];
        tile->total[p] = 1.0 - covered;
        factor[p] = sum > 0.0 ? covered / sum : 1.0;
    }
}

static void weighted_average_weigh(const moit_job *job, moit_tile *tile) {
    find_average_factors(job, tile, tile->sums);
    job->stages->spread(tile->pixels, tile->offsets, tile->sums, NULL, tile->T);
}

static void weighted_average_weigh_and_blend(const moit_job *job, moit_tile *tile) {
    find_average_factors(job, tile, tile->double_b0);
    blend_spread(job, tile, NULL);
}

/* What a pixel lets through: with 16 bits a byte of the revealage target. */
static void weighted_blended_total(const moit_job *job, moit_tile *tile) {
    (job->technique->weighted.bits == 16 ? job->stages->revealage : job->stages->products)(
        tile->pixels, tile->offsets, tile->alpha, tile->total);
}

/* `weigh` leaves those of the other kinds in tile->z. */
static const void *weights_of(const moit_job *job, const moit_tile *tile) {
    return job->technique->weighted.weight == MOIT_WEIGHT_GIVEN ? tile->weights : tile->z;
}

static void find_weights(const moit_job *job, moit_tile *tile) {
    const moit_technique *technique = job->technique;
    if (technique->weighted.weight != MOIT_WEIGHT_GIVEN)
        job->stages->blend_weights((int)technique->weighted.weight, tile->fragments, tile->depth,
                                   tile->alpha, tile->emission, tile->color, job->fragments->near,
                                   job->fragments->far, technique->weighted.depth_scale, tile->z);
}

/* McGuire and Bavoil 2013: the covered share of the pixel, split by weight times alpha. */
static void find_blended_factors(const moit_job *job, moit_tile *tile, double *factor) {
    const void *weights = weights_of(job, tile);
    find_weights(job, tile);
    if (job->technique->weighted.bits == 16) {
        weighted_blended_total(job, tile);
        job->stages->accumulation(tile->pixels, tile->offsets, tile->alpha, NULL, weights, NULL,
                                  tile->sums);
        for (int p = 0; p < tile->pixels; ++p) factor[p] = tile->sums[4 * p + 3];
    } else {
        job->stages->products_and_sums(tile->pixels, tile->offsets, tile->alpha, weights,
                                       tile->total, factor);
    }
    for (int p = 0; p < tile->pixels; ++p) factor[p] = share_of(1.0 - tile->total[p], factor[p]);
}

static void weighted_blended_weigh(const moit_job *job, moit_tile *tile) {
    find_blended_factors(job, tile, tile->sums);
    job->stages->spread(tile->pixels, tile->offsets, tile->sums, weights_of(job, tile), tile->T);
}

/* With 16 bits the sums are those of the accumulation target. */
static void weighted_blended_blend(const moit_job *job, moit_tile *tile) {
    if (job->technique->weighted.bits != 16) {
        moit_blend(job, tile);
        return;
    }
    job->stages->accumulation(tile->pixels, tile->offsets, tile->alpha, tile->emission,
                              weights_of(job, tile), tile->color, tile->sums);
    for (int p = 0; p < tile->pixels; ++p) {
        double *sum = tile->sums + 4 * p, share = share_of(1.0 - tile->total[p], sum[3]),
               most = 0.0;
        for (int k = 0; k < 4; ++k) most = fmax(most, fabs(sum[k]));
        tile->double_b0[p] = most;
        for (int k = 0; k < 4; ++k) sum[k] *= share;
    }
}

static void weighted_blended_weigh_and_blend(const moit_job *job, moit_tile *tile) {
    if (job->technique->weighted.bits == 16) {
        weighted_blended_weigh(job, tile);
        weighted_blended_blend(job, tile);
        return;
    }
    if (tile->emission == tile->alpha && tile->color) {
        find_weights(job, tile);
        job->stages->covered_blend(tile->pixels, tile->offsets, tile->alpha, weights_of(job, tile),
                                   tile->color, tile->T, tile->total, tile->sums);
        return;
    }
    find_blended_factors(job, tile, tile->double_b0);
    blend_spread(job, tile, weights_of(job, tile));
}

static bool weighted_blended_overflows(const moit_job *job, const moit_tile *tile, int p) {
    return job->technique->weighted.bits == 16 && tile->double_b0[p] >= MOIT_MOST_HALF;
}

/* ---- Targets that are joined with others (mixed_resolution.c) ----------------------------------
 */

void moit_weighted_targets(const moit_job *job, moit_tile *tile) {
    const void *weights = tile->T;
    if (job->technique->kind == MOIT_WEIGHTED_BLENDED) {
        find_weights(job, tile);
        weights = weights_of(job, tile);
        weighted_blended_total(job, tile);
    } else {
        bool exact = moit_multiplies_totals(job->technique);
        if (exact) job->stages->products(tile->pixels, tile->offsets, tile->alpha, tile->total);
        for (int p = 0; p < tile->pixels; ++p) {
            tile->sums[p] = 1.0;
            if (!exact) tile->total[p] = tile->offsets[p + 1] - tile->offsets[p];
        }
        job->stages->spread(tile->pixels, tile->offsets, tile->sums, NULL, tile->T);
    }
    bool published =
        job->technique->kind == MOIT_WEIGHTED_BLENDED && job->technique->weighted.bits == 16;
    if (published)
        job->stages->accumulation(tile->pixels, tile->offsets, tile->alpha, tile->emission, weights,
                                  tile->color, tile->sums);
    else
        job->stages->blend(tile->pixels, tile->offsets, tile->alpha, tile->emission, weights,
                           tile->color, tile->sums);
}

bool moit_multiplies_totals(const moit_technique *technique) {
    return technique->kind == MOIT_WEIGHTED_BLENDED
           || (technique->kind == MOIT_WEIGHTED_SUM && technique->normalize);
}

double moit_target_share(const moit_technique *technique, double weight, double second,
                         double *total) {
    double covered = weight;
    if (technique->kind == MOIT_WEIGHTED_AVERAGE) covered = moit_averaged_coverage(weight, second);
    if (moit_multiplies_totals(technique)) covered = 1.0 - second;
    *total = 1.0 - covered;
    if (moit_multiplies_totals(technique)) return share_of(covered, weight);
    return weight > 0.0 ? covered / weight : 1.0;
}

const moit_technique_row moit_unsorted_row = {.name = "unsorted",
                                              .thick = MOIT_THICK_MIDDLE,
                                              .weigh = alpha_blend_weigh,
                                              .weigh_and_blend = alpha_blend_weigh_and_blend,
                                              .pull_back = moit_alpha_blend_pull_back,
                                              .by_channel = true,
                                              .arrival = MOIT_IN_ORDER,
                                              .ties = MOIT_TIES_LATER,
                                              .exact_up_to = 1,
                                              .geometry_passes = 1};

const moit_technique_row moit_weighted_sum_row = {.name = "weighted-sum",
                                                  OPTIONS(NORMALIZE),
                                                  .thick = MOIT_THICK_MIDDLE,
                                                  .weigh = weighted_sum_weigh,
                                                  .weigh_and_blend = weighted_sum_weigh_and_blend,
                                                  .pull_back = moit_weighted_sum_pull_back,
                                                  .adds_targets = true,
                                                  .exact_up_to = 1,
                                                  .geometry_passes = 1};

const moit_technique_row moit_weighted_average_row = {.name = "weighted-average",
                                                      .thick = MOIT_THICK_MIDDLE,
                                                      .weigh = weighted_average_weigh,
                                                      .weigh_and_blend =
                                                          weighted_average_weigh_and_blend,
                                                      .pull_back = moit_weighted_average_pull_back,
                                                      .adds_targets = true,
                                                      .exact_up_to = 1,
                                                      .geometry_passes = 1};

const moit_technique_row moit_wboit_row = {
    .name = "wboit",
    OPTIONS(WHOLE("weight", weighted.weight, 0, MOIT_WEIGHT_GIVEN),
            NUMBER("depth_scale", weighted.depth_scale), WHOLE("bits", weighted.bits, 16, 32)),
    .thick = MOIT_THICK_MIDDLE,
    .weigh = weighted_blended_weigh,
    .weigh_and_blend = weighted_blended_weigh_and_blend,
    .pull_back = moit_weighted_blended_pull_back,
    .refusal = moit_weighted_blended_refusal,
    .overflows = weighted_blended_overflows,
    .blend = weighted_blended_blend,
    .total = weighted_blended_total,
    .adds_targets = true,
    .geometry_passes = 1};
