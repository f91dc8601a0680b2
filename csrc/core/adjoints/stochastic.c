/* Backwards through stochastic transparency. Its pictures are steps, but what they are on average
 * has derivatives, and these the same samples estimate: E[T] is a product of 1 - alpha over what is
 * nearer, so T / (1 - alpha) is on average the derivative by such an alpha, but for its sign. */
#include "core/techniques/table.h"

/* How many of a pixel's n fragments, in order, are nearer than that. */
static int nearer_than(const double *depth, const int32_t *order, int n, double limit) {
    int at = 0, end = n;
    while (at < end) {
        int middle = (at + end) / 2;
        if (depth[order[middle]] < limit) at = middle + 1;
        else end = middle;
    }
    return at;
}

/* behind[k]: adds what lies behind the first k of them loses with what it is seen through. */
static void add_seen(const moit_job *job, const moit_tile *tile, int p, const moit_adjoint *by,
                     double *behind) {
    int first = tile->offsets[p], n = tile->offsets[p + 1] - first;
    const int32_t *order = tile->order + first;
    const double *depth = (const double *)tile->depth + first;
    const double *T = (const double *)(job->depths ? tile->curve : tile->T);
    int64_t begin = job->depths ? p * job->depths : first, count = job->depths ? job->depths : n;
    for (int64_t i = 0; i < count; ++i) {
        double at = job->depths ? job->depth[i] : depth[i];
        behind[nearer_than(depth, order, n, at)] += by->T[begin + i] * T[begin + i];
    }
}

/* Of what alpha 1 hides nothing is seen, and nothing is estimated. */
void moit_stochastic_pull_back(const moit_job *job, moit_tile *tile, const moit_adjoint *by) {
    job->stages->depth_ranks(tile->pixels, tile->offsets, tile->depth, tile->rank, tile->order);
    for (int p = 0; p < tile->pixels; ++p) {
        int first = tile->offsets[p], n = tile->offsets[p + 1] - first;
        int32_t *order = tile->order + first;
        const double *alpha = (const double *)tile->alpha + first;
        double *behind = by->work[0], sum = 0.0;
        for (int i = 0; i < n; ++i) order[tile->rank[first + i]] = i;
        for (int k = 0; k <= n; ++k) behind[k] = 0.0;
        add_seen(job, tile, p, by, behind);
        for (int k = n; k-- > 0;) {
            sum += behind[k + 1];
            if (alpha[order[k]] < 1.0) by->alpha[first + order[k]] -= sum / (1.0 - alpha[order[k]]);
        }
    }
    moit_adjoint_of_totals(tile, by, by->total);
}
