/* Fragments that nobody sends on purpose, and techniques with options that nobody chooses: what a
 * number draws. Numbers of `count_of` are integers below a limit, `share_of` uniform in [0, 1). */
#ifndef HOSTILE_CASES_H
#define HOSTILE_CASES_H

#include <float.h>

#include "expect.h"

enum { MOST_PIXELS = 40, ASKED_DEPTHS = 14 };

typedef struct {
    rays r;
    void *transmission, *back, *emission, *weights; /* NULL: there are none */
    moit_technique technique;
    bool cull_opaque;
    double depths[ASKED_DEPTHS];
    uint64_t random; /* what more is drawn from */
} hostile_case;

static inline int count_of(uint64_t *random, int limit) {
    return (int)(next_random(random) * limit);
}

static inline double share_of(uint64_t *random) { return next_random(random); }

static inline bool one_in(uint64_t *random, int times) { return count_of(random, times) == 0; }

#define ONE_OF(random, ...) \
    ((const double[]){__VA_ARGS__}[count_of( \
        random, (int)(sizeof(const double[]){__VA_ARGS__} / sizeof(double)))])

/* ---- Techniques ------------------------------------------------------------------------------ */

static inline void draw_moments(uint64_t *random, moit_technique *t, moit_precision precision) {
    t->moments.overestimation = ONE_OF(random, 0.0, 0.25, 0.25, 1.0);
    t->moments.exclude_self = one_in(random, 2);
    t->moments.bits = t->kind == MOIT_POWER_MOMENTS || t->kind == MOIT_TRIGONOMETRIC_MOMENTS
                          ? (int)ONE_OF(random, 32, 32, 16)
                          : 32;
    t->moments.b0_is_half = one_in(random, 2);
    t->moments.halves = (t->kind == MOIT_POWER_MOMENTS || t->kind == MOIT_BOUNDED_NEURAL)
                        && t->moments.bits == 32 && one_in(random, 3);
    t->moments.wrapping_zone =
        ONE_OF(random, 0.0, 1e-12, 0.3, 0.3141592653589793, 1.5, MOIT_MOST_WRAPPING_ZONE);
    t->moments.bias = ONE_OF(random, -1.0, -1.0, -2.0, 0.0, 1e-15, 1e-3, 1.0);
    if (t->moments.bias == -1.0) t->moments.bias = moit_default_bias(t, precision);
    if (t->moments.bias == -2.0) t->moments.bias = moit_published_bias(t);
}

