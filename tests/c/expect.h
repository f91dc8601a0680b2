/* What the programs of this folder share: claims, and random rays to make them about. Each program
 * checks one subject of moit.h, prints what fails, and exits with 1 if anything did. */
#ifndef EXPECT_H
#define EXPECT_H

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "moit.h"

#define HELPER static __attribute__((unused))
/* C's own are floats. */
#define NOT_A_NUMBER ((double)NAN)
#define INFINITE ((double)INFINITY)

static int failures;

#define EXPECT(claim) \
    do { \
        if (!(claim)) fail(__FILE__, __LINE__, #claim, NOT_A_NUMBER, NOT_A_NUMBER); \
    } while (0)
/* |found - needed| <= tolerance; NaN never is. */
#define EXPECT_NEAR(found, needed, tolerance) \
    do { \
        double found_ = (found), needed_ = (needed); \
        if (!(fabs(found_ - needed_) <= (tolerance))) \
            fail(__FILE__, __LINE__, #found, found_, needed_); \
    } while (0)

HELPER void fail(const char *file, int line, const char *claim, double found, double needed) {
    enum { TOLD = 20 }; /* one broken loop need not fill the screen */
    if (++failures > TOLD) return;
    fprintf(stderr, "%s:%d: not so: %s", file, line, claim);
    if (!isnan(needed)) fprintf(stderr, " is %.17g, needs %.17g", found, needed);
    fputc('\n', stderr);
}

HELPER int verdict(void) {
    if (failures) fprintf(stderr, "%d failures\n", failures);
    return failures != 0;
}

/* A test that cannot have its memory says nothing about the core. */
HELPER void *room(int64_t count, size_t size) {
    void *memory = calloc((size_t)count + 1, size);
    if (memory) return memory;
    perror("room");
    exit(2);
}

/* ---- Numbers of either precision ------------------------------------------------------------- */

HELPER size_t size_of(moit_precision precision) {
    return precision == MOIT_FLOAT64 ? sizeof(double) : sizeof(float);
}

HELPER double number(moit_precision precision, const void *array, int64_t i) {
    return precision == MOIT_FLOAT64 ? ((const double *)array)[i]
                                     : (double)((const float *)array)[i];
}

HELPER void set_number(moit_precision precision, void *array, int64_t i, double x) {
    if (precision == MOIT_FLOAT64) ((double *)array)[i] = x;
    else ((float *)array)[i] = (float)x;
}

/* Of one rounding to the precision. */
HELPER double epsilon(moit_precision precision) {
    return precision == MOIT_FLOAT64 ? 0x1p-52 : 0x1p-23;
}

#define FOR_BOTH_PRECISIONS(name) \
    for (moit_precision name = MOIT_FLOAT32; name <= MOIT_FLOAT64; ++name)

/* ---- Rays ------------------------------------------------------------------------------------ */

HELPER moit_run plain_run(void) { return (moit_run){.threads = 1, .isa = moit_isa_best()}; }

/* Uniform in [0, 1); the same on every machine. */
HELPER double next_random(uint64_t *state) {
    uint64_t x = *state += 0x9e3779b97f4a7c15u;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    return (double)((x ^ (x >> 31)) >> 11) * 0x1p-53;
}

typedef struct {
    moit_fragments f; /* its arrays are those below */
    int64_t count;
    int64_t *offsets;
    void *depth, *alpha, *color;
} rays;

/* Room for the given numbers of fragments; all numbers are 0. */
HELPER rays empty_rays(moit_precision precision, int64_t pixels, const int64_t *counts) {
    rays r = {.offsets = room(pixels + 1, sizeof(int64_t))};
    for (int64_t p = 0; p < pixels; ++p) r.offsets[p + 1] = r.offsets[p] + counts[p];
    r.count = r.offsets[pixels];
    r.depth = room(r.count, size_of(precision));
    r.alpha = room(r.count, size_of(precision));
    r.color = room(3 * r.count, size_of(precision));
    r.f = (moit_fragments){.precision = precision,
                           .pixels = pixels,
                           .offsets = r.offsets,
                           .depth = r.depth,
                           .alpha = r.alpha,
                           .color = r.color,
                           .near = 1.0,
                           .far = 1.0};
    return r;
}

HELPER void put_fragment(rays *r, int64_t i, double depth, double alpha, double red, double green,
                         double blue) {
    set_number(r->f.precision, r->depth, i, depth);
    set_number(r->f.precision, r->alpha, i, alpha);
    set_number(r->f.precision, r->color, 3 * i, red);
    set_number(r->f.precision, r->color, 3 * i + 1, green);
    set_number(r->f.precision, r->color, 3 * i + 2, blue);
}

/* 0 to `most` fragments a pixel at depths in [near, far] rounded to the precision, alpha below
 * `most_alpha`; a share of `opaque` has alpha 1. */
typedef struct {
    int64_t pixels;
    int most;
    double near, far, most_alpha, opaque;
    uint64_t seed;
} kind_of_rays;

HELPER rays random_rays(moit_precision precision, kind_of_rays kind) {
    uint64_t state = kind.seed;
    int64_t *counts = room(kind.pixels, sizeof *counts);
    for (int64_t p = 0; p < kind.pixels; ++p)
        counts[p] = (int64_t)(next_random(&state) * (kind.most + 1));
    rays r = empty_rays(precision, kind.pixels, counts);
    free(counts);
    for (int64_t i = 0; i < r.count; ++i) {
        double depth = kind.near + (kind.far - kind.near) * next_random(&state);
        double alpha = kind.most_alpha * next_random(&state);
        if (next_random(&state) < kind.opaque) alpha = 1.0;
        double red = next_random(&state), green = next_random(&state);
        put_fragment(&r, i, depth, alpha, red, green, 2.0 * next_random(&state));
    }
    r.f.near = kind.near;
    r.f.far = kind.far;
    return r;
}

HELPER void free_rays(rays *r) {
    free(r->offsets);
    free(r->depth);
    free(r->alpha);
    free(r->color);
}

/* The light that reaches `depth` in pixel p: the product of 1 - alpha of all that is nearer. */
HELPER double exact_at(const rays *r, int64_t p, double depth) {
    double through = 1.0;
    for (int64_t i = r->offsets[p]; i < r->offsets[p + 1]; ++i)
        if (number(r->f.precision, r->depth, i) < depth)
            through *= 1.0 - number(r->f.precision, r->alpha, i);
    return through;
}

/* ---- Techniques ------------------------------------------------------------------------------ */

static inline const float *any_network(void) {
    static float network[4096];
    uint64_t state = 7;
    for (int i = 0; i < 4096; ++i) network[i] = (float)(next_random(&state) - 0.5);
    return network;
}

/* Without what it counts, if it does; numbers are those of the precision, and a network is any. */
HELPER moit_technique simple(moit_kind kind) {
    moit_technique t = {.kind = kind, .max_alpha = 1.0 - 0.5 / 256.0};
    for (const moit_option *one = moit_options_of(kind); one->name; ++one)
        if (one->type == MOIT_NETWORK) *(const float **)((char *)&t + one->offset) = any_network();
    if (kind == MOIT_SLICES || kind == MOIT_AVBOIT)
        t.slices = (moit_slice_options){.bits = 8, .cells = 2048};
    if (kind == MOIT_AVBOIT) {
        t.count = 128;
        t.resolution = 8;
        t.slices.bias = 2.0;
    }
    if (kind == MOIT_WEIGHTED_BLENDED) t.weighted.depth_scale = 1.0;
    if (kind == MOIT_FRONT) {
        t.front.tail = MOIT_BOUNDED_NEURAL;
        t.front.moment_count = 4;
    }
    if (kind == MOIT_ANCHORS) t.anchors = (moit_anchor_options){.cells = 11, .gamma = 3.5};
    if (kind == MOIT_STRONG) t.strong.gamma = 4.0;
    return t;
}

HELPER moit_technique weighted(moit_weight weight) {
    moit_technique t = simple(MOIT_WEIGHTED_BLENDED);
    t.weighted.weight = weight;
    return t;
}

/* With a count, where the kind has one, and the defaults of the Python surface. */
HELPER moit_technique with_count(moit_kind kind, int count, moit_precision precision) {
    moit_technique t = simple(kind);
    t.count = count;
    t.normalize = true;
    if (kind == MOIT_STOCHASTIC) t.sampling.stratified = true;
    if (kind == MOIT_MOMENT_TRANSPARENCY) t.transparency.passes = t.resolution = 1;
    if (moit_moment_numbers(&t)) {
        t.moments.wrapping_zone = 0.3141592653589793;
        t.moments.overestimation = 0.25;
        t.moments.bias = moit_default_bias(&t, precision);
    }
    return t;
}

HELPER bool is_quantized(const moit_technique *t) {
    return (t->kind == MOIT_ADAPTIVE || t->kind == MOIT_MLAB) && t->layers.quantized;
}

/* What few fragments are off by: in words, and in keys, which hold the root of 1 - alpha. */
HELPER double rounding_of(const moit_technique *t, moit_precision precision) {
    if (t->kind == MOIT_ANCHORS || t->kind == MOIT_STRONG) return 1.5 / 1023.0;
    return is_quantized(t) ? 1.0 / 65535.0 : 8.0 * epsilon(precision);
}

HELPER void exclude_self(moit_technique *t) {
    if (moit_moment_numbers(t)) t->moments.exclude_self = true;
    if (t->kind == MOIT_FOURIER_OPACITY || t->kind == MOIT_FUNCTION_MAP
        || t->kind == MOIT_HAAR_WAVELETS)
        t->series.exclude_self = true;
}

HELPER moit_technique power(int count, moit_precision precision) {
    return with_count(MOIT_POWER_MOMENTS, count, precision);
}

/* One of every kind with each of its counts, and what changes the path through the code. */
enum { MOST_TECHNIQUES = 128 };

HELPER int all_techniques(moit_precision precision, moit_technique list[MOST_TECHNIQUES]) {
    int n = 0;
    for (int weight = 0; weight < MOIT_WEIGHT_GIVEN; ++weight)
        list[n++] = weighted((moit_weight)weight);
    for (int kind = 0; kind < MOIT_KIND_COUNT; ++kind) {
        const int *count = moit_usual_counts((moit_kind)kind);
        if (kind == MOIT_WEIGHTED_BLENDED) continue;
        if (!*count) list[n++] = simple((moit_kind)kind);
        for (; *count; ++count) {
            moit_technique t = with_count((moit_kind)kind, *count, precision);
            list[n++] = t;
            if (!moit_facts_of((moit_kind)kind).uses_warp) continue;
            t.warp = MOIT_WARP_LINEAR;
            if (kind == MOIT_ADAPTIVE || kind == MOIT_MLAB) t.layers.quantized = true;
            exclude_self(&t);
            list[n++] = t;
            t.range_per_pixel = true;
            t.normalize = false;
            list[n++] = t;
        }
    }
    return n;
}

#endif
