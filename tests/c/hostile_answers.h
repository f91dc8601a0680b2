/* What must hold of the answers to every question about a hostile case. */
#ifndef HOSTILE_ANSWERS_H
#define HOSTILE_ANSWERS_H

#include "hostile_cases.h"

/* Colours and what halves and bytes round; sums of float32 and of double. */
#define ROUNDING 3e-3

enum { MOST_TOLD = 3 }; /* lines about one case */

static uint64_t present; /* the case that is tried */
static int told;         /* lines about it, so far */
static bool unchecked;   /* its numbers may be anything: nothing is promised of the answers */

static void broken(const hostile_case *c, const char *what, double found, double needed) {
    if (unchecked) return;
    ++failures;
    if (told++ >= MOST_TOLD) return;
    const moit_technique *t = &c->technique;
    fprintf(stderr, "case %llu: %s of %s%d in float%d: found %.17g, needed %.17g\n",
            (unsigned long long)present, what, moit_kind_name(t->kind), t->count,
            c->r.f.precision == MOIT_FLOAT64 ? 64 : 32, found, needed);
}

/* Full of NaN, so that what is not written is seen, and not one byte more. */
static void *answer_room(int64_t count, size_t size) {
    size_t bytes = (size_t)count * size;
    void *memory = malloc(bytes ? bytes : 1);
    if (!memory) exit(2);
    return memset(memory, 0xff, bytes);
}

static void *numbers(const hostile_case *c, int64_t count) {
    return answer_room(count, size_of(c->r.f.precision));
}

static void expect_ok(const hostile_case *c, const char *what, moit_status status) {
    if (status != MOIT_OK) broken(c, what, status, MOIT_OK);
}

static void expect_within(const hostile_case *c, const char *what, const void *x, int64_t count,
                          double low, double high) {
    for (int64_t i = 0; i < count; ++i) {
        double found = number(c->r.f.precision, x, i);
        if (!isfinite(found) || found < low || found > high) {
            broken(c, what, found, found < low ? low : high);
            return;
        }
    }
}

static double least_total(const moit_technique *t) {
    return t->kind == MOIT_WEIGHTED_SUM ? -DBL_MAX : 0.0;
}

/* ---- What is exact --------------------------------------------------------------------------- */

/* The nearest opaque fragment of a pixel, the first of equals, or -1. */
static int64_t occluder_of(const hostile_case *c, int64_t p) {
    int64_t nearest = -1;
    moit_precision precision = c->r.f.precision;
    for (int64_t i = c->r.offsets[p]; i < c->r.offsets[p + 1]; ++i)
        if (number(precision, c->r.alpha, i) == 1.0
            && (nearest < 0
                || number(precision, c->r.depth, i) < number(precision, c->r.depth, nearest)))
            nearest = i;
    return nearest;
}

/* What is in front of a depth in pixel p: the product of 1 - alpha of all that is nearer; `others`:
 * of what is at the depth, too, but opaque. */
static long double exact(const hostile_case *c, int64_t p, double depth, bool others) {
    long double through = 1.0L;
    moit_precision precision = c->r.f.precision;
    for (int64_t i = c->r.offsets[p]; i < c->r.offsets[p + 1]; ++i) {
        double z = number(precision, c->r.depth, i), alpha = number(precision, c->r.alpha, i);
        if (z < depth || (others && z == depth && alpha < 1.0))
            through *= 1.0L - (long double)alpha;
    }
    return through;
}

/* In front of fragment i: the opaque one that culls hides others, and sees all that survive. */
static long double exact_of(const hostile_case *c, int64_t p, int64_t i) {
    double depth = number(c->r.f.precision, c->r.depth, i);
    int64_t occluder = c->cull_opaque ? occluder_of(c, p) : -1;
    if (occluder < 0 || number(c->r.f.precision, c->r.alpha, i) < 1.0)
        return exact(c, p, depth, false);
    return i == occluder ? exact(c, p, depth, true) : 0.0L;
}

static void expect_bounds(const hostile_case *c, const char *what, const void *lower,
                          const void *upper, int64_t k, long double truth) {
    double low = number(c->r.f.precision, lower, k), high = number(c->r.f.precision, upper, k);
    long double slack = 200.0L * LDBL_EPSILON; /* of the truth, which rounds, too */
    if ((long double)low > truth * (1.0L + slack)) broken(c, what, low, (double)truth);
    if ((long double)high < truth * (1.0L - slack)) broken(c, what, high, (double)truth);
}

