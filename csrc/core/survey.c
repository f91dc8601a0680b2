/* Looks through fragments from outside in lanes and on threads, for whether anything is wrong with
 * them; what that is, check.c finds one by one. In passing the ends of their depths are found. */
#include "core/check.h"
#include "core/threads.h"
#include "core/tile.h"

#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

/* Fragments and pixels that a thread looks at between two questions whether to go on. */
enum { PART = 1 << 16 };

static const double infinite = __builtin_inf();

typedef struct {
    const moit_fragments *fragments;
    const moit_stages *stages;
    int64_t count;
    moit_number_check checks[MOIT_CHECKS];
    int64_t *copy;         /* of offsets; NULL: none */
    moit_depth_ends *ends; /* of each part: where depth begins and back, or else depth, ends */
    atomic_bool faulty;
} survey;

static int64_t least(int64_t a, int64_t b) { return a < b ? a : b; }

static const void *from(const survey *s, const void *array, int64_t first) {
    return (const char *)array + (size_t)first * moit_scalar_size(s->fragments->precision);
}

/* Whether depth or back is right in n fragments from `first` on; widens `ends` to it. */
static bool depths_are_right(const survey *s, const moit_number_check *c, int64_t first, int64_t n,
                             moit_depth_ends *ends) {
    const moit_fragments *f = s->fragments;
    const void *x = from(s, c->x, first);
    bool right = s->stages->depths_within(n, x, from(s, f->alpha, first), c->low, c->high, ends);
    /* with transmission it takes more than alpha to be opaque: that is left to check.c */
    if (f->transmission) right &= s->stages->all_within(n, x, c->low, c->high);
    return right
           && (c->array == MOIT_DEPTH || s->stages->none_nearer(n, x, from(s, f->depth, first)));
}

static bool fragments_are_right(const survey *s, int64_t first, int64_t n, moit_depth_ends *ends) {
    const moit_depth_ends none = *ends;
    bool right = true;
    for (int i = 0; right && i < MOIT_CHECKS; ++i) {
        const moit_number_check *c = s->checks + i;
        int64_t width = c->n / s->count;
        if (!c->x) continue;
        if (c->array == MOIT_DEPTH) {
            right = depths_are_right(s, c, first, n, ends);
        } else if (c->array == MOIT_BACK) {
            moit_depth_ends behind = none;
            right = depths_are_right(s, c, first, n, &behind);
            ends->far = behind.far;
            ends->clear_far = behind.clear_far;
        } else {
            right = s->stages->all_within(width * n, from(s, c->x, width * first), c->low, c->high);
        }
    }
    return right;
}

static moit_status survey_part(void *context, int64_t item, int thread) {
    survey *s = context;
    const int64_t *offsets = s->fragments->offsets;
    int64_t first = item * PART, n = least(PART, s->count - first),
            pixels = least(PART, s->fragments->pixels - first);
    (void)thread;
    s->ends[item] = (moit_depth_ends){infinite, -infinite, infinite, -infinite};
    bool right = n <= 0 || fragments_are_right(s, first, n, s->ends + item);
    if (s->copy && pixels >= 0) {
        bool last = pixels < PART; /* then it ends with the end of all */
        memcpy(s->copy + first, offsets + first, (size_t)(pixels + last) * sizeof *offsets);
        offsets = s->copy;
    }
    /* of offsets, and of what these grow by; to the next part's first it is looked at later */
    uint64_t signs = 0;
    for (int64_t p = first; p + 1 < first + pixels; ++p)
        signs |= (uint64_t)offsets[p + 1] | ((uint64_t)offsets[p + 1] - (uint64_t)offsets[p]);
    if (!right || signs >> 63) atomic_store(&s->faulty, true);
    return MOIT_OK;
}

