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

/* One pixel's: that of slice k at k + 1. Gives the last that there is. */
FN int pixel_slices(uint32_t most, int first, int end, const int32_t *slot, const SCALAR *near,
                    const SCALAR *far, uint32_t *sums) {
    int last = 0;
    for (int i = first; i < end; ++i) {
        int k = slot[i] / 2 + 1;
        /* too much for a slice is so in any order */
        uint32_t here = sums[k] + (uint32_t)near[i], next = sums[k + 1] + (uint32_t)far[i];
        sums[k] = here < most ? here : most;
        sums[k + 1] = next < most ? next : most;
        last = k > last ? k : last;
    }
    return last + 1;
}

static void slice_sums_stage(int slots, uint32_t most, int pixels, const int32_t *offsets,
                             const int32_t *slot, const void *near, const void *far,
                             const int32_t *asked_offsets, const int32_t *asked_slot, bool all,
                             void *before_, void *at_, void *behind_, uint32_t *sums) {
    SCALAR *before = before_, *at = at_, *behind = behind_;
    for (int p = 0; p < pixels; ++p) {
        if (!all && offsets[p] == offsets[p + 1]) continue;
        memset(sums, 0, (size_t)(slots + 3) * sizeof *sums);
        int last = pixel_slices(most, offsets[p], offsets[p + 1], slot, near, far, sums);
        if (all) last = slots + 2;
        uint32_t sum = 0;
        for (int k = 1; k <= last; ++k) {
            sum += sums[k];
            sums[k] = sum;
        }
        for (int i = asked_offsets[p]; i < asked_offsets[p + 1]; ++i)
            fetch_sums(sums, asked_slot[i], before + i, at + i, behind + i);
    }
}

/* Several threads may mark at once. */
static void slice_marks_stage(int first, int end, const void *alpha_, const void *cell_,
                              uint64_t *words) {
    const SCALAR *alpha = alpha_, *cell = cell_;
    for (int i = first; i < end; ++i) {
        int at = (int)cell[i];
        uint64_t bit = (uint64_t)1 << at % 64;
        if (alpha[i] > (SCALAR)0.0 && !(__atomic_load_n(words + at / 64, __ATOMIC_RELAXED) & bit))
            __atomic_fetch_or(words + at / 64, bit, __ATOMIC_RELAXED);
    }
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