/* Options of any kind; whether they go together. */
static inline bool draw_options(uint64_t *random, moit_technique *t, moit_precision precision) {
    const int *usual = moit_usual_counts(t->kind);
    int choices = 0;
    while (usual[choices]) ++choices;
    bool any = one_in(random, 2) && !moit_facts_of(t->kind).stores_moments;
    if (choices) t->count = any ? 1 + count_of(random, 64) : usual[count_of(random, choices)];
    t->normalize = !one_in(random, 4);
    t->max_alpha = ONE_OF(random, 1.0 - 0.5 / 256.0, 1.0 - 0.5 / 256.0, 0.5, 1e-3, 1.0 - 1e-12);
    t->warp = (moit_warp)(int)ONE_OF(random, MOIT_WARP_LOG, MOIT_WARP_LOG, MOIT_WARP_LINEAR,
                                     MOIT_WARP_NONE);
    t->range_per_pixel = t->warp != MOIT_WARP_NONE && one_in(random, 3);
    switch (t->kind) {
    case MOIT_WEIGHTED_BLENDED:
        t->weighted.weight = (moit_weight)count_of(random, MOIT_WEIGHT_GIVEN + 1);
        t->weighted.bits = (int)ONE_OF(random, 32, 32, 16);
        t->weighted.depth_scale = ONE_OF(random, 1.0, 1.0, 10.0, 1e-6, 1e6);
        break;
    case MOIT_MOMENT_TRANSPARENCY:
        t->transparency.passes = 1 + count_of(random, 2);
        t->transparency.storage = (moit_storage)count_of(random, 3);
        t->transparency.average = one_in(random, 2);
        t->transparency.symmetric = one_in(random, 2);
        draw_moments(random, t, precision);
        break;
    case MOIT_FRONT:
        t->front.tail = (moit_kind)(int)ONE_OF(random, MOIT_POWER_MOMENTS,
                                               MOIT_TRIGONOMETRIC_MOMENTS, MOIT_BOUNDED_NEURAL);
        t->front.moment_count =
            (int)(t->front.tail == MOIT_TRIGONOMETRIC_MOMENTS ? ONE_OF(random, 2, 3, 4)
                                                              : ONE_OF(random, 4, 6));
        int layers = t->count;
        t->kind = t->front.tail;
        t->count = t->front.moment_count;
        draw_moments(random, t, precision);
        t->moments.bits = 32;
        t->moments.halves = false;
        t->kind = MOIT_FRONT;
        t->count = layers;
        break;
    case MOIT_NEURAL_MOMENTS: t->neural.range_in_words = t->range_per_pixel; break;
    case MOIT_FOURIER_OPACITY:
    case MOIT_FUNCTION_MAP:
    case MOIT_HAAR_WAVELETS:
        t->series.bits = (int)ONE_OF(random, 32, 16);
        t->series.exclude_self = one_in(random, 2);
        t->series.density = t->kind == MOIT_HAAR_WAVELETS && one_in(random, 2);
        if (t->kind == MOIT_HAAR_WAVELETS) t->count = 4 << count_of(random, 4);
        if (t->kind == MOIT_FOURIER_OPACITY) t->count |= 1;
        break;
    case MOIT_AVBOIT:
        t->count = (int)ONE_OF(random, 2, 16, 128, 256);
        t->slices = (moit_slice_options){.bits = (int)ONE_OF(random, 8, 16),
                                         .cells = (int)ONE_OF(random, 64, 2048, 8192),
                                         .bias = ONE_OF(random, 0.0, 1.0, 2.0, 2.5),
                                         .average = one_in(random, 2)};
        break;
    case MOIT_SLICES:
        t->count = (int)ONE_OF(random, 2, 3, 16, 64, 256);
        t->slices.bits = (int)ONE_OF(random, 8, 16);
        t->slices.table = (moit_slice_table_of)count_of(random, 3);
        t->slices.cells = (int)ONE_OF(random, 64, 256, 8192);
        t->slices.inside = one_in(random, 4);
        t->slices.tile = (int)ONE_OF(random, 1, 6, 18, 36); /* multiples of resolutions */
        break;
    case MOIT_NEURAL_SLICES:
        t->count = (int)ONE_OF(random, 2, 3, 5, 16, 256);
        t->slices.bits = (int)ONE_OF(random, 2, 6, 8, 16);
        break;
    case MOIT_ADAPTIVE:
    case MOIT_MLAB:
        t->layers.quantized = one_in(random, 2);
        t->layers.by_energy = one_in(random, 2);
        t->layers.min_alpha = ONE_OF(random, 0.0, 1.0 / 255.0, 0.3, 1.0);
        t->layers.buckets = t->kind == MOIT_MLAB && t->count > 1 && one_in(random, 2);
        t->layers.front_alpha = ONE_OF(random, 0.0, 0.25, 1.0);
        t->layers.back_alpha = ONE_OF(random, 0.0, 0.98, 1.0);
        break;
    case MOIT_STOCHASTIC:
    case MOIT_HASHED_ALPHA:
        t->sampling.seed = (uint32_t)count_of(random, INT32_MAX);
        t->sampling.stratified = one_in(random, 2);
        break;
    case MOIT_ANCHORS:
        t->anchors.cells = (int)ONE_OF(random, 1, 4, 16);
        t->anchors.gamma = ONE_OF(random, 0.0, 3.5, 32.0);
        break;
    case MOIT_STRONG: t->strong.gamma = ONE_OF(random, 0.0, 4.0, 32.0); break;
    case MOIT_DEEP_SHADOW_MAP: t->tolerance = ONE_OF(random, 0.0, 1e-9, 0.01, 0.3, 1.0); break;
    default:
        if (moit_facts_of(t->kind).stores_moments) draw_moments(random, t, precision);
    }
    t->resolution = (int)ONE_OF(random, 1, 1, 1, 2, 3, 9);
    t->full_total = t->resolution > 1 && one_in(random, 2);
    return moit_technique_fits(t);
}

static inline moit_technique draw_technique(uint64_t *random, moit_precision precision) {
    moit_technique t;
    moit_kind kind = (moit_kind)count_of(random, MOIT_KIND_COUNT);
    if (one_in(random, 4))
        kind = one_in(random, 2) ? MOIT_POWER_MOMENTS : MOIT_TRIGONOMETRIC_MOMENTS;
    do t = simple(kind);
    while (!draw_options(random, &t, precision));
    return t;
}

/* Whether a logarithm is taken of depth, or a weight made of it. */
static inline bool needs_positive_depth(const moit_technique *t) {
    if (t->kind == MOIT_WEIGHTED_BLENDED) return t->weighted.weight != MOIT_WEIGHT_GIVEN;
    return moit_facts_of(t->kind).uses_warp && t->warp == MOIT_WARP_LOG;
}

static inline bool needs_unit_depth(const moit_technique *t) {
    return moit_facts_of(t->kind).uses_warp && t->warp == MOIT_WARP_NONE;
}

