/* Stages of slices: places and codes of fragments, and what is read, with lanes over the fragments
 * of a tile, whatever their pixels. Sums are the technique's own, of whole numbers. */

#include "kernels/slices.h"

static void slice_codes_stage(int cells, double scale, double most, int n, const void *z_,
                              const void *absorbance_, const uint32_t *row, const uint32_t *column,
                              void *cell_, void *inside_, void *code_) {
    const SCALAR *z = z_, *absorbance = absorbance_;
    SCALAR *cell = cell_, *inside = inside_, *code = code_;
    for (int i = 0; i < n; i += LANES) {
        slice_place place = slice_place_of(load_at_most(z + i, n - i), K(cells));
        store(cell + i, place.cell);
        store(inside + i, place.inside);
        if (!code) continue;
        uint rows, columns;
        memcpy(&rows, row + i, sizeof rows);
        memcpy(&columns, column + i, sizeof columns);
        real threshold = slice_threshold(rows, columns, place.cell);
        store(code + i,
              slice_code(load_at_most(absorbance + i, n - i), K(scale), K(most), threshold));
    }
}

static void slice_shares_stage(int n, const void *from_, const void *share_, const void *code_,
                               const void *inside_, void *joined_, void *near_, void *far_) {
    const SCALAR *from = from_, *share = share_, *code = code_, *inside = inside_;
    SCALAR *out = joined_, *near = near_, *far = far_;
    for (int i = 0; i < n; i += LANES) {
        real joined = slice_joined(load(inside + i), load_at_most(from + i, n - i),
                                   load_at_most(share + i, n - i));
        store(out + i, joined);
        if (!near) continue;
        real all = load(code + i), first = slice_near(all, joined);
        store(near + i, first);
        store(far + i, all - first);
    }
}

static void slice_depths_stage(int n, const void *before_, const void *at_, const void *behind_,
                               const void *inside_, void *twice_) {
    const SCALAR *before = before_, *at = at_, *behind = behind_, *inside = inside_;
    SCALAR *twice = twice_;
    for (int i = 0; i < n; i += LANES)
        store(twice + i, slice_depth(load_at_most(before + i, n - i), load_at_most(at + i, n - i),
                                     load_at_most(behind + i, n - i), load(inside + i)));
}

static void slice_absorbance_stage(int n, const void *twice_, const void *near_, const void *code_,
                                   const void *inside_, double half_step, bool absorbed, void *T_) {
    const SCALAR *twice = twice_, *near = near_, *code = code_, *inside = inside_;
    SCALAR *T = T_;
    for (int i = 0; i < n; i += LANES) {
        real own = K(0.0);
        if (code) own = slice_own(load(near + i), load(code + i), load(inside + i));
        real x = slice_absorbance(load(twice + i), own, K(half_step));
        store(T + i, absorbed ? x : exponential(-x));
    }
}

static void block_absorbance_stage(int n, const void *twice_, const void *low_, const void *total_,
                                   const void *own_, double half_step, bool absorbed, void *T_) {
    const SCALAR *twice = twice_, *low = low_, *total = total_, *own = own_;
    SCALAR *T = T_;
    for (int i = 0; i < n; i += LANES) {
        real x = block_absorbance(load_at_most(twice + i, n - i), K(half_step),
                                  load_at_most(low + i, n - i), load_at_most(total + i, n - i),
                                  own ? load_at_most(own + i, n - i) : K(0.0));
        store(T + i, absorbed ? x : exponential(-x));
    }
}

/* Sums of a block's share of what is read of it. */
static void slice_blend_stage(int n, const void *weight_, const void *twice_, void *sum_) {
    const SCALAR *weight = weight_, *twice = twice_;
    SCALAR *sum = sum_;
    for (int i = 0; i < n; i += LANES)
        store(sum + i,
              load(sum + i) + load_at_most(weight + i, n - i) * load_at_most(twice + i, n - i));
}

static void fine_codes_stage(int n, const void *absorbance_, void *out_) {
    const SCALAR *absorbance = absorbance_;
    SCALAR *out = out_;
    for (int i = 0; i < n; i += LANES)
        store(out + i, fine_code(load_at_most(absorbance + i, n - i)));
}

/* ---- Pixel by pixel -------------------------------------------------------------------------- */

static void slice_join_stage(int pixels, const int32_t *offsets,
                             const moit_slice_entry *const *table, const void *cell_, int32_t *slot,
                             void *from_, void *share_) {
    const SCALAR *cell = cell_;
    SCALAR *from = from_, *share = share_;
    for (int p = 0; p < pixels; ++p)
        for (int i = offsets[p]; i < offsets[p + 1]; ++i) {
            moit_slice_entry e = table[p][(int)cell[i]];
            slot[i] = e.slot;
            from[i] = (SCALAR)e.from;
            share[i] = (SCALAR)e.share;
        }
}

