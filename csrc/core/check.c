/* What is wrong with fragments from outside. Mostly nothing is (survey.c). */
#include "core/check.h"

#include <float.h>
#include <string.h>

/* Numbers looked at between two looks at the answer: long enough for the inner loop to have no
 * branch, short enough to stay in the nearest cache for the second look. */
enum { BLOCK = 2048 };

/* The first of x[0..n) that is not in [low, high], or n. NaN is in no interval. */
#define FIRST_OUTSIDE(NAME, REAL) \
    static int64_t NAME(const REAL *x, int64_t n, REAL low, REAL high) { \
        for (int64_t begin = 0; begin < n; begin += BLOCK) { \
            int64_t end = begin + BLOCK < n ? begin + BLOCK : n; \
            unsigned outside = 0; \
            for (int64_t i = begin; i < end; ++i) outside |= !((x[i] >= low) & (x[i] <= high)); \
            if (!outside) continue; \
            for (int64_t i = begin; i < end; ++i) \
                if (!(x[i] >= low && x[i] <= high)) return i; \
        } \
        return n; \
    }
FIRST_OUTSIDE(first_outside_float32, float)
FIRST_OUTSIDE(first_outside_float64, double)

/* The first of back[0..n) that is less than depth, or n. */
#define FIRST_NEARER(NAME, REAL) \
    static int64_t NAME(const REAL *back, const REAL *depth, int64_t n) { \
        for (int64_t i = 0; i < n; ++i) \
            if (back[i] < depth[i]) return i; \
        return n; \
    }
FIRST_NEARER(first_nearer_float32, float)
FIRST_NEARER(first_nearer_float64, double)

/* Whether nothing gets through fragment i, and depth[i] is finite: such may lie anywhere. */
static bool is_background(const moit_fragments *f, const void *depth, int64_t i) {
    bool single = f->precision == MOIT_FLOAT32;
#define AT(array, k) (single ? (double)((const float *)(array))[k] : ((const double *)(array))[k])
    double at = AT(depth, i), greatest = single ? (double)FLT_MAX : DBL_MAX;
    bool passes = AT(f->alpha, i) != 1.0;
    for (int c = 0; f->transmission && c < 3; ++c) passes |= AT(f->transmission, 3 * i + c) != 0.0;
#undef AT
    return !passes && at >= -greatest && at <= greatest;
}

/* The first index from `first` on of a depth that is outside the range where it must not be. */
static int64_t first_astray(const moit_fragments *f, const void *depth, int64_t first, int64_t n,
                            double low, double high) {
    while (first < n && is_background(f, depth, first)) {
        ++first;
        first += f->precision == MOIT_FLOAT32
                     ? first_outside_float32((const float *)depth + first, n - first, (float)low,
                                             (float)high)
                     : first_outside_float64((const double *)depth + first, n - first, low, high);
    }
    return first;
}

/* The first fragment that is both a box and a Gaussian, or n. */
static int64_t first_of_two_extents(const moit_fragments *f, int64_t n) {
    bool single = f->precision == MOIT_FLOAT32;
    for (int64_t i = 0; i < n; ++i) {
        bool box = single ? ((const float *)f->back)[i] > ((const float *)f->depth)[i]
                          : ((const double *)f->back)[i] > ((const double *)f->depth)[i];
        if (box
            && (single ? ((const float *)f->deviation)[i] > 0.0f
                       : ((const double *)f->deviation)[i] > 0.0))
            return i;
    }
    return n;
}

/* The first index that is less than the one before it, or n. */
static int64_t first_decrease(const int64_t *x, int64_t n) {
    for (int64_t begin = 1; begin < n; begin += BLOCK) {
        int64_t end = begin + BLOCK < n ? begin + BLOCK : n;
        unsigned decreases = 0;
        for (int64_t i = begin; i < end; ++i) decreases |= x[i] < x[i - 1];
        if (!decreases) continue;
        for (int64_t i = begin; i < end; ++i)
            if (x[i] < x[i - 1]) return i;
    }
    return n;
}

static double clamp(double x, double low, double high) {
    return x < low ? low : x > high ? high : x;
}

void moit_checks_of(const moit_fragments *fragments, int64_t count, moit_number_check *checks) {
    bool single = fragments->precision == MOIT_FLOAT32;
    /* Clamped, the ends of the range say "finite" too. */
    double greatest = single ? (double)FLT_MAX : DBL_MAX,
           near = clamp(fragments->near, -greatest, greatest),
           far = clamp(fragments->far, -greatest, greatest);
    const moit_number_check found[MOIT_CHECKS] = {
        {MOIT_DEPTH, fragments->depth, count, near, far},
        {MOIT_ALPHA, fragments->alpha, count, 0, 1},
        {MOIT_COLOR, fragments->color, 3 * count, -greatest, greatest},
        {MOIT_TRANSMISSION, fragments->transmission, 3 * count, 0, 1},
        {MOIT_BACK, fragments->back, count, near, far},
        {MOIT_EMISSION, fragments->emission, 3 * count, -greatest, greatest},
        {MOIT_DEVIATION, fragments->deviation, count, 0, greatest},
    };
    memcpy(checks, found, sizeof found);
}

moit_fault moit_check_fragments(const moit_fragments *fragments, int64_t count) {
    const int64_t *offsets = fragments->offsets;
    int64_t pixels = fragments->pixels;
    if (offsets[0] != 0) return (moit_fault){MOIT_OFFSETS, 0};
    int64_t decrease = first_decrease(offsets, pixels + 1);
    if (decrease <= pixels) return (moit_fault){MOIT_OFFSETS, decrease};
    if (offsets[pixels] != count) return (moit_fault){MOIT_OFFSETS, pixels};

    bool single = fragments->precision == MOIT_FLOAT32;
    moit_number_check checks[MOIT_CHECKS];
    moit_checks_of(fragments, count, checks);
    for (size_t i = 0; i < MOIT_CHECKS; ++i) {
        if (!checks[i].x) continue;
        int64_t n = checks[i].n;
        int64_t first =
            single
                ? first_outside_float32(checks[i].x, n, (float)checks[i].low, (float)checks[i].high)
                : first_outside_float64(checks[i].x, n, checks[i].low, checks[i].high);
        if (checks[i].array == MOIT_DEPTH || checks[i].array == MOIT_BACK)
            first = first_astray(fragments, checks[i].x, first, n, checks[i].low, checks[i].high);
        if (first < n) return (moit_fault){checks[i].array, first};
    }
    if (fragments->back) {
        int64_t first = single ? first_nearer_float32(fragments->back, fragments->depth, count)
                               : first_nearer_float64(fragments->back, fragments->depth, count);
        if (first < count) return (moit_fault){MOIT_BACK, first};
    }
    if (fragments->back && fragments->deviation) {
        int64_t first = first_of_two_extents(fragments, count);
        if (first < count) return (moit_fault){MOIT_DEVIATION, first};
    }
    return (moit_fault){MOIT_NO_ARRAY, 0};
}