/* ---- Numbers --------------------------------------------------------------------------------- */

static inline double as_held(moit_precision precision, double x) {
    return precision == MOIT_FLOAT64 ? x : (double)(float)x;
}

static inline void draw_depths(hostile_case *c) {
    uint64_t *random = &c->random;
    moit_precision precision = c->r.f.precision;
    int kind = needs_unit_depth(&c->technique) ? 9 + count_of(random, 3) : count_of(random, 10);
    double middle = pow(10.0, 6.0 * share_of(random) - 3.0), ulp = middle * epsilon(precision);
    double most = precision == MOIT_FLOAT64 ? 300.0 : 37.0;
    double few[3], near_one = pow(10.0, -16.0 + 15.0 * share_of(random));
    double spread = pow(10.0, 10.0 * share_of(random) - 5.0);
    double other = ONE_OF(random, 1.0, 1e30, 1e-30);
    int steps = (int)ONE_OF(random, 2, 8, 1000);
    for (int k = 0; k < 3; ++k) few[k] = 0.5 + 20.0 * share_of(random);
    for (int64_t i = 0; i < c->r.count; ++i) {
        double x = share_of(random), z = 0.0;
        switch (kind) {
        case 0: z = 0.5 + 20.0 * x; break;
        case 1: z = few[(int)(3.0 * x)]; break;
        case 2: z = middle + ulp * floor(steps * x); break; /* a few last digits apart */
        case 3: z = pow(10.0, most * (2.0 * x - 1.0)); break;
        case 4: z = few[0]; break;
        case 5: z = exp(0.02 * x); break;
        case 6: z = middle * (1.0 + near_one * x); break;
        case 7: z = x < 0.5 ? 1.0 : other; break;
        case 8: z = spread * (2.0 * x - 1.0); break; /* not what a logarithm takes */
        case 9: z = x; break;
        case 10: z = floor(4.0 * x) / 4.0; break;
        default: z = x < 0.3 ? 0.0 : x < 0.6 ? 1.0 : 0.5 + ldexp(x, -30);
        }
        if (needs_positive_depth(&c->technique)) z = z > 0.0 ? z : z < 0.0 ? -z : middle;
        set_number(precision, c->r.depth, i, z);
    }
}

static inline void draw_alphas(hostile_case *c) {
    uint64_t *random = &c->random;
    moit_precision precision = c->r.f.precision;
    bool wide = precision == MOIT_FLOAT64;
    int kind = count_of(random, 9), least = wide ? -1074 : -149, digits = wide ? 53 : 24;
    double scale = ONE_OF(random, 1e-3, 1e-6, 1e-12), unit = ldexp(1.0, -digits);
    double same =
        ONE_OF(random, 1e-38, 1e-3, 0.99, 1.0 - 0.5 / 256.0, wide ? DBL_MIN : (double)FLT_MIN);
    int steps = (int)ONE_OF(random, 2, 5, 1000);
    for (int64_t i = 0; i < c->r.count; ++i) {
        double x = share_of(random), alpha = x;
        switch (kind) {
        case 0: break;
        case 1: alpha = floor(3.0 * x) / 2.0; break;
        case 2: alpha = x * scale; break;
        case 3: alpha = ldexp(x, least + count_of(random, digits + 9)); break;
        case 4: alpha = 1.0 - unit * floor(steps * x); break;
        case 5: alpha = same; break;
        case 6: alpha = pow(10.0, -45.0 * x); break;
        case 7: alpha = pow(x, 20.0); break;
        default: alpha = ONE_OF(random, 0.0, 1e-45, 1e-38, 1e-20, 1e-7, 0.5, 0.998, 1.0);
        }
        set_number(precision, c->r.alpha, i, alpha);
    }
}

static inline void draw_colors(hostile_case *c) {
    uint64_t *random = &c->random;
    double bright = ONE_OF(random, 1.0, 1.0, 1.0, 1.0, 0.0, 1e4);
    for (int64_t i = 0; i < 3 * c->r.count; ++i)
        set_number(c->r.f.precision, c->r.color, i, bright * share_of(random));
}

/* What the rest is drawn from is the number alone, so that a case is the same whoever asks. */
static inline void draw_range(hostile_case *c) {
    moit_fragments *f = &c->r.f;
    double near = INFINITE, far = -INFINITE;
    for (int transparent = 1; transparent >= 0 && near > far; --transparent)
        for (int64_t i = 0; i < c->r.count; ++i) {
            double z = number(f->precision, f->depth, i);
            if (transparent && number(f->precision, f->alpha, i) == 1.0 && !c->transmission)
                continue;
            near = fmin(near, z);
            far = fmax(far, z);
        }
    if (near > far) near = far = 1.0;
    if (one_in(&c->random, 5) && !needs_unit_depth(&c->technique)) {
        near = near > 0.0 ? near / 2.0 : near * 2.0;
        far = far > 0.0 ? far * 2.0 : far / 2.0;
    }
    f->near = as_held(f->precision, near);
    f->far = as_held(f->precision, far);
    if (needs_positive_depth(&c->technique) && !(f->near > 0.0)) f->near = near;
}

