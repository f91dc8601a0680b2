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

/* Ranks of LANES pixels of at most COUNTED_IN_LANES fragments each: how many lie in front is
 * counted for both of each pair at once. Beyond a pixel's last they are infinitely far. */
enum { COUNTED_IN_LANES = 32 };

typedef struct {
    int32_t start[LANES], count[LANES];
    int there, most;
} pixels_in_lanes;

FN pixels_in_lanes pixels_in_lanes_at(const equal_counts *by, int k, int end) {
    pixels_in_lanes at = {.there = end - k < LANES ? end - k : LANES};
    for (int lane = 0; lane < LANES; ++lane) {
        int one = lane < at.there ? k + lane : k;
        at.start[lane] = by->start[one];
        at.count[lane] = by->count[one];
    }
    at.most = at.count[at.there - 1];
    return at;
}

FN void ranks_in_lanes(const pixels_in_lanes *at, const SCALAR *depth, int32_t *rank) {
    SCALAR own[COUNTED_IN_LANES][LANES];
    bits found[COUNTED_IN_LANES][LANES];
    truth count[COUNTED_IN_LANES];
    const int n = at->most;
    for (int lane = 0; lane < LANES; ++lane) {
        const SCALAR *of_pixel = depth + at->start[lane];
        for (int i = 0; i < at->count[lane]; ++i) own[i][lane] = of_pixel[i];
        for (int i = at->count[lane]; i < n; ++i) own[i][lane] = (SCALAR)__builtin_inf();
    }
    for (int i = 0; i < n; ++i) {
        real d = load(own[i]); /* NaN goes last, as above */
        store(own[i], select(d == d, d, K(__builtin_inf())));
        count[i] = (truth){0} + (bits)(n - 1 - i);
    }
    for (int i = 1; i < n; ++i) {
        real d = load(own[i]);
        truth behind = count[i];
        for (int j = 0; j < i; ++j) {
            truth before = load(own[j]) <= d; /* -1 where j lies in front of i */
            behind -= before;
            count[j] += before;
        }
        count[i] = behind;
    }
    memcpy(found, count, (size_t)n * sizeof *count);
    for (int lane = 0; lane < at->there; ++lane)
        for (int i = 0; i < at->count[lane]; ++i)
            rank[at->start[lane] + i] = (int32_t)found[i][lane];
}

static void ranks_of_pixel(int n, const SCALAR *depth, int32_t *rank, int32_t *scratch) {
    if (n <= COUNTED_RANKS) counted_ranks(n, depth, rank);
    else merged_ranks(n, depth, rank, scratch);
}

static void depth_ranks_stage(int pixels, const int32_t *offsets, const void *depth_, int32_t *rank,
                              int32_t *scratch) {
    const SCALAR *depth = depth_;
    for (int begin = 0; begin < pixels; begin += ORDERED_PIXELS) {
        equal_counts by;
        int end = begin + ORDERED_PIXELS < pixels ? begin + ORDERED_PIXELS : pixels;
        touch(depth + offsets[begin], depth + offsets[end]);
        order_by_count(&by, begin, end, offsets);
        for (int k = by.first[1]; k < by.first[2]; ++k) rank[by.start[k]] = 0;
        for (int k = by.first[2], few = by.first[COUNTED_IN_LANES + 1]; k < few; k += LANES) {
            pixels_in_lanes at = pixels_in_lanes_at(&by, k, few);
            ranks_in_lanes(&at, depth, rank);
        }
        for (int k = by.first[COUNTED_IN_LANES + 1]; k < by.first[COUNTS]; ++k) {
            int start = by.start[k], n = by.count[k];
            ranks_of_pixel(n, depth + start, rank + start, scratch);
        }
    }
}

/* T of one pixel's fragments and what all let through, by their ranks or by arrival. In double:
 * this is what everything else is held against. */
