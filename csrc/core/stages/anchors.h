/* Stages of anchors (kernels/anchors.h): keys of fragments, what pixels keep, what is absorbed in
 * front. Lanes are fragments, those of one pixel where they need what it keeps. */

#include "kernels/anchors.h"

static void anchor_keys_stage(double gamma, int n, const void *alpha_, void *z_, uint32_t *key) {
    const SCALAR *alpha = alpha_;
    SCALAR *z = z_;
    for (int i = 0; i < n; i += LANES) {
        real u = load(z + i), word = unorm16_word(u);
        anchor_key k = anchor_key_of(load_at_most(alpha + i, n - i), u, word, K(gamma));
        store(z + i, word);
        for (int lane = 0; lane < LANES; ++lane)
            key[i + lane] = (uint32_t)k.upper[lane] << 10 | (uint32_t)k.lower[lane];
    }
}

FN anchors anchors_of(int kept, int cells, const SCALAR *numbers) {
    anchors a;
    a.nearest = K(numbers[0]);
    a.farthest = K(numbers[1]);
    for (int k = 0; k < kept; ++k) a.word[k] = K(numbers[2 + k]);
    for (int k = 0; k < kept; ++k) a.absorbed[k] = K(numbers[2 + kept + k]);
    for (int c = 0; c < kept + cells; ++c) a.cell[c] = K(numbers[2 + 2 * kept + c]);
    return a;
}

/* The greatest keys of pixels, the greatest first: slot[kept lane + k] of the lane's k-th, and the
 * absorbances that they stand for. */
FN void greatest_keys(const int kept, double shrink, const pixel_columns *c, const uint32_t *key,
                      uint32_t *slot, SCALAR *absorbed) {
    uint_lanes held[MOST_KEPT];
    for (int k = 0; k < kept; ++k) held[k] = U(0u);
    for (int from = 0; from < c->most; from += LANES) {
        uint_lanes column[LANES];
        int_lanes counts = __builtin_convertvector(c->counts, int_lanes);
        key_columns(c, key, from, column);
        for (int i = 0; i < LANES && from + i < c->most; ++i) {
            uint_lanes added = column[i] & (uint_lanes)(counts > from + i);
            for (int k = 0; k < kept; ++k) {
                uint_lanes rises = (uint_lanes)(added > held[k]);
                uint_lanes greater = (rises & added) | (~rises & held[k]);
                added = (rises & held[k]) | (~rises & added);
                held[k] = greater;
            }
        }
    }
    for (int k = 0; k < kept; ++k) {
        uint_lanes lower = held[k] & U(1023u);
        real of_key = anchor_absorbance(__builtin_convertvector(lower, real), K(shrink));
        for (int lane = 0; lane < LANES; ++lane) {
            slot[kept * lane + k] = held[k][lane];
            absorbed[kept * lane + k] = of_key[lane];
        }
    }
}

/* What a pixel keeps by its greatest keys, and the extent of what covers anything. */
FN void anchors_kept(const int kept, const int cells, int n, const SCALAR *alpha,
                     const SCALAR *word, const uint32_t *slot, const SCALAR *absorbed,
                     SCALAR *numbers) {
    SCALAR nearest = 65535, farthest = 0;
    for (int i = 0; cells > 0 && i < n; ++i) { /* without cells nobody asks */
        bool covers = alpha[i] > 0;
        nearest = covers && word[i] < nearest ? word[i] : nearest;
        farthest = covers && word[i] > farthest ? word[i] : farthest;
    }
    numbers[0] = nearest < farthest ? nearest : farthest; /* none: 0 and 0 */
    numbers[1] = farthest;
    for (int k = 0; k < kept; ++k) {
        bool there = slot[k] > 0;
        numbers[2 + k] =
            there ? (SCALAR)(65535u - (slot[k] >> 10 & 65535u)) : (SCALAR)ANCHOR_NOWHERE;
        numbers[2 + kept + k] = there ? absorbed[k] : 0;
    }
}

/* Sums of all others. Where several fragments have the least key that is kept, there may not have
 * been a place for each: all are counted in their cell, and those that have one taken out again. */