/* From the sums before slices; between cells with anything all are that before the next. */
FN void fetch_sums(const uint32_t *sums, int32_t slot, SCALAR *before, SCALAR *at, SCALAR *behind) {
    const uint32_t *from = sums + slot / 2;
    int any = slot & 1;
    *before = (SCALAR)from[0];
    *at = (SCALAR)from[any];
    *behind = (SCALAR)from[2 * any];
}

static void slice_fetch_stage(int pixels, const int32_t *offsets, const uint32_t *const *sums,
                              const int32_t *slot, void *before_, void *at_, void *behind_) {
    SCALAR *before = before_, *at = at_, *behind = behind_;
    for (int p = 0; p < pixels; ++p)
        for (int i = offsets[p]; i < offsets[p + 1]; ++i)
            fetch_sums(sums[p], slot[i], before + i, at + i, behind + i);
}

enum { CODES_AT_ONCE = 128, MOST_SUMS = 256 + 3 + MOIT_PADDING, MOST_MARKED_CELLS = 8192 };

/* What one pixel's fragments add: to slice k at k + 1. Gives the last that there is. */
FN int add_to_slices(int first, int end, const int32_t *slot, const SCALAR *near, const SCALAR *far,
                     uint32_t *sums) {
    int last = 0;
    for (int from = first; from < end; from += CODES_AT_ONCE) {
        int n = end - from < CODES_AT_ONCE ? end - from : CODES_AT_ONCE;
        int32_t here[CODES_AT_ONCE], next[CODES_AT_ONCE];
        for (int i = 0; i < n; i += LANES) {
            int_lanes of_near = __builtin_convertvector(load(near + from + i), int_lanes),
                      of_far = __builtin_convertvector(load(far + from + i), int_lanes);
            memcpy(here + i, &of_near, sizeof of_near);
            memcpy(next + i, &of_far, sizeof of_far);
        }
        for (int i = 0; i < n; ++i) {
            int k = slot[from + i] / 2 + 1;
            sums[k] += (uint32_t)here[i];
            sums[k + 1] += (uint32_t)next[i];
            last = k > last ? k : last;
        }
    }
    return last + 1;
}

/* Too much for a slice is so in any order. */
FN uint_lanes held_in_slices(uint_lanes sums, uint32_t most) {
    uint_lanes fits = (uint_lanes)(sums < most);
    return (fits & sums) | (~fits & U(most));
}

/* Of each lane the sum of itself and of those before it. */
FN uint_lanes running_sums(uint_lanes x) {
#if defined(__GNUC__) && !defined(__clang__)
#define ADD_BEFORE(by) \
    if (LANES > by) { \
        int_lanes from = {0}; \
        for (int l = 0; l < LANES; ++l) from[l] = l < by ? LANES : l - by; \
        x += __builtin_shuffle(x, U(0u), from); \
    }
    ADD_BEFORE(1)
    ADD_BEFORE(2)
    ADD_BEFORE(4)
    ADD_BEFORE(8)
#undef ADD_BEFORE
#else
    for (int l = 1; l < LANES; ++l) x[l] += x[l - 1];
#endif
    return x;
}

/* One pixel's, before each slice: that before slice k at k; gives the last place. Slices hold codes
 * of 65536 fragments before they have to be looked at. */
FN int sums_before_slices(int slots, uint32_t most, int first, int end, const int32_t *slot,
                          const SCALAR *near, const SCALAR *far, uint32_t *sums) {
    int last = 0;
    for (int i = 0; i < slots + 3; i += LANES) {
        uint_lanes none = U(0u);
        memcpy(sums + i, &none, sizeof none);
    }
    for (int from = first; from < end; from += 1 << 15) {
        int to = end - from < 1 << 15 ? end : from + (1 << 15);
        int of_part = add_to_slices(from, to, slot, near, far, sums);
        for (int k = 0; to < end && k < slots + 3; ++k) sums[k] = sums[k] < most ? sums[k] : most;
        last = of_part > last ? of_part : last;
    }
    return last;
}

/* Sums before slices, as numbers too. */
FN void add_up(uint32_t most, int last, uint32_t *sums, SCALAR *numbers) {
    uint32_t before = 0;
    for (int k = 0; k <= last; k += LANES) {
        uint_lanes here;
        memcpy(&here, sums + k, sizeof here);
        here = running_sums(held_in_slices(here, most)) + before;
        memcpy(sums + k, &here, sizeof here);
        store(numbers + k, __builtin_convertvector((int_lanes)here, real));
        before = here[LANES - 1];
    }
}

/* By itself, so that numbers may be anywhere: lanes would be filled one by one here. */
static __attribute__((noinline)) void fetch_numbers(int first, int end, const int32_t *slot,
                                                    const SCALAR *numbers, SCALAR *before,
                                                    SCALAR *at, SCALAR *behind) {
    for (int i = first; i < end; ++i) {
        int k = slot[i] / 2, any = slot[i] & 1;
        before[i] = numbers[k];
        at[i] = numbers[k + any];
        behind[i] = numbers[k + 2 * any];
    }
}