FN double passed_in_order(int p, const int32_t *offsets, const SCALAR *alpha, const int32_t *rank,
                          int32_t *order, SCALAR *T) {
    int start = offsets[p], n = offsets[p + 1] - start;
    for (int i = 0; i < n; ++i) order[rank[start + i]] = start + i;
    double through = 1.0;
    for (int k = 0; k < n; ++k) {
        T[order[k]] = (SCALAR)through;
        through *= 1.0 - (double)alpha[order[k]];
    }
    return through;
}

FN double passed_in_arrival(int p, const int32_t *offsets, const SCALAR *alpha, SCALAR *T) {
    double through = 1.0;
    for (int i = offsets[p + 1]; i-- > offsets[p];) {
        T[i] = (SCALAR)through;
        through *= 1.0 - (double)alpha[i];
    }
    return through;
}

/* Numbers of four pixels by their ranks; 0 beyond a pixel's last. */
FN void put_in_order(const four_pixels *four, const int most, const bool equal, const SCALAR *alpha,
                     const int32_t *rank, SCALAR (*ranked)[COUNTS]) {
    for (int lane = 0; lane < 4; ++lane) {
        int start = four->start[lane], count = equal ? most : four->count[lane];
        for (int i = 0; i < count; ++i) ranked[lane][rank[start + i]] = alpha[start + i];
        for (int i = count; i < most; ++i) ranked[lane][i] = 0;
    }
}

static void ranked_transmittance_stage(int pixels, const int32_t *offsets, const void *alpha_,
                                       const int32_t *rank, int32_t *order, void *T_,
                                       double *total) {
    const SCALAR *alpha = alpha_;
    SCALAR *T = T_;
#define OF_FOUR(four, most, equal) \
    do { \
        SCALAR ranked[4][COUNTS], seen[COUNTS][4]; \
        quad left = QUAD(1.0); \
        put_in_order(four, most, equal, alpha, rank, ranked); \
        for (int i = 0; i < (most); ++i) { \
            four_numbers a = {ranked[0][i], ranked[1][i], ranked[2][i], ranked[3][i]}; \
            four_numbers through = __builtin_convertvector(left, four_numbers); \
            memcpy(seen[i], &through, sizeof through); \
            left *= 1.0 - quad_from(a); \
        } \
        for (int lane = 0; lane < (four)->there; ++lane) { \
            int start = (four)->start[lane], count = (equal) ? (most) : (four)->count[lane]; \
            for (int i = 0; i < count; ++i) T[start + i] = seen[rank[start + i]][lane]; \
        } \
        put_of_four(four, total, left); \
    } while (0)
#define OF_ONE(p) total[p] = passed_in_order(p, offsets, alpha, rank, order, T)
    EACH_OF_EQUAL_COUNTS(pixels, offsets, OF_FOUR, OF_ONE);
#undef OF_FOUR
#undef OF_ONE
}

static void arrival_transmittance_stage(int pixels, const int32_t *offsets, const void *alpha_,
                                        void *T_, double *total) {
    const SCALAR *alpha = alpha_;
    SCALAR *T = T_;
#define OF_FOUR(four, most, equal) \
    do { \
        quad left = QUAD(1.0); \
        for (int i = ((most)-1) & ~3; i >= 0; i -= 4) { \
            four_numbers a[4], seen[4] = {{0}}; \
            rows_of_four(four, alpha, i, a); \
            for (int j = 3; j >= 0; --j) { \
                if (i + j >= (most)) continue; \
                seen[j] = __builtin_convertvector(left, four_numbers); \
                left *= 1.0 - quad_from(a[j]); \
            } \
            put_rows(four, T, i, seen); \
        } \
        put_of_four(four, total, left); \
    } while (0)
#define OF_ONE(p) total[p] = passed_in_arrival(p, offsets, alpha, T)
    EACH_OF_EQUAL_COUNTS(pixels, offsets, OF_FOUR, OF_ONE);
#undef OF_FOUR
#undef OF_ONE
}
