/* Stages of anchors (kernels/anchors.h): keys of fragments, what pixels keep, what is absorbed in
 * front. Lanes are fragments, those of one pixel where they need what it keeps. */

#include "kernels/anchors.h"

/* Keys of 32 bits, or of 64, which tell depths within a word apart. */
FN uint64_t key_at(const bool large, const void *keys, int i) {
    return large ? ((const uint64_t *)keys)[i] : ((const uint32_t *)keys)[i];
}

FN void anchor_keys_of(const bool large, double gamma, int n, const SCALAR *alpha, SCALAR *z,
                       void *keys) {
    for (int i = 0; i < n; i += LANES) {
        real u = load(z + i), word = large ? fine_word(u) : unorm16_word(u);
        anchor_key k = anchor_key_of(load_at_most(alpha + i, n - i), u, word, K(gamma));
        real fine = anchor_fine(k, word);
        store(z + i, word);
        for (int lane = 0; lane < LANES; ++lane) {
            uint32_t upper = (uint32_t)k.upper[lane], lower = (uint32_t)k.lower[lane];
            if (large)
                ((uint64_t *)keys)[i + lane] =
                    (uint64_t)upper << 18 | (uint64_t)(uint32_t)fine[lane] << 10 | lower;
            else ((uint32_t *)keys)[i + lane] = upper << 10 | lower;
        }
    }
}

static void anchor_keys_stage(bool large, double gamma, int n, const void *alpha, void *z,
                              void *keys) {
    if (large) anchor_keys_of(true, gamma, n, alpha, z, keys);
    else anchor_keys_of(false, gamma, n, alpha, z, keys);
}

static void fine_words_stage(int n, void *z_) {
    SCALAR *z = z_;
    for (int i = 0; i < n; i += LANES) store(z + i, fine_word(load(z + i)));
}