FN void anchors_counted(const int kept, const int cells, int n, const SCALAR *word,
                        const uint32_t *key, const uint32_t *slot, SCALAR *own, SCALAR *numbers) {
    const anchors a = anchors_of(kept, cells, numbers);
    const uint32_t least = slot[kept - 1];
    const SCALAR of_least = numbers[2 + 2 * kept - 1];
    int sum[MOST_KEPT + MOST_CELLS] = {0}, full = (int)ANCHOR_FULL;
    SCALAR place[LANES], steps[LANES];
    for (int i = 0; i < n; i += LANES) {
        truth last = {0};
        for (int lane = 0; lane < LANES; ++lane)
            last[lane] = i + lane < n && least && key[i + lane] == least ? -1 : 0;
        real at = load(word + i);
        store(place, anchor_cell(kept, cells, a, at));
        store(steps, anchor_steps(select(last, K(of_least), load(own + i)), at));
        for (int lane = 0; lane < LANES && i + lane < n; ++lane) {
            bool is_kept = key[i + lane] && key[i + lane] >= least;
            int *to = sum + (int)place[lane];
            if ((!is_kept || key[i + lane] == least) && *to < full) *to += (int)steps[lane];
            own[i + lane] = is_kept ? (SCALAR)-1 : own[i + lane];
        }
    }
    real of_last = K(numbers[2 + kept - 1]);
    store(place, anchor_cell(kept, cells, a, of_last));
    store(steps, anchor_steps(K(of_least), of_last));
    for (int c = 0; c < kept + cells; ++c) { /* how far beyond full hangs on the order */
        int taken = 0;
        for (int k = 0; least && k < kept; ++k)
            if (slot[k] == least && (int)place[0] == c) taken += (int)steps[0];
        numbers[2 + 2 * kept + c] = (SCALAR)(sum[c] < full ? sum[c] - taken : full);
    }
}

/* Without cells: what is kept is told apart, no more. */
FN void anchors_told(int n, const uint32_t *key, uint32_t least, SCALAR *own) {
    for (int i = 0; i < n; ++i) own[i] = key[i] && key[i] >= least ? (SCALAR)-1 : own[i];
}

FN void anchors_stage_of(const int kept, const int cells, double shrink, int pixels,
                         const int32_t *offsets, const SCALAR *alpha, const SCALAR *word,
                         const uint32_t *key, SCALAR *own, SCALAR *numbers) {
    int order[COLUMN_PIXELS];
    for (int first = 0; first < pixels; first += COLUMN_PIXELS) {
        int left = pixels_by_count(first, pixels, offsets, order);
        for (int p = 0; p < left; p += LANES) {
            uint32_t slots[LANES * MOST_KEPT];
            SCALAR absorbed[LANES * MOST_KEPT];
            pixel_columns c = columns_from(left - p, order + p, offsets);
            greatest_keys(kept, shrink, &c, key, slots, absorbed);
            for (int lane = 0; lane < LANES && p + lane < left; ++lane) {
                const uint32_t *slot = slots + kept * lane;
                int start = c.start[lane], n = c.count[lane];
                SCALAR *to = numbers + (int64_t)c.pixel[lane] * (2 + 3 * kept + cells);
                anchors_kept(kept, cells, n, alpha + start, word + start, slot,
                             absorbed + kept * lane, to);
                if (cells > 0)
                    anchors_counted(kept, cells, n, word + start, key + start, slot, own + start,
                                    to);
                else anchors_told(n, key + start, slot[kept - 1], own + start);
            }
        }
    }
}

FN void anchor_absorbed_of(const int kept, const int cells, int pixels, const int32_t *offsets,
                           const SCALAR *word, const SCALAR *own, const SCALAR *numbers,
                           SCALAR *out) {
    for (int p = 0; p < pixels; ++p, numbers += 2 + 3 * kept + cells) {
        const anchors a = anchors_of(kept, cells, numbers);
        for (int i = offsets[p]; i < offsets[p + 1]; i += LANES)
            store(out + i, exponential(-anchor_absorbed(kept, cells, a, load(word + i),
                                                        own ? load(own + i) : K(0.0))));
    }
}

/* Constants let the compiler lay loops of the usual counts out. */
#define BY_COUNTS(call) \
    if (kept == 4 && cells == 11) call(4, 11); \
    else if (kept == 5 && cells == 0) call(5, 0); \
    else call(kept, cells)

