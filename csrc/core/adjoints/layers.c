/* Backwards through techniques that keep the nearest fragments as they are, techniques/layers.c:
 * these exactly, the others as the technique has them. Which are the nearest stays as it is. */
#include "core/techniques/table.h"

/* The foremost of pixel p, by the ranks that `weigh` has left; gives how many they are. */
static int list_foremost(const moit_job *job, const moit_tile *tile, int p) {
    int first = tile->offsets[p], n = tile->offsets[p + 1] - first, kept = 0;
    for (int i = 0; i < n; ++i)
        if (tile->rank[first + i] < job->technique->count) {
            tile->order[first + tile->rank[first + i]] = i;
            ++kept;
        }
    return kept;
}

void moit_peeling_see(const moit_job *job, const moit_tile *tile, double *T) {
    for (int i = 0; i < tile->fragments; ++i)
        if (tile->rank[i] >= job->technique->count) T[i] = 0.0;
}

void moit_peeling_unsee(const moit_job *job, const moit_tile *tile, const moit_adjoint *by) {
    moit_peeling_see(job, tile, by->T);
}

/* Those that no pass draws are seen through all that are drawn. */
void moit_peeling_pull_back(const moit_job *job, moit_tile *tile, const moit_adjoint *by) {
    double *by_T = by->work[1];
    for (int p = 0; p < tile->pixels; ++p) {
        int first = tile->offsets[p], n = tile->offsets[p + 1] - first;
        int kept = list_foremost(job, tile, p);
        const int32_t *order = tile->order + first;
        const double *alpha = (const double *)tile->alpha + first;
        double by_core = 0.0, by_total = by->total[p], core = 1.0;
        if (job->depths) by_core = moit_adjoint_read_curve(job, tile, by, p, kept, by_T);
        for (int i = 0; !job->depths && i < n; ++i) {
            if (tile->rank[first + i] < kept) by_T[i] = by->T[first + i];
            else by_core += by->T[first + i];
        }
        for (int k = 0; k < kept; ++k) core *= 1.0 - alpha[order[k]];
        if (job->technique->normalize && core < 1.0)
            moit_adjoint_of_products(n, NULL, alpha, NULL, by_total, by->alpha + first,
                                     by->work[0]);
        else by_core += by_total;
        moit_adjoint_of_products(kept, order, alpha, by_T, by_core, by->alpha + first, by->work[0]);
    }
}

void moit_hybrid_pull_back(const moit_job *job, moit_tile *tile, const moit_adjoint *by) {
    for (int p = 0; p < tile->pixels; ++p) {
        int first = tile->offsets[p], n = tile->offsets[p + 1] - first, behind = 0;
        int kept = list_foremost(job, tile, p);
        int32_t *order = tile->order + first;
        const double *alpha = (const double *)tile->alpha + first;
        double *by_alpha = by->alpha + first;
        double core = 1.0, sum = 0.0, by_factor = 0.0;
        for (int k = 0; k < kept; ++k) core *= 1.0 - alpha[order[k]];
        for (int i = 0; i < n; ++i) {
            if (tile->rank[first + i] < kept) continue;
            sum += alpha[i];
            by_factor += by->T[first + i];
            order[kept + behind++] = i;
        }
        double share = 1.0, by_share = core * by_factor, by_through = core * by->total[p];
        if (job->technique->normalize) {
            share =
                moit_adjoint_of_share(behind, order + kept, alpha, by_share, by_alpha, by->work[0]);
            moit_adjoint_of_products(behind, order + kept, alpha, NULL, by_through, by_alpha,
                                     by->work[0]);
        } else {
            double by_sum = -by_through * moit_averaged_slope(sum, behind);
            if (sum > 0.0) {
                by_sum += by_share * moit_averaged_share_slope(sum, behind);
                share = moit_averaged_coverage(sum, behind) / sum;
            }
            for (int k = kept; k < n; ++k) by_alpha[order[k]] += by_sum;
        }
        double by_core = by_factor * share + by->total[p] * (1.0 - share * sum);
        moit_adjoint_of_products(kept, order, alpha, by->T + first, by_core, by_alpha, by->work[0]);
    }
}