/* ---- Questions ------------------------------------------------------------------------------- */

static const double behind[3] = {0.5, 0.0, 1.0};

static bool has_ties(const hostile_case *c) {
    for (int64_t p = 0; p < c->r.f.pixels; ++p)
        for (int64_t i = c->r.offsets[p]; i < c->r.offsets[p + 1]; ++i)
            for (int64_t j = c->r.offsets[p]; j < i; ++j)
                if (number(c->r.f.precision, c->r.depth, i)
                    == number(c->r.f.precision, c->r.depth, j))
                    return true;
    return false;
}

/* Sums as they are may be brighter than anything there is; halves that stop growing, too. */
static bool adds_up(const moit_technique *t) {
    if (t->kind == MOIT_WEIGHTED_SUM) return true;
    if (t->kind == MOIT_WEIGHTED_BLENDED) return t->weighted.bits == 16;
    bool normalizes = moit_facts_of(t->kind).uses_warp || t->kind == MOIT_STOCHASTIC
                      || t->kind == MOIT_DEEP_SHADOW_MAP;
    bool always =
        t->kind == MOIT_ADAPTIVE || t->kind == MOIT_MLAB || t->kind == MOIT_DEEP_FRAGMENTS;
    return normalizes && !always && !t->normalize;
}

static void expect_no_brighter(const hostile_case *c, const void *image) {
    moit_precision precision = c->r.f.precision;
    for (int64_t p = 0; p < c->r.f.pixels; ++p)
        for (int k = 0; k < 3; ++k) {
            double most = 0.0;
            for (int64_t i = c->r.offsets[p]; i < c->r.offsets[p + 1]; ++i)
                most = fmax(most, number(precision, c->r.color, 3 * i + k));
            double covered = number(precision, image, 4 * p + 3);
            double found = number(precision, image, 4 * p + k);
            double needed = most * (covered + ROUNDING) + behind[k] * (1.0 - covered + ROUNDING);
            if (!(found <= needed)) broken(c, "brightness", found, needed);
        }
}

static void *composite_of(const hostile_case *c, const moit_fragments *f, bool cull_opaque) {
    moit_run run = plain_run();
    void *image = numbers(c, 4 * f->pixels);
    expect_ok(c, "composite",
              moit_composite(f, &c->technique, cull_opaque, behind, false, image, &run));
    return image;
}

static void ask_for_pictures(const hostile_case *c) {
    const moit_fragments *f = &c->r.f;
    moit_run run = plain_run();
    void *image = composite_of(c, f, c->cull_opaque);
    int channels = f->transmission ? 3 : 1;
    void *total = numbers(c, channels * f->pixels);
    expect_ok(c, "total", moit_total_transmittance(f, &c->technique, c->cull_opaque, total, &run));
    expect_within(c, "picture", image, 4 * f->pixels, -DBL_MAX, DBL_MAX);
    expect_within(c, "total", total, channels * f->pixels, least_total(&c->technique), 1.0);
    if (!f->transmission) {
        for (int64_t p = 0; p < f->pixels; ++p) {
            double T = number(f->precision, total, p);
            double covered = number(f->precision, image, 4 * p + 3);
            if (!(fabs(1.0 - covered - T) <= 2.0 * epsilon(f->precision) * fmax(1.0, fabs(T))))
                broken(c, "coverage", covered, 1.0 - T);
        }
        if (!adds_up(&c->technique)) expect_no_brighter(c, image);
    }
    free(total);
    free(image);
}

