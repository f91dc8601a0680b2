/* Orders of fragments: front to back within a pixel, and by pixel. */
#include "threads.h"

#include <stdlib.h>
#include <string.h>

enum {
    PIXELS_PER_ITEM = 1024,
    SHORT = 24, /* fragments up to which moving them one by one is fastest */
};

typedef struct {
    const moit_fragments *fragments;
    int64_t *order;
} ordering;

/* Both sorts are stable and stay within their arrays whatever the comparisons say, for NaN and
 * for depths that somebody changes meanwhile. merge_sort sorts runs of SHORT first and then
 * doubles them, going back and forth between order and spare (n). */
#define DEPTH_SORT(REAL, SUFFIX) \
    static void insertion_sort_##SUFFIX(const REAL *depth, int64_t *order, int64_t n) { \
        for (int64_t i = 1; i < n; ++i) { \
            int64_t moving = order[i]; \
            REAL z = depth[moving]; \
            int64_t j = i; \
            for (; j > 0 && depth[order[j - 1]] > z; --j) order[j] = order[j - 1]; \
            order[j] = moving; \
        } \
    } \
    static void merge_sort_##SUFFIX(const REAL *depth, int64_t *order, int64_t n, \
                                    int64_t *spare) { \
        for (int64_t i = 0; i < n; i += SHORT) \
            insertion_sort_##SUFFIX(depth, order + i, n - i < SHORT ? n - i : SHORT); \
        int64_t *from = order, *to = spare; \
        for (int64_t run = SHORT; run < n; run *= 2) { \
            for (int64_t i = 0; i < n; i += 2 * run) { \
                int64_t left = i, middle = i + run < n ? i + run : n; \
                int64_t right = middle, end = middle + run < n ? middle + run : n; \
                for (int64_t k = i; k < end; ++k) { \
                    bool second = \
                        left == middle || (right < end && depth[from[right]] < depth[from[left]]); \
                    to[k] = second ? from[right++] : from[left++]; \
                } \
            } \
            int64_t *swapped = from; \
            from = to; \
            to = swapped; \
        } \
        if (from != order) memcpy(order, from, (size_t)n * sizeof *order); \
    }
DEPTH_SORT(float, float32)
DEPTH_SORT(double, float64)

static moit_status order_pixels(void *context, int64_t item, int thread) {
    (void)thread;
    const ordering *o = context;
    const moit_fragments *f = o->fragments;
    int64_t begin = item * PIXELS_PER_ITEM;
    int64_t end = begin + PIXELS_PER_ITEM < f->pixels ? begin + PIXELS_PER_ITEM : f->pixels;
    int64_t most = 0;
    for (int64_t p = begin; p < end; ++p) {
        int64_t n = f->offsets[p + 1] - f->offsets[p];
        if (n > most) most = n;
    }
    int64_t *spare = NULL;
    if (most > SHORT && !(spare = malloc((size_t)most * sizeof *spare))) return MOIT_NO_MEMORY;
    for (int64_t p = begin; p < end; ++p) {
        int64_t first = f->offsets[p], n = f->offsets[p + 1] - first;
        int64_t *order = o->order + first;
        for (int64_t i = 0; i < n; ++i) order[i] = first + i;
        if (f->precision == MOIT_FLOAT32)
            n <= SHORT ? insertion_sort_float32(f->depth, order, n)
                       : merge_sort_float32(f->depth, order, n, spare);
        else
            n <= SHORT ? insertion_sort_float64(f->depth, order, n)
                       : merge_sort_float64(f->depth, order, n, spare);
    }
    free(spare);
    return MOIT_OK;
}

moit_status moit_depth_order(const moit_fragments *fragments, int64_t *order, const moit_run *run) {
    ordering o = {fragments, order};
    return moit_parallel_for(run, (fragments->pixels + PIXELS_PER_ITEM - 1) / PIXELS_PER_ITEM,
                             order_pixels, &o);
}

int64_t moit_group_by_pixel(const int64_t *pixel, int64_t count, int64_t pixels, int64_t *offsets,
                            int64_t *order) {
    for (int64_t p = 0; p <= pixels; ++p) offsets[p] = 0;
    for (int64_t i = 0; i < count; ++i) {
        if (pixel[i] < 0 || pixel[i] >= pixels) return i;
        ++offsets[pixel[i] + 1];
    }
    for (int64_t p = 0; p < pixels; ++p) offsets[p + 1] += offsets[p];
    /* offsets[p] says where the next fragment of p goes: in the end, where p + 1 begins. */
    for (int64_t i = 0; i < count; ++i) order[offsets[pixel[i]]++] = i;
    for (int64_t p = pixels; p > 0; --p) offsets[p] = offsets[p - 1];
    offsets[0] = 0;
    return count;
}