/* Of fragments with which nothing is wrong. */
static moit_span span_of(const survey *s, int64_t parts) {
    const moit_fragments *f = s->fragments;
    moit_depth_ends all = {infinite, -infinite, infinite, -infinite};
    for (int64_t i = 0; i < parts; ++i) {
        const moit_depth_ends *ends = s->ends + i;
        if (ends->near < all.near) all.near = ends->near;
        if (ends->far > all.far) all.far = ends->far;
        if (ends->clear_near < all.clear_near) all.clear_near = ends->clear_near;
        if (ends->clear_far > all.clear_far) all.clear_far = ends->clear_far;
    }
    bool transparent = all.clear_near < infinite;
    moit_span span = {true, transparent, all.near, all.far};
    if (transparent) {
        span.near = all.clear_near;
        span.far = all.clear_far;
    }
    if (s->count == 0) span.near = span.far = 1.0;
    /* whether there may be one that alpha alone calls opaque */
    bool some = all.near < span.near || all.far > span.far || !transparent;
    span.known = !f->deviation && !(f->transmission && some && s->count);
    return span;
}

/* Whether offsets are right where parts meet, and at both ends. */
static bool parts_meet(const int64_t *offsets, int64_t pixels, int64_t count) {
    bool right = offsets[0] == 0 && offsets[pixels] == count;
    for (int64_t p = 0; p < pixels; p += PART) {
        int64_t last = least(p + PART, pixels);
        right &= offsets[last] >= offsets[last - 1];
    }
    return right;
}

moit_status moit_survey_fragments(const moit_fragments *fragments, int64_t count, int64_t *copy,
                                  moit_fault *fault, moit_span *span, const moit_run *run) {
    int64_t pixels = fragments->pixels, most = pixels + 1 > count ? pixels + 1 : count;
    moit_fragments own = *fragments;
    survey s = {.fragments = fragments,
                .stages = moit_stages_of(fragments->precision, run->isa),
                .count = count,
                .copy = copy};
    int64_t parts = (most + PART - 1) / PART;
    *fault = (moit_fault){MOIT_NO_ARRAY, 0};
    if (!(s.ends = malloc((size_t)(parts + 1) * sizeof *s.ends))) return MOIT_NO_MEMORY;
    moit_checks_of(fragments, count, s.checks);
    moit_status status = moit_parallel_for(run, parts, survey_part, &s);
    bool faulty = true;
    if (status == MOIT_OK) {
        if (copy) own.offsets = copy;
        /* fragments of two extents are few: check.c sees to them */
        faulty = atomic_load(&s.faulty) || !parts_meet(own.offsets, pixels, count)
                 || (fragments->back && fragments->deviation);
        if (faulty) *fault = moit_check_fragments(&own, count);
    }
    if (span) *span = faulty ? (moit_span){.known = false} : span_of(&s, parts);
    free(s.ends);
    return status;
}

/* ---- Any arrays ------------------------------------------------------------------------------ */

typedef struct {
    const moit_stages *stages;
    size_t scalar;
    const moit_range_check *arrays;
    atomic_bool faulty;
} range_survey;

static int64_t parts_of(const moit_range_check *array) { return (array->n + PART - 1) / PART; }

static moit_status survey_range(void *context, int64_t item, int thread) {
    range_survey *s = context;
    const moit_range_check *array = s->arrays;
    (void)thread;
    for (; item >= parts_of(array); ++array) item -= parts_of(array);
    int64_t first = item * PART, n = least(PART, array->n - first);
    const char *x = (const char *)array->x + (size_t)first * s->scalar;
    if (!s->stages->all_within(n, x, array->low, array->high)) atomic_store(&s->faulty, true);
    return MOIT_OK;
}

moit_status moit_are_within(moit_precision precision, int count, const moit_range_check *arrays,
                            bool *within, const moit_run *run) {
    range_survey s = {.stages = moit_stages_of(precision, run->isa),
                      .scalar = moit_scalar_size(precision),
                      .arrays = arrays};
    int64_t parts = 0;
    for (int i = 0; i < count; ++i) parts += parts_of(arrays + i);
    moit_status status = moit_parallel_for(run, parts, survey_range, &s);
    *within = !atomic_load(&s.faulty);
    return status;
}