static void ask_at_fragments(const hostile_case *c) {
    const moit_fragments *f = &c->r.f;
    const moit_technique *t = &c->technique;
    int64_t n = c->r.count;
    moit_run run = plain_run();
    void *T = numbers(c, n), *lower = numbers(c, n), *upper = numbers(c, n);
    expect_ok(c, "transmittance", moit_transmittance(f, t, c->cull_opaque, T, &run));
    expect_ok(c, "bounds", moit_bounds(f, t, c->cull_opaque, lower, upper, &run));
    bool weighs = t->kind == MOIT_WEIGHTED_BLENDED || t->kind == MOIT_DEEP_FRAGMENTS;
    expect_within(c, "transmittance", T, n, least_total(t), weighs ? DBL_MAX : 1.0);
    expect_within(c, "lower bounds", lower, n, 0.0, 1.0);
    expect_within(c, "upper bounds", upper, n, 0.0, 1.0);
    if (!f->transmission && t->kind != MOIT_SORTED)
        for (int64_t p = 0; p < f->pixels; ++p)
            for (int64_t i = c->r.offsets[p]; i < c->r.offsets[p + 1]; ++i)
                expect_bounds(c, "bounds", lower, upper, i, exact_of(c, p, i));
    if (!f->transmission && !has_ties(c)) {
        moit_technique sorted = simple(MOIT_SORTED);
        double *low = answer_room(4 * f->pixels, sizeof *low);
        double *high = answer_room(4 * f->pixels, sizeof *high);
        void *image = numbers(c, 4 * f->pixels);
        expect_ok(
            c, "colour bounds",
            moit_color_bounds(f, c->cull_opaque, behind, false, lower, upper, low, high, &run));
        expect_ok(c, "sorted",
                  moit_composite(f, &sorted, c->cull_opaque, behind, false, image, &run));
        for (int64_t k = 0; k < 4 * f->pixels; ++k) {
            double found = number(f->precision, image, k);
            if (!(low[k] <= found)) broken(c, "lower colour", low[k], found);
            if (!(found <= high[k])) broken(c, "upper colour", high[k], found);
        }
        free(low);
        free(high);
        free(image);
    }
    free(T);
    free(lower);
    free(upper);
}

static void ask_for_curves(const hostile_case *c) {
    const moit_fragments *f = &c->r.f;
    const moit_technique *t = &c->technique;
    if (!moit_facts_of(t->kind).has_curve) return;
    int64_t n = f->pixels * ASKED_DEPTHS;
    moit_run run = plain_run();
    void *T = numbers(c, n), *lower = numbers(c, n), *upper = numbers(c, n);
    expect_ok(c, "curve", moit_curve(f, t, c->cull_opaque, ASKED_DEPTHS, c->depths, T, &run));
    expect_ok(c, "curve bounds",
              moit_curve_bounds(f, t, c->cull_opaque, ASKED_DEPTHS, c->depths, lower, upper, &run));
    expect_within(c, "curve", T, n, 0.0, 1.0);
    expect_within(c, "lower bounds of a curve", lower, n, 0.0, 1.0);
    expect_within(c, "upper bounds of a curve", upper, n, 0.0, 1.0);
    for (int64_t k = 0; k < n && !f->transmission; ++k)
        expect_bounds(c, "curve bounds", lower, upper, k,
                      exact(c, k / ASKED_DEPTHS, c->depths[k % ASKED_DEPTHS], false));
    free(T);
    free(lower);
    free(upper);
}

static void ask_about_moments(hostile_case *c) {
    const moit_fragments *f = &c->r.f;
    const moit_technique *t = &c->technique;
    enum { DEPTHS = 4 };
    if (!moit_facts_of(t->kind).stores_moments) return;
    if (t->kind == MOIT_MOMENT_TRANSPARENCY && t->transparency.passes == 2) return;
    int64_t pixels = f->pixels, count = moit_moment_numbers(t), points = pixels * DEPTHS;
    bool words = t->kind != MOIT_MOMENT_TRANSPARENCY && t->moments.bits == 16;
    moit_run run = plain_run();
    void *b0 = numbers(c, pixels), *b = numbers(c, pixels * count);
    void *z = numbers(c, points), *T = numbers(c, points), *upper = numbers(c, points);
    double *pivot = answer_room(pixels, sizeof *pivot), *bias = answer_room(pixels, sizeof *bias);
    expect_ok(c, "gather", moit_gather(f, t, c->cull_opaque, b0, b, &run));
    expect_within(c, "b0", b0, pixels, 0.0, DBL_MAX);
    expect_within(c, "b", b, pixels * count, -2.0, 2.0);
    if (words) {
        uint16_t *kept = answer_room(pixels * count, sizeof *kept);
        expect_ok(c, "words", moit_gather_words(f, t, c->cull_opaque, b0, kept, &run));
        free(kept);
    }
    for (int64_t k = 0; k < points; ++k)
        set_number(f->precision, z, k, ONE_OF(&c->random, -1.0, 0.0, 1.0, share_of(&c->random)));
    expect_ok(c, "moments",
              moit_moments_transmittance(t, f->precision, pixels, DEPTHS, b0, b, z, T, &run));
    expect_within(c, "transmittance of moments", T, points, 0.0, 1.0);
    expect_ok(c, "pivots", moit_moments_pivots(t, f->precision, pixels, b0, b, pivot, &run));
    expect_ok(c, "least bias", moit_moments_least_bias(t, f->precision, pixels, b0, b, bias, &run));
    for (int64_t p = 0; p < pixels; ++p)
        if (isnan(pivot[p]) || !(bias[p] >= 0.0)) broken(c, "pivots", pivot[p], bias[p]);
    if (t->kind == MOIT_POWER_MOMENTS && !words) {
        expect_ok(
            c, "bounds of moments",
            moit_moments_bounds(t, f->precision, pixels, DEPTHS, b0, b, z, NULL, T, upper, &run));
        expect_within(c, "lower bounds of moments", T, points, 0.0, 1.0);
        expect_within(c, "upper bounds of moments", upper, points, 0.0, 1.0);
    }
    free(b0);
    free(b);
    free(z);
    free(T);
    free(upper);
    free(pivot);
    free(bias);
}

