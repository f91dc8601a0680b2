/* The exact transmittance: fragments in the order of their depth. */
#include "core/techniques/table.h"

void moit_sorted_weigh(const moit_job *job, moit_tile *tile) {
    job->stages->depth_ranks(tile->pixels, tile->offsets, tile->depth, tile->rank, tile->order);
    job->stages->ranked_transmittance(tile->pixels, tile->offsets, tile->alpha, tile->rank,
                                      tile->order, tile->T, tile->total);
}

static void sorted_weigh_and_blend(const moit_job *job, moit_tile *tile) {
    if (tile->emission == tile->alpha && tile->color) {
        job->stages->depth_ranks(tile->pixels, tile->offsets, tile->depth, tile->rank, tile->order);
        job->stages->ranked_blend(tile->pixels, tile->offsets, tile->alpha, tile->color, tile->rank,
                                  tile->order, tile->T, tile->total, tile->sums);
        return;
    }
    moit_sorted_weigh(job, tile);
    moit_blend(job, tile);
}

/* A curve counts what is strictly nearer. */
static double in_front_of(const moit_job *job, const moit_tile *tile, int p, double depth) {
    moit_precision precision = job->fragments->precision;
    double through = 1.0;
    for (int i = tile->offsets[p]; i < tile->offsets[p + 1]; ++i)
        if (moit_number(precision, tile->depth, i) < depth)
            through *= 1.0 - moit_number(precision, tile->alpha, i);
    return through;
}

static void sorted_curve(const moit_job *job, moit_tile *tile) {
    job->stages->products(tile->pixels, tile->offsets, tile->alpha, tile->total);
    for (int p = 0; p < tile->pixels; ++p)
        for (int64_t k = 0; k < job->depths; ++k)
            moit_set_number(job->fragments->precision, tile->curve, p * job->depths + k,
                            in_front_of(job, tile, p, job->depth[k]));
}

/* All is known but the last digits. Fragments at one depth do not occlude each other in MBOIT's
 * equation 1 and do here, in arrival order: the bounds hold either way. */
static void sorted_bounds(const moit_job *job, moit_tile *tile, double *lower, double *upper) {
    moit_precision precision = job->fragments->precision;
    job->stages->products(tile->pixels, tile->offsets, tile->alpha, tile->total);
    if (job->depths) {
        for (int p = 0; p < tile->pixels; ++p)
            for (int64_t k = 0; k < job->depths; ++k) {
                double T = in_front_of(job, tile, p, job->depth[k]);
                double slack = moit_product_slack(tile->offsets[p + 1] - tile->offsets[p]);
                lower[p * job->depths + k] = T * (1.0 - slack);
                upper[p * job->depths + k] = T * (1.0 + slack);
            }
        return;
    }
    job->stages->depth_ranks(tile->pixels, tile->offsets, tile->depth, tile->rank, tile->order);
    for (int p = 0; p < tile->pixels; ++p) {
        int start = tile->offsets[p], n = tile->offsets[p + 1] - start;
        int32_t *order = tile->order;
        for (int i = 0; i < n; ++i) order[tile->rank[start + i]] = start + i;
        double through = 1.0, nearer = 1.0, last = -__builtin_inf();
        for (int k = 0; k < n; ++k) {
            double depth = moit_number(precision, tile->depth, order[k]);
            if (depth > last) nearer = through;
            last = depth;
            double slack = moit_product_slack(k);
            lower[order[k]] = through * (1.0 - slack);
            upper[order[k]] = nearer * (1.0 + slack);
            through *= 1.0 - moit_number(precision, tile->alpha, order[k]);
        }
    }
}

const moit_technique_row moit_sorted_row = {.name = "sorted",
                                            .thick = MOIT_THICK_PIECES,
                                            .weigh = moit_sorted_weigh,
                                            .weigh_and_blend = sorted_weigh_and_blend,
                                            .pull_back = moit_sorted_pull_back,
                                            .curve = sorted_curve,
                                            .bounds = sorted_bounds,
                                            .by_channel = true,
                                            .takes_points = true,
                                            .arrival = MOIT_TIES_IN_ORDER,
                                            .ties = MOIT_TIES_EARLIER,
                                            .exact_up_to = MOIT_EXACT,
                                            .geometry_passes = 1};
