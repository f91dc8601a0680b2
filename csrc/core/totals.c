#include "core/totals.h"

void moit_blend(const moit_job *job, moit_tile *tile) {
    job->stages->blend(tile->pixels, tile->offsets, tile->alpha, tile->emission, tile->T,
                       tile->color, tile->sums);
}

void moit_total_product(const moit_job *job, moit_tile *tile) {
    job->stages->products(tile->pixels, tile->offsets, tile->alpha, tile->total);
}

void moit_bounds_of_total(const moit_tile *tile, int p, double *low, double *high) {
    double slack = moit_product_slack(tile->offsets[p + 1] - tile->offsets[p]);
    *low = tile->total[p] * (1.0 - slack);
    *high = tile->total[p] * (1.0 + slack);
}

void moit_total_bounds(const moit_job *job, moit_tile *tile, double *lower, double *upper) {
    const int32_t *offsets = job->depths ? tile->curve_offsets : tile->offsets;
    moit_total_product(job, tile);
    for (int p = 0; p < tile->pixels; ++p)
        for (int i = offsets[p]; i < offsets[p + 1]; ++i) {
            moit_bounds_of_total(tile, p, &lower[i], &upper[i]);
            upper[i] = 1.0;
        }
}