/* What is kept for others: sums, facts, features, and what a GPU is given. */
static void ask_for_parts(const hostile_case *c) {
    const moit_fragments *f = &c->r.f;
    const moit_technique *t = &c->technique;
    int64_t n = c->r.count, pixels = f->pixels;
    moit_run run = plain_run();
    int texel = moit_texel_numbers(t), columns = moit_network_columns(t);
    if (texel) {
        void *sums = numbers(c, pixels * texel);
        expect_ok(c, "texels", moit_texel_sums(f, t, sums, &run));
        expect_within(c, "texels", sums, pixels * texel, -DBL_MAX, DBL_MAX);
        const moit_texels texels = {f->precision, pixels, 1, texel, sums};
        double place[3 * ASKED_DEPTHS], reached[ASKED_DEPTHS];
        for (int k = 0; k < ASKED_DEPTHS; ++k) {
            place[3 * k] = c->depths[k];
            place[3 * k + 1] = 0.5;
            place[3 * k + 2] = c->depths[ASKED_DEPTHS - 1 - k];
        }
        if (f->near < f->far && !t->range_per_pixel)
            expect_ok(c, "shadow",
                      moit_shadow_at(&texels, t, f->near, f->far, false, ASKED_DEPTHS, place, NULL,
                                     reached, &run));
        for (int k = 0; k < ASKED_DEPTHS && f->near < f->far && !t->range_per_pixel; ++k)
            if (!(reached[k] >= 0.0 && reached[k] <= 1.0)) broken(c, "shadow", reached[k], 1.0);
        free(sums);
    }
    if (moit_has_target_sums(t)) {
        double *sums = answer_room(pixels * MOIT_TARGET_SUMS, sizeof *sums);
        expect_ok(c, "targets", moit_target_sums(f, t, sums, &run));
        for (int64_t k = 0; k < pixels * MOIT_TARGET_SUMS; ++k)
            if (!isfinite(sums[k])) broken(c, "targets", sums[k], 0.0);
        free(sums);
    }
    if (columns) {
        double *features = answer_room(n * columns, sizeof *features);
        expect_ok(c, "features", moit_network_features(f, t, c->cull_opaque, features, &run));
        for (int64_t k = 0; k < n * columns; ++k)
            if (!isfinite(features[k])) broken(c, "features", features[k], 0.0);
        free(features);
    }
    double *facts = answer_room(pixels * MOIT_PIXEL_FACTS, sizeof *facts);
    expect_ok(c, "facts", moit_pixel_facts(f, c->cull_opaque, facts, &run));
    for (int64_t k = 0; k < pixels * MOIT_PIXEL_FACTS; ++k)
        if (!isfinite(facts[k])) broken(c, "facts", facts[k], 0.0);
    free(facts);
    int64_t *order = answer_room(n, sizeof *order);
    expect_ok(c, "order", moit_depth_order(f, order, &run));
    free(order);
    if (!moit_facts_of(t->kind).uses_warp) return;
    void *z = numbers(c, n);
    expect_ok(c, "warp", moit_warped(f, t, 0, NULL, z, &run));
    expect_within(c, "warp", z, n, -1.0, 1.0);
    free(z);
}

static void ask_everything(hostile_case *c) {
    ask_for_pictures(c);
    ask_at_fragments(c);
    ask_for_curves(c);
    ask_about_moments(c);
    ask_for_parts(c);
}

#endif
