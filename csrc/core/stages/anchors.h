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

/* The pixel's greatest keys, the greatest first, and the extent of what covers anything. */
FN void anchors_kept(const int kept, const int cells, double shrink, int n, const SCALAR *alpha,
                     const SCALAR *word, const uint32_t *key, uint32_t *slot, SCALAR *numbers) {
    SCALAR nearest = 65535, farthest = 0;
    for (int k = 0; k < kept; ++k) slot[k] = 0;
    for (int i = 0; cells > 0 && i < n; ++i) { /* without cells nobody asks */
        bool covers = alpha[i] > 0;
        nearest = covers && word[i] < nearest ? word[i] : nearest;
        farthest = covers && word[i] > farthest ? word[i] : farthest;
    }
    for (int i = 0; i < n; ++i) { /* a key of what covers nothing is 0 */
        uint32_t added = key[i];
        if (added <= slot[kept - 1]) continue;
        for (int k = 0; k < kept; ++k) {
            uint32_t held = slot[k];
            slot[k] = added > held ? added : held;
            added = added > held ? held : added;
        }
    }
    numbers[0] = nearest < farthest ? nearest : farthest; /* none: 0 and 0 */
    numbers[1] = farthest;
    for (int k = 0; k < kept; k += LANES) {
        SCALAR lower[LANES] = {0}, absorbed[LANES];
        for (int lane = 0; lane < LANES && k + lane < kept; ++lane)
            lower[lane] = (SCALAR)(slot[k + lane] & 1023u);
        store(absorbed, anchor_absorbance(load(lower), K(shrink)));
        for (int lane = 0; lane < LANES && k + lane < kept; ++lane) {
            bool there = slot[k + lane] > 0;
            numbers[2 + k + lane] =
                there ? (SCALAR)(65535u - (slot[k + lane] >> 10 & 65535u)) : (SCALAR)ANCHOR_NOWHERE;
            numbers[2 + kept + k + lane] = there ? absorbed[lane] : 0;
        }
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
    for (int p = 0; p < pixels; ++p, numbers += 2 + 3 * kept + cells) {
        uint32_t slot[MOST_KEPT];
        int start = offsets[p], n = offsets[p + 1] - start;
        anchors_kept(kept, cells, shrink, n, alpha + start, word + start, key + start, slot,
                     numbers);
        if (cells > 0)
            anchors_counted(kept, cells, n, word + start, key + start, slot, own + start, numbers);
        else anchors_told(n, key + start, slot[kept - 1], own + start);
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

/* Of those that are kept as many are in front of a word as are nearer, so there are few sums: each
 * is added up by the order of keys. */
FN void anchors_in_front_of(const int kept, int pixels, const int32_t *offsets, const SCALAR *word,
                            const SCALAR *numbers, SCALAR *out) {
    for (int p = 0; p < pixels; ++p, numbers += MOIT_ANCHOR_NUMBERS(kept, 0)) {
        const SCALAR *at = numbers + 2, *absorbed = at + kept;
        double sums[MOST_KEPT + 1]; /* by how many are nearer; those of one word are so together */
        double sum[MOST_KEPT];
        int nearer_ones[MOST_KEPT];
        for (int j = 0; j < kept; ++j) {
            sum[j] = 0.0;
            nearer_ones[j] = 0;
        }
        for (int k = 0; k < kept; ++k) /* the sums side by side: none waits for another */
            for (int j = 0; j < kept; ++j) {
                bool is_nearer = at[k] <= at[j];
                sum[j] += is_nearer ? (double)absorbed[k] : 0.0;
                nearer_ones[j] += is_nearer;
            }
        sums[0] = 0.0;
        for (int j = 0; j < kept; ++j) sums[nearer_ones[j]] = sum[j];
        for (int i = offsets[p]; i < offsets[p + 1]; i += LANES) {
            real here = load(word + i), nearer = K(0.0);
            SCALAR place[LANES];
            for (int k = 0; k < kept; ++k) nearer += select(K(at[k]) < here, K(1.0), K(0.0));
            store(place, nearer);
            for (int lane = 0; lane < LANES && i + lane < offsets[p + 1]; ++lane)
                out[i + lane] = (SCALAR)((double)out[i + lane] + sums[(int)place[lane]]);
        }
    }
}

static void anchors_in_front_stage(int kept, int pixels, const int32_t *offsets, const void *word,
                                   const void *numbers, void *out) {
    if (kept == 5) anchors_in_front_of(5, pixels, offsets, word, numbers, out);
    else anchors_in_front_of(kept, pixels, offsets, word, numbers, out);
}
