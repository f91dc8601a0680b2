/* Stages of slices that a network reads (kernels/slice_network.h): lanes are fragments of a tile,
 * whatever their pixels, but where sums of a pixel are made. Behind neural.h, slices.h and
 * half_moments.h. */

#include "kernels/slice_network.h"

static void own_codes_stage(double scale, double most, int n, const void *z_,
                            const void *absorbance_, const uint32_t *row, const uint32_t *column,
                            void *code_) {
    const SCALAR *z = z_, *absorbance = absorbance_;
    SCALAR *code = code_;
    for (int i = 0; i < n; i += LANES) {
        uint rows, columns;
        memcpy(&rows, row + i, sizeof rows);
        memcpy(&columns, column + i, sizeof columns);
        real threshold = own_slice_threshold(rows, columns, load_at_most(z + i, n - i));
        store(code + i,
              slice_code(load_at_most(absorbance + i, n - i), K(scale), K(most), threshold));
    }
}

static void covered_extents_stage(int pixels, const int32_t *offsets, const void *z_,
                                  const void *alpha_, double *extents) {
    const SCALAR *z = z_, *alpha = alpha_;
    for (int p = 0; p < pixels; ++p) {
        int first = offsets[p];
        own_extent e = extent_of(offsets[p + 1] - first, z + first, alpha + first);
        extents[2 * p] = (double)e.nearest[0];
        extents[2 * p + 1] = (double)e.farthest[0];
    }
}

static void own_places_stage(int count, int pixels, const int32_t *offsets, const void *z_,
                             const double *extents, const void *code_, int32_t *slot, void *inside_,
                             void *near_, void *far_) {
    const SCALAR *z = z_, *code = code_;
    SCALAR *inside = inside_, *near = near_, *far = far_;
    for (int p = 0; p < pixels; ++p) {
        own_extent e = {K((SCALAR)extents[2 * p]), K((SCALAR)extents[2 * p + 1])};
        for (int i = offsets[p]; i < offsets[p + 1]; i += LANES) {
            slice_place place =
                own_slice_place(e, load_at_most(z + i, offsets[p + 1] - i), K(count - 1));
            int_lanes twice = __builtin_convertvector(place.cell, int_lanes) * 2;
            memcpy(slot + i, &twice, sizeof twice);
            store(inside + i, place.inside);
            if (!code) continue;
            real all = load(code + i), first = slice_near(all, place.inside);
            store(near + i, first);
            store(far + i, all - first);
        }
    }
}

/* numbers[1] is what is before the first slice, and numbers[0] what is farther in front. */
enum { AROUND = 6 };

static __attribute__((noinline)) void fetch_around(int first, int end, const int32_t *slot,
                                                   const SCALAR *numbers, SCALAR all,
                                                   int64_t stride, SCALAR *around) {
    for (int i = first; i < end; ++i) {
        const SCALAR *from = numbers + slot[i] / 2;
        for (int k = 0; k < AROUND - 1; ++k) around[k * stride + i] = from[k];
        around[(AROUND - 1) * stride + i] = all;
    }
}

static void sums_around_stage(int count, uint32_t most, int pixels, const int32_t *offsets,
                              const int32_t *slot, const void *near, const void *far,
                              const int32_t *asked_offsets, const int32_t *asked_slot,
                              int64_t stride, void *around, uint32_t *sums) {
    SCALAR numbers[1 + MOST_SUMS] = {0};
    for (int p = 0; p < pixels; ++p) {
        if (asked_offsets[p] == asked_offsets[p + 1]) continue;
        sums_before_slices(count, most, offsets[p], offsets[p + 1], slot, near, far, sums);
        add_up(most, count + 2, sums, numbers + 1);
        fetch_around(asked_offsets[p], asked_offsets[p + 1], asked_slot, numbers,
                     numbers[1 + count], stride, around);
    }
}

FN slice_outlook outlook_of(int i, int n, const SCALAR *around, int64_t stride,
                            const SCALAR *inside, const SCALAR *near, const SCALAR *code,
                            const SCALAR *absorbance, double quantum) {
    slice_sums s;
    s.outer = load_at_most(around + i, n - i);
    s.front = load_at_most(around + stride + i, n - i);
    s.middle = load_at_most(around + 2 * stride + i, n - i);
    s.back = load_at_most(around + 3 * stride + i, n - i);
    s.beyond = load_at_most(around + 4 * stride + i, n - i);
    s.all = load_at_most(around + 5 * stride + i, n - i);
    return slice_outlook_at(s, load(inside + i), code ? load(near + i) : K(0.0),
                            code ? load(code + i) : K(0.0),
                            code ? load_at_most(absorbance + i, n - i) : K(0.0), K(quantum));
}

static void learnt_absorbance_stage(int n, const void *around_, int64_t stride, const void *inside_,
                                    const void *near_, const void *code_, const void *absorbance_,
                                    double quantum, const float *network, bool absorbed, void *T_) {
    /* steps of a fragment wait for one another: in short loops a processor has several at once */
    enum { OUTLOOKS = 16 * LANES };
    const SCALAR *around = around_, *inside = inside_, *near = near_, *code = code_,
                 *absorbance = absorbance_;
    SCALAR *T = T_;
    for (int from = 0; from < n; from += OUTLOOKS) {
        SCALAR room[OUTLOOKS], seen[SLICE_INPUTS][OUTLOOKS];
        int to = n - from < OUTLOOKS ? n : from + OUTLOOKS;
        for (int i = from; i < to; i += LANES) {
            slice_outlook at =
                outlook_of(i, n, around, stride, inside, near, code, absorbance, quantum);
            store(T + i, at.least);
            store(room + (i - from), at.room);
            for (int k = 0; k < SLICE_INPUTS; ++k) store(seen[k] + (i - from), at.seen.x[k]);
        }
        for (int i = from; i < to; i += LANES) {
            values see;
            for (int k = 0; k < SLICE_INPUTS; ++k) see.x[k] = load(seen[k] + (i - from));
            real share = slice_share(network, see);
            real x = load(T + i) + share * load(room + (i - from));
            store(T + i, absorbed ? x : exponential(-x));
        }
    }
}

static void slice_features_stage(int n, const void *around, int64_t stride, const void *inside,
                                 const void *near, const void *code, const void *absorbance,
                                 double quantum, int64_t column, void *features_) {
    SCALAR *features = features_;
    for (int i = 0; i < n; i += LANES) {
        slice_outlook at =
            outlook_of(i, n, around, stride, inside, near, code, absorbance, quantum);
        for (int k = 0; k < SLICE_INPUTS; ++k)
            store_at_most(features + k * column + i, at.seen.x[k], n - i);
        store_at_most(features + SLICE_INPUTS * column + i, at.least, n - i);
        store_at_most(features + (SLICE_INPUTS + 1) * column + i, at.room, n - i);
    }
}