FN SCALAR word_of_key(const bool large, uint64_t key) {
    if (!key) return (SCALAR)ANCHOR_NOWHERE;
    if (!large) return (SCALAR)(65535u - (key >> 10 & 65535u));
    return (SCALAR)(65535u - (key >> 18 & 65535u)) + (SCALAR)(255u - (key >> 10 & 255u)) / 256;
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

/* The greatest keys of pixels, the greatest first: slot[kept lane + k] of the lane's k-th. */
FN void greatest_keys(const int kept, const pixel_columns *c, const uint32_t *key, uint64_t *slot) {
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
    for (int k = 0; k < kept; ++k)
        for (int lane = 0; lane < LANES; ++lane) slot[kept * lane + k] = held[k][lane];
}

FN void greatest_large_keys(const int kept, const pixel_columns *c, const uint64_t *key,
                            uint64_t *slots) {
    for (int lane = 0; lane < LANES; ++lane) {
        uint64_t *slot = slots + kept * lane;
        for (int k = 0; k < kept; ++k) slot[k] = 0;
        for (int i = c->start[lane]; i < c->start[lane] + c->count[lane]; ++i) {
            uint64_t added = key[i];
            for (int k = 0; k < kept && added > slot[kept - 1]; ++k) {
                uint64_t held = slot[k];
                slot[k] = added > held ? added : held;
                added = added > held ? held : added;
            }
        }
    }
}

/* The absorbances that keys stand for. */
FN void absorbances_of_keys(const int kept, double shrink, const uint64_t *slot, SCALAR *absorbed) {
    for (int k = 0; k < kept * LANES; k += LANES) {
        SCALAR lower[LANES];
        for (int lane = 0; lane < LANES; ++lane) lower[lane] = (SCALAR)(slot[k + lane] & 1023u);
        store(absorbed + k, anchor_absorbance(load(lower), K(shrink)));
    }
}

/* What a pixel keeps by its greatest keys, and the extent of what covers anything. */
FN void anchors_kept(const bool large, const int kept, const int cells, int n, const SCALAR *alpha,
                     const SCALAR *word, const uint64_t *slot, const SCALAR *absorbed,
                     SCALAR *numbers) {
    SCALAR nearest = 65535, farthest = 0;
    for (int i = 0; cells > 0 && i < n; ++i) { /* without cells nobody asks */
        bool covers = alpha[i] > 0;
        nearest = covers && word[i] < nearest ? word[i] : nearest;
        farthest = covers && word[i] > farthest ? word[i] : farthest;
    }
    nearest = nearest < farthest ? nearest : farthest; /* none: 0 and 0 */
    numbers[0] = (SCALAR)(int)nearest;                 /* in whole words */
    numbers[1] = (SCALAR)(int)farthest;
    for (int k = 0; k < kept; ++k) {
        numbers[2 + k] = word_of_key(large, slot[k]);
        numbers[2 + kept + k] = slot[k] ? absorbed[k] : 0;
    }
}

/* Sums of all others. Where several fragments have the least key that is kept, there may not have
 * been a place for each: all are counted in their cell, and those that have one taken out again. */
FN void anchors_counted(const bool large, const int kept, const int cells, int start, int n,
                        const SCALAR *word, const void *keys, const uint64_t *slot, SCALAR *own,
                        SCALAR *numbers) {
    const anchors a = anchors_of(kept, cells, numbers);
    const uint64_t least = slot[kept - 1];
    const SCALAR of_least = numbers[2 + 2 * kept - 1];
    int sum[MOST_KEPT + MOST_CELLS] = {0}, full = (int)ANCHOR_FULL, cell_of_last = 0, of_last = 0;
    SCALAR place[LANES], steps[LANES];
    for (int i = 0; i < n; i += LANES) {
        truth last = {0};
        for (int lane = 0; lane < LANES; ++lane)
            last[lane] =
                i + lane < n && least && key_at(large, keys, start + i + lane) == least ? -1 : 0;
        real at = load(word + i);
        store(place, anchor_cell(kept, cells, a, at));
        store(steps, anchor_steps(select(last, K(of_least), load(own + i)), at));
        for (int lane = 0; lane < LANES && i + lane < n; ++lane) {
            uint64_t key = key_at(large, keys, start + i + lane);
            bool is_kept = key && key >= least;
            if (last[lane]) { /* all such add the same, in the same cell */
                cell_of_last = (int)place[lane];
                of_last = (int)steps[lane];
            }
            int *to = sum + (int)place[lane];
            if ((!is_kept || key == least) && *to < full) *to += (int)steps[lane];
            own[i + lane] = is_kept ? (SCALAR)-1 : own[i + lane];
        }
    }
    int taken = 0;
    for (int k = 0; k < kept; ++k) taken += slot[k] == least ? of_last : 0;
    for (int c = 0; c < kept + cells; ++c) { /* how far beyond full hangs on the order */
        int left = sum[c] - (c == cell_of_last ? taken : 0);
        numbers[2 + 2 * kept + c] = (SCALAR)(sum[c] < full ? left : full);
    }
}

/* Without cells: what is kept is told apart, no more. */
FN void anchors_told(const bool large, int start, int n, const void *keys, uint64_t least,
                     SCALAR *own) {
    const uint32_t *small = (const uint32_t *)keys + start;
    for (int i = 0; !large && i < n; ++i)
        own[i] = small[i] && small[i] >= (uint32_t)least ? (SCALAR)-1 : own[i];
    const uint64_t *wide = (const uint64_t *)keys + start;
    for (int i = 0; large && i < n; ++i) own[i] = wide[i] && wide[i] >= least ? (SCALAR)-1 : own[i];
}

FN void anchors_stage_of(const bool large, const int kept, const int cells, double shrink,
                         int pixels, const int32_t *offsets, const SCALAR *alpha,
                         const SCALAR *word, const void *keys, SCALAR *own, SCALAR *numbers) {
    int order[COLUMN_PIXELS];
    for (int first = 0; first < pixels; first += COLUMN_PIXELS) {
        int left = pixels_by_count(first, pixels, offsets, order);
        for (int p = 0; p < left; p += LANES) {
            uint64_t slots[LANES * MOST_KEPT];
            SCALAR absorbed[LANES * MOST_KEPT];
            pixel_columns c = columns_from(left - p, order + p, offsets);
            if (large) greatest_large_keys(kept, &c, keys, slots);
            else greatest_keys(kept, &c, keys, slots);
            absorbances_of_keys(kept, shrink, slots, absorbed);
            for (int lane = 0; lane < LANES && p + lane < left; ++lane) {
                const uint64_t *slot = slots + kept * lane;
                int start = c.start[lane], n = c.count[lane];
                SCALAR *to = numbers + (int64_t)c.pixel[lane] * (2 + 3 * kept + cells);
                anchors_kept(large, kept, cells, n, alpha + start, word + start, slot,
                             absorbed + kept * lane, to);
                if (cells > 0)
                    anchors_counted(large, kept, cells, start, n, word + start, keys, slot,
                                    own + start, to);
                else anchors_told(large, start, n, keys, slot[kept - 1], own + start);
            }
        }
    }
}

/* The same of each lane's own pixel: numbers of pixels lie in rows. */
FN anchors anchors_of_rows(const int kept, const int cells, const SCALAR (*row)[BLOCK_ROW], int ray,
                           truth lane) {
    anchors a;
    a.nearest = lanes_of_row(row[0] + ray, lane);
    a.farthest = lanes_of_row(row[1] + ray, lane);
    for (int k = 0; k < kept; ++k) a.word[k] = lanes_of_row(row[2 + k] + ray, lane);
    for (int k = 0; k < kept; ++k) a.absorbed[k] = lanes_of_row(row[2 + kept + k] + ray, lane);
    for (int c = 0; c < kept + cells; ++c)
        a.cell[c] = lanes_of_row(row[2 + 2 * kept + c] + ray, lane);
    return a;
}

/* Of pixels with few fragments each, which share vectors. */
FN void anchor_absorbed_in_blocks(const int kept, const int cells, int pixels,
                                  const int32_t *offsets, const SCALAR *word, const SCALAR *own,
                                  const SCALAR *numbers, SCALAR *out) {
    enum { MOST = MOIT_ANCHOR_NUMBERS(MOST_KEPT, MOST_CELLS) };
    ray_block block;
    SCALAR row[MOST][BLOCK_ROW];
    const int each = MOIT_ANCHOR_NUMBERS(kept, cells);
    memset(row, 0, sizeof row);
    for (int p = 0; p < pixels;) {
        p = next_block(&block, p, pixels, offsets);
        for (int r = 0; r < block.rays; ++r)
            for (int k = 0; k < each; ++k) row[k][r] = numbers[(int64_t)block.pixel[r] * each + k];
        for (int i = block.first; i < block.end; i += LANES) {
            truth lane;
            int ray = first_ray(&block, i, &lane);
            anchors a = anchors_of_rows(kept, cells, row, ray, lane);
            real x = anchor_absorbed(kept, cells, a, load(word + i), own ? load(own + i) : K(0.0));
            store(out + i, exponential(-x));
        }
    }
}

FN void anchor_absorbed_of(const int kept, const int cells, int pixels, const int32_t *offsets,
                           const SCALAR *word, const SCALAR *own, const SCALAR *numbers,
                           SCALAR *out) {
    if (offsets[pixels] - offsets[0] < LANES * pixels) {
        anchor_absorbed_in_blocks(kept, cells, pixels, offsets, word, own, numbers, out);
        return;
    }
    for (int p = 0; p < pixels; ++p, numbers += 2 + 3 * kept + cells) {
        const anchors a = anchors_of(kept, cells, numbers);
        for (int i = offsets[p]; i < offsets[p + 1]; i += LANES)
            store(out + i, exponential(-anchor_absorbed(kept, cells, a, load(word + i),
                                                        own ? load(own + i) : K(0.0))));
    }
}

/* Constants let the compiler lay loops of the usual counts out; all others share one text. */
#define BY_COUNTS(small, call) \
    if ((small) && kept == 4 && cells == 11) call(true, 4, 11); \
    else if ((small) && kept == 5 && cells == 0) call(true, 5, 0); \
    else call(false, kept, cells)

static void anchors_stage(bool large, int kept, int cells, double shrink, int pixels,
                          const int32_t *offsets, const void *alpha, const void *word,
                          const void *keys, void *own, void *numbers) {
#define KEEP(usual, k, c) \
    anchors_stage_of(!(usual) && large, k, c, shrink, pixels, offsets, alpha, word, keys, own, \
                     numbers)
    BY_COUNTS(!large, KEEP);
#undef KEEP
}

static void anchor_transmittance_stage(int kept, int cells, int pixels, const int32_t *offsets,
                                       const void *word, const void *own, const void *numbers,
                                       void *T) {
#define TRANSMITTANCE(usual, k, c) anchor_absorbed_of(k, c, pixels, offsets, word, own, numbers, T)
    BY_COUNTS(true, TRANSMITTANCE);
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