static void slice_sums_stage(int slots, uint32_t most, int pixels, const int32_t *offsets,
                             const int32_t *slot, const void *near, const void *far,
                             const int32_t *asked_offsets, const int32_t *asked_slot, bool all,
                             void *before_, void *at_, void *behind_, uint32_t *sums) {
    SCALAR *before = before_, *at = at_, *behind = behind_;
    SCALAR numbers[MOST_SUMS];
    for (int p = 0; p < pixels; ++p) {
        if (!all && offsets[p] == offsets[p + 1]) continue;
        int last =
            sums_before_slices(slots, most, offsets[p], offsets[p + 1], slot, near, far, sums);
        add_up(most, all ? slots + 2 : last, sums, numbers);
        fetch_numbers(asked_offsets[p], asked_offsets[p + 1], asked_slot, numbers, before, at,
                      behind);
    }
}

/* Several threads may mark at once. */
FN void mark(uint64_t *words, int word, uint64_t bits_of_it) {
    if (bits_of_it & ~__atomic_load_n(words + word, __ATOMIC_RELAXED))
        __atomic_fetch_or(words + word, bits_of_it, __ATOMIC_RELAXED);
}

/* A byte a cell, of 0 or 1, first: bytes that are written do not wait for one another. */
FN void mark_by_bytes(int cells, int first, int end, const SCALAR *alpha, const SCALAR *cell,
                      uint64_t *words) {
    uint8_t seen[MOST_MARKED_CELLS + 1]; /* what covers nothing has a byte of its own */
    memset(seen, 0, (size_t)cells);
    for (int i = first; i < end; ++i) seen[alpha[i] > (SCALAR)0.0 ? (int)cell[i] : cells] = 1;
    for (int word = 0; word < cells / 64; ++word) {
        uint64_t found = 0;
        for (int k = 0; k < 8; ++k) { /* eight bytes become eight bits */
            uint64_t bytes;
            memcpy(&bytes, seen + 64 * word + 8 * k, sizeof bytes);
            found |= (bytes * (uint64_t)0x0102040810204080 >> 56) << 8 * k;
        }
        if (found) mark(words, word, found);
    }
}

static void slice_marks_stage(int cells, int first, int end, const void *alpha_, const void *cell_,
                              uint64_t *words) {
    const SCALAR *alpha = alpha_, *cell = cell_;
    if (end - first >= cells / 4 && cells <= MOST_MARKED_CELLS) {
        mark_by_bytes(cells, first, end, alpha, cell, words);
        return;
    }
    for (int i = first; i < end; ++i)
        if (alpha[i] > (SCALAR)0.0)
            mark(words, (int)cell[i] / 64, (uint64_t)1 << (int)cell[i] % 64);
}

/* ---- As published ---------------------------------------------------------------------------- */

static void voxel_codes_stage(int n, const void *absorbance_, const void *joined_, double scale,
                              double most, void *near_, void *far_) {
    const SCALAR *absorbance = absorbance_, *joined = joined_;
    SCALAR *near = near_, *far = far_;
    for (int i = 0; i < n; i += LANES) {
        real tau = load_at_most(absorbance + i, n - i), inside = load(joined + i);
        store(near + i, voxel_code(tau * (1.0 - inside), K(scale), K(most)));
        store(far + i, voxel_code(tau * inside, K(scale), K(most)));
    }
}

static void voxel_places_stage(int n, const void *z_, double shift, void *out_) {
    const SCALAR *z = z_;
    SCALAR *out = out_;
    for (int i = 0; i < n; i += LANES) store(out + i, load_at_most(z + i, n - i) - K(shift));
}

static void voxel_light_stage(int n, const void *z_, const void *first_, const void *second_,
                              const void *joined_, void *T_) {
    const SCALAR *z = z_, *first = first_, *second = second_, *joined = joined_;
    SCALAR *T = T_;
    for (int i = 0; i < n; i += LANES)
        store(T + i, voxel_light(load(z + i), load_at_most(first + i, n - i),
                                 load_at_most(second + i, n - i), load(joined + i)));
}

static void voxel_cubic_light_stage(int n, const void *z_, const void *before_, const void *first_,
                                    const void *second_, const void *behind_, const void *joined_,
                                    void *T_) {
    const SCALAR *z = z_, *before = before_, *first = first_, *second = second_, *behind = behind_,
                 *joined = joined_;
    SCALAR *T = T_;
    for (int i = 0; i < n; i += LANES)
        store(T + i,
              voxel_cubic_light(load(z + i), load_at_most(before + i, n - i),
                                load_at_most(first + i, n - i), load_at_most(second + i, n - i),
                                load_at_most(behind + i, n - i), load(joined + i)));
}