static inline void *draw_shares(hostile_case *c, double middle) {
    void *array = room(3 * c->r.count, size_of(c->r.f.precision));
    for (int64_t i = 0; i < 3 * c->r.count; ++i)
        set_number(c->r.f.precision, array, i, ONE_OF(&c->random, 0.0, middle, 1.0));
    return array;
}

static inline void draw_asked_depths(hostile_case *c) {
    const double beyond[] = {-1e300, -1e9, -1.0, 0.0, 1e-300, 1e9, 1e38, 1e300};
    for (int k = 0; k < ASKED_DEPTHS; ++k) {
        double z = 20.0 * share_of(&c->random);
        if (k < 8) z = beyond[k];
        else if (k < 12 && c->r.count) {
            z = number(c->r.f.precision, c->r.depth, count_of(&c->random, (int)c->r.count));
            if (k > 9) z = nextafter(z, k == 10 ? INFINITE : -INFINITE);
        }
        int other = count_of(&c->random, k + 1); /* in any order */
        c->depths[k] = c->depths[other];
        c->depths[other] = z;
    }
}

/* Moves an array to where not one byte more is, so that a sanitizer sees who reads beyond. */
static inline void *tight(void *array, int64_t count, size_t size) {
    size_t bytes = (size_t)count * size;
    void *moved = malloc(bytes ? bytes : 1);
    if (!moved) exit(2);
    memcpy(moved, array, bytes);
    free(array);
    return moved;
}

static inline void tighten(hostile_case *c) {
    moit_fragments *f = &c->r.f;
    int64_t n = c->r.count;
    size_t size = size_of(f->precision);
    f->offsets = c->r.offsets = tight(c->r.offsets, f->pixels + 1, sizeof(int64_t));
    f->depth = c->r.depth = tight(c->r.depth, n, size);
    f->alpha = c->r.alpha = tight(c->r.alpha, n, size);
    f->color = c->r.color = tight(c->r.color, 3 * n, size);
    if (c->transmission) f->transmission = c->transmission = tight(c->transmission, 3 * n, size);
    if (c->weights) c->technique.weighted.weights = c->weights = tight(c->weights, n, size);
}

static inline hostile_case draw_case(uint64_t seed) {
    hostile_case c = {.random = seed * 0x9e3779b97f4a7c15u + 0x5851f42d4c957f2du};
    uint64_t *random = &c.random;
    moit_precision precision = one_in(random, 2) ? MOIT_FLOAT64 : MOIT_FLOAT32;
    int64_t counts[MOST_PIXELS], pixels = (int64_t)ONE_OF(random, 1, 1, 2, 5, 17, MOST_PIXELS);
    if (one_in(random, 200)) pixels = 0;
    int most = (int)ONE_OF(random, 0, 1, 2, 3, 5, 9, 17, 40, 130);
    if (pixels > 5 && most > 9) most = 9; /* many cases rather than long ones */
    if (one_in(random, 5000)) {           /* more than a tile is made for */
        pixels = pixels > 2 ? 2 : pixels;
        most = 6000;
    }
    for (int64_t p = 0; p < pixels; ++p) counts[p] = count_of(random, most + 1);
    c.r = empty_rays(precision, pixels, counts);
    c.technique = draw_technique(random, precision);
    c.cull_opaque = !one_in(random, 5);
    c.r.f.width = pixels % 2 == 0 && one_in(random, 2) ? pixels / 2 : 0;
    c.r.f.top = count_of(random, 3);
    draw_depths(&c);
    draw_alphas(&c);
    draw_colors(&c);
    if (moit_facts_of(c.technique.kind).takes_transmission && one_in(random, 6))
        c.transmission = draw_shares(&c, 0.25);
    draw_range(&c);
    draw_asked_depths(&c);
    if (c.technique.kind == MOIT_WEIGHTED_BLENDED
        && c.technique.weighted.weight == MOIT_WEIGHT_GIVEN)
        c.weights = draw_shares(&c, 1e-30);
    tighten(&c);
    return c;
}

static inline void free_case(hostile_case *c) {
    free_rays(&c->r);
    free(c->transmission);
    free(c->back);
    free(c->emission);
    free(c->weights);
}

#endif
