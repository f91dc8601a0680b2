/* Stages that know an order: front to back, or that of arrival. */

/* Up to this many fragments of a pixel, counting for each how many lie in front of it beats
 * sorting; lanes make n^2 comparisons cheap. */
enum { COUNTED_RANKS = 48 };

FN void counted_ranks(int n, const SCALAR *depth, int32_t *rank) {
    SCALAR d[COUNTED_RANKS + LANES];
    /* NaN, put there after the fragments were checked, goes last: ranks are a permutation always */
    for (int i = 0; i < n; ++i) d[i] = depth[i] == depth[i] ? depth[i] : (SCALAR)__builtin_inf();
    for (int i = n; i < n + LANES; ++i) d[i] = d[0];
    truth lane;
    for (int k = 0; k < LANES; ++k) lane[k] = k;
    for (int i = 0; i < n; i += LANES) {
        real own = load(d + i);
        truth count = {0}, place = lane + (bits)i;
        for (int j = 0; j < n; ++j) {
            real other = K(d[j]);
            /* a truth is -1 */
            count -= (other < own) | ((other == own) & ((truth){0} + (bits)j < place));
        }
        for (int k = 0; k < LANES && i + k < n; ++k) rank[i + k] = (int32_t)count[k];
    }
}

/* Merges sorted runs of doubling length; equal depths keep their order of arrival. */
static void merged_ranks(int n, const SCALAR *depth, int32_t *rank, int32_t *scratch) {
    int32_t *from = scratch, *to = rank;
    for (int start = 0; start < n; start += COUNTED_RANKS) {
        int length = n - start < COUNTED_RANKS ? n - start : COUNTED_RANKS;
        counted_ranks(length, depth + start, rank + start);
        for (int i = start; i < start + length; ++i) from[start + rank[i]] = i;
    }
    for (int run = COUNTED_RANKS; run < n; run *= 2) {
        for (int start = 0; start < n; start += 2 * run) {
            int middle = start + run < n ? start + run : n,
                end = middle + run < n ? middle + run : n;
            int left = start, right = middle;
            for (int k = start; k < end; ++k) {
                bool take_right =
                    left >= middle || (right < end && depth[from[right]] < depth[from[left]]);
                to[k] = take_right ? from[right++] : from[left++];
            }
        }
        int32_t *swap = from;
        from = to;
        to = swap;
    }
    /* `from` lists fragments front to back; the other array may take the ranks */
    for (int k = 0; k < n; ++k) to[from[k]] = k;
    if (to != rank) memcpy(rank, to, (size_t)n * sizeof *rank);
}

static void depth_ranks_stage(int pixels, const int32_t *offsets, const void *depth_, int32_t *rank,
                              int32_t *scratch) {
    const SCALAR *depth = depth_;
    for (int p = 0; p < pixels; ++p) {
        int start = offsets[p], n = offsets[p + 1] - start;
        if (n <= COUNTED_RANKS) counted_ranks(n, depth + start, rank + start);
        else merged_ranks(n, depth + start, rank + start, scratch);
    }
}

/* In double: this is what everything else is held against. */
static void ranked_transmittance_stage(int pixels, const int32_t *offsets, const void *alpha_,
                                       const int32_t *rank, int32_t *order, void *T_,
                                       double *total) {
    const SCALAR *alpha = alpha_;
    SCALAR *T = T_;
    for (int p = 0; p < pixels; ++p) {
        int start = offsets[p], n = offsets[p + 1] - start;
        for (int i = 0; i < n; ++i) order[rank[start + i]] = start + i;
        double through = 1.0;
        for (int k = 0; k < n; ++k) {
            T[order[k]] = (SCALAR)through;
            through *= 1.0 - (double)alpha[order[k]];
        }
        total[p] = through;
    }
}

static void arrival_transmittance_stage(int pixels, const int32_t *offsets, const void *alpha_,
                                        void *T_, double *total) {
    const SCALAR *alpha = alpha_;
    SCALAR *T = T_;
    for (int p = 0; p < pixels; ++p) {
        double through = 1.0;
        for (int i = offsets[p + 1]; i-- > offsets[p];) {
            T[i] = (SCALAR)through;
            through *= 1.0 - (double)alpha[i];
        }
        total[p] = through;
    }
}