static void anchors_stage(int kept, int cells, double shrink, int pixels, const int32_t *offsets,
                          const void *alpha, const void *word, const uint32_t *key, void *own,
                          void *numbers) {
#define KEEP(k, c) anchors_stage_of(k, c, shrink, pixels, offsets, alpha, word, key, own, numbers)
    BY_COUNTS(KEEP);
#undef KEEP
}

static void anchor_transmittance_stage(int kept, int cells, int pixels, const int32_t *offsets,
                                       const void *word, const void *own, const void *numbers,
                                       void *T) {
#define TRANSMITTANCE(k, c) anchor_absorbed_of(k, c, pixels, offsets, word, own, numbers, T)
    BY_COUNTS(TRANSMITTANCE);
#undef TRANSMITTANCE
}
#undef BY_COUNTS

/* As many doubles as a `real` has lanes. */
typedef double wide __attribute__((vector_size(8 * LANES)));
typedef int64_t wide_truth __attribute__((vector_size(8 * LANES)));

FN wide wide_where(wide_truth t, wide a, wide b) {
    return (wide)((t & (wide_truth)a) | (~t & (wide_truth)b));
}

/* Of up to LANES pixels the words that are kept and, in doubles, what is absorbed in front of a
 * place by how many of them are nearer. Of those that are kept as many are in front of a word as
 * are nearer, so there are few sums: each is added up by the order of keys. */
FN void sums_in_front(const int kept, int n, const SCALAR *numbers, SCALAR (*at)[LANES],
                      double (*sums)[LANES]) {
    SCALAR absorbed[MOST_KEPT][LANES];
    for (int lane = 0; lane < LANES; ++lane) {
        const SCALAR *own = numbers + (lane < n ? lane : 0) * MOIT_ANCHOR_NUMBERS(kept, 0) + 2;
        for (int k = 0; k < kept; ++k) at[k][lane] = own[k];
        for (int k = 0; k < kept; ++k) absorbed[k][lane] = own[kept + k];
    }
    for (int k = 0; k <= kept; ++k) memset(sums[k], 0, sizeof sums[k]);
    for (int j = 0; j < kept; ++j) {
        wide sum = {0};
        real nearer_ones = K(0.0); /* those of one word are so together */
        for (int k = 0; k < kept; ++k) {
            truth is_nearer = load(at[k]) <= load(at[j]);
            wide own = __builtin_convertvector(load(absorbed[k]), wide);
            sum += wide_where(__builtin_convertvector(is_nearer, wide_truth), own, (wide){0});
            nearer_ones += select(is_nearer, K(1.0), K(0.0));
        }
        for (int k = 1; k <= kept; ++k) {
            wide held;
            wide_truth here = __builtin_convertvector(nearer_ones == (SCALAR)k, wide_truth);
            memcpy(&held, sums[k], sizeof held);
            held = wide_where(here, sum, held);
            memcpy(sums[k], &held, sizeof held);
        }
    }
}

FN void anchors_in_front_of(const int kept, int pixels, const int32_t *offsets, const SCALAR *word,
                            const SCALAR *numbers, SCALAR *out) {
    for (int first = 0; first < pixels; first += LANES) {
        int n = pixels - first < LANES ? pixels - first : LANES;
        SCALAR at[MOST_KEPT][LANES];
        double sums[MOST_KEPT + 1][LANES];
        sums_in_front(kept, n, numbers + (int64_t)first * MOIT_ANCHOR_NUMBERS(kept, 0), at, sums);
        for (int pixel = 0; pixel < n; ++pixel) {
            int end = offsets[first + pixel + 1];
            for (int i = offsets[first + pixel]; i < end; i += LANES) {
                real here = load(word + i), nearer = K(0.0);
                SCALAR place[LANES];
                for (int k = 0; k < kept; ++k)
                    nearer += select(K(at[k][pixel]) < here, K(1.0), K(0.0));
                store(place, nearer);
                for (int lane = 0; lane < LANES && i + lane < end; ++lane)
                    out[i + lane] = (SCALAR)((double)out[i + lane] + sums[(int)place[lane]][pixel]);
            }
        }
    }
}

static void anchors_in_front_stage(int kept, int pixels, const int32_t *offsets, const void *word,
                                   const void *numbers, void *out) {
    if (kept == 5) anchors_in_front_of(5, pixels, offsets, word, numbers, out);
    else anchors_in_front_of(kept, pixels, offsets, word, numbers, out);
}
