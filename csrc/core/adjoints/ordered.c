/* Backwards through products of 1 - alpha: techniques that know an order, and totals. */
#include "core/adjoints/adjoints.h"

/* From the last to the first: `rest`, what all that lies behind adds to the loss for a light of 1
 * that reaches it. Nothing is divided by, so alpha may be 1. */
void moit_adjoint_of_products(int n, const int32_t *order, const double *alpha, const double *by_T,
                              double by_total, double *by_alpha, double *through) {
    double T = 1.0, rest = by_total;
    for (int k = 0; k < n; ++k) {
        through[k] = T;
        T *= 1.0 - alpha[order ? order[k] : k];
    }
    for (int k = n; k-- > 0;) {
        int i = order ? order[k] : k;
        by_alpha[i] -= through[k] * rest;
        rest = (by_T ? by_T[i] : 0.0) + (1.0 - alpha[i]) * rest;
    }
}

void moit_adjoint_of_totals(const moit_tile *tile, const moit_adjoint *by, const double *by_total) {
    for (int p = 0; p < tile->pixels; ++p) {
        int first = tile->offsets[p], n = tile->offsets[p + 1] - first;
        moit_adjoint_of_products(n, NULL, (const double *)tile->alpha + first, NULL, by_total[p],
                                 by->alpha + first, by->work[0]);
    }
}

/* With the ranks that `weigh` has left. */
void moit_sorted_pull_back(const moit_job *job, moit_tile *tile, const moit_adjoint *by) {
    (void)job;
    for (int p = 0; p < tile->pixels; ++p) {
        int first = tile->offsets[p], n = tile->offsets[p + 1] - first;
        for (int i = 0; i < n; ++i) tile->order[first + tile->rank[first + i]] = i;
        moit_adjoint_of_products(n, tile->order + first, (const double *)tile->alpha + first,
                                 by->T + first, by->total[p], by->alpha + first, by->work[0]);
    }
}

/* The last to arrive is in front. */
void moit_alpha_blend_pull_back(const moit_job *job, moit_tile *tile, const moit_adjoint *by) {
    (void)job;
    for (int p = 0; p < tile->pixels; ++p) {
        int first = tile->offsets[p], n = tile->offsets[p + 1] - first;
        for (int k = 0; k < n; ++k) tile->order[first + k] = n - 1 - k;
        moit_adjoint_of_products(n, tile->order + first, (const double *)tile->alpha + first,
                                 by->T + first, by->total[p], by->alpha + first, by->work[0]);
    }
}
