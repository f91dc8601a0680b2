/* What must hold of the derivatives of every answer about a hostile case: each of them is a number. */
#ifndef HOSTILE_DERIVATIVES_H
#define HOSTILE_DERIVATIVES_H

#include "hostile_answers.h"
#include "moit_gradients.h"

enum { OF_PICTURES, OF_FRAGMENTS, OF_TOTALS, OF_CURVES, OF_ALL };

static moit_status pull_back(const hostile_case *c, int of, const void *seed,
                             const double *background, bool per_pixel, const moit_gradients *out) {
    const moit_fragments *f = &c->r.f;
    const moit_technique *t = &c->technique;
    moit_run run = plain_run();
    switch (of) {
    case OF_PICTURES:
        return moit_composite_pullback(f, t, c->cull_opaque, background, per_pixel, seed, out,
                                       &run);
    case OF_FRAGMENTS: return moit_transmittance_pullback(f, t, c->cull_opaque, seed, out, &run);
    case OF_TOTALS: return moit_total_transmittance_pullback(f, t, c->cull_opaque, seed, out, &run);
    default:
        return moit_curve_pullback(f, t, c->cull_opaque, ASKED_DEPTHS, c->depths, seed, out, &run);
    }
}

static void *draw_seeds(hostile_case *c) {
    int64_t count = c->r.f.pixels * (ASKED_DEPTHS > 4 ? ASKED_DEPTHS : 4);
    if (count < c->r.count) count = c->r.count;
    void *seed = numbers(c, count);
    for (int64_t k = 0; k < count; ++k)
        set_number(c->r.f.precision, seed, k, 2.0 * share_of(&c->random) - 1.0);
    return seed;
}

static double *doubles(int64_t count) { return answer_room(count, sizeof(double)); }

static void expect_doubles(const hostile_case *c, const char *what, const double *x,
                           int64_t count) {
    for (int64_t k = 0; k < count; ++k)
        if (!isfinite(x[k])) {
            broken(c, what, x[k], 0.0);
            return;
        }
}

static void ask_for_derivatives(hostile_case *c) {
    static const char *const what[OF_ALL] = {"by a picture", "by transmittances", "by totals",
                                             "by curves"};
    const moit_technique *t = &c->technique;
    if (!moit_has_gradient(t->kind) || moit_gradient_refusal(t)) return;
    bool per_pixel = one_in(&c->random, 2), coloured = c->r.f.transmission;
    int64_t n = c->r.count, backgrounds = per_pixel ? 3 * c->r.f.pixels : 3;
    int64_t weights = moit_network_weights(t);
    void *seed = draw_seeds(c);
    double *background = doubles(backgrounds);
    for (int64_t k = 0; k < backgrounds; ++k) background[k] = share_of(&c->random);
    for (int of = 0; of < OF_ALL; ++of) {
        if (of == OF_CURVES && !moit_facts_of(t->kind).has_curve) continue;
        const moit_gradients out = {
            .depth = numbers(c, n),
            .alpha = numbers(c, n),
            .color = numbers(c, 3 * n),
            .transmission = coloured ? numbers(c, 3 * n) : NULL,
            .background = of == OF_PICTURES ? doubles(backgrounds) : NULL,
            .network = weights ? doubles(weights) : NULL,
        };
        expect_ok(c, what[of], pull_back(c, of, seed, background, per_pixel, &out));
        expect_within(c, what[of], out.depth, n, -DBL_MAX, DBL_MAX);
        expect_within(c, what[of], out.alpha, n, -DBL_MAX, DBL_MAX);
        expect_within(c, what[of], out.color, 3 * n, -DBL_MAX, DBL_MAX);
        expect_within(c, what[of], out.transmission, coloured ? 3 * n : 0, -DBL_MAX, DBL_MAX);
        expect_doubles(c, what[of], out.background, of == OF_PICTURES ? backgrounds : 0);
        expect_doubles(c, what[of], out.network, weights);
        free(out.depth);
        free(out.alpha);
        free(out.color);
        free(out.transmission);
        free(out.background);
        free(out.network);
    }
    free(background);
    free(seed);
}

#endif
