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

double moit_adjoint_of_share(int n, const int32_t *order, const double *alpha, double by_share,
                             double *by_alpha, double *work) {
    double *before = work, covered = 0.0, sum = 0.0, rest = 0.0; /* 1 less the share */
    for (int k = 0; k < n; ++k) {
        double own = alpha[order ? order[k] : k];
        before[k] = covered;
        sum += own;
        if (own > 0.0) rest += own / sum * (covered - rest);
        covered += own * (1.0 - covered);
    }
    if (!(sum > 0.0)) return 1.0;
    double behind = 0.0;
    for (int k = n; k-- > 0;) {
        int i = order ? order[k] : k;
        double others = before[k] + behind * (1.0 - before[k]);
        by_alpha[i] += by_share * ((rest - others) / sum);
        behind += alpha[i] * (1.0 - behind);
    }
    return 1.0 - rest;
}

void moit_adjoint_of_totals(const moit_tile *tile, const moit_adjoint *by, const double *by_total) {
    for (int p = 0; p < tile->pixels; ++p) {
        int first = tile->offsets[p], n = tile->offsets[p + 1] - first;
        moit_adjoint_of_products(n, NULL, (const double *)tile->alpha + first, NULL, by_total[p],
                                 by->alpha + first, by->work[0]);
    }
}

/* A curve is read in front of the first fragment that is not nearer, or behind all. */
double moit_adjoint_read_curve(const moit_job *job, const moit_tile *tile, const moit_adjoint *by,
                               int p, int kept, double *by_T) {
    const double *depth = (const double *)tile->depth + tile->offsets[p];
    const int32_t *order = tile->order + tile->offsets[p];
    double by_all = 0.0;
    for (int k = 0; k < kept; ++k) by_T[order[k]] = 0.0;
    for (int64_t k = 0; k < job->depths; ++k) {
        int at = 0, end = kept;
        while (at < end) {
            int middle = (at + end) / 2;
            if (depth[order[middle]] < job->depth[k]) at = middle + 1;
            else end = middle;
        }
        *(at < kept ? &by_T[order[at]] : &by_all) += by->T[p * job->depths + k];
    }
    return by_all;
}

/* With the ranks that `weigh` has left; a curve needs none. */
void moit_sorted_pull_back(const moit_job *job, moit_tile *tile, const moit_adjoint *by) {
    if (job->depths)
        job->stages->depth_ranks(tile->pixels, tile->offsets, tile->depth, tile->rank, tile->order);
    for (int p = 0; p < tile->pixels; ++p) {
        int first = tile->offsets[p], n = tile->offsets[p + 1] - first;
        const double *by_T = job->depths ? by->work[1] : by->T + first;
        for (int i = 0; i < n; ++i) tile->order[first + tile->rank[first + i]] = i;
        double by_total = by->total[p];
        if (job->depths) by_total += moit_adjoint_read_curve(job, tile, by, p, n, by->work[1]);
        moit_adjoint_of_products(n, tile->order + first, (const double *)tile->alpha + first, by_T,
                                 by_total, by->alpha + first, by->work[0]);
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
