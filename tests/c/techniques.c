/* Known pixels by every technique, curves, bounds, opaque surfaces, and images that are nearly
 * nothing or too much. */
#include "expect.h"

static const double blue[3] = {0.0, 0.0, 1.0};

/* Red 1/2 in front of green 1/4, which arrives later. */
static rays red_before_green(moit_precision precision) {
    rays r = empty_rays(precision, 1, (int64_t[]){2});
    put_fragment(&r, 0, 1.0, 0.5, 1.0, 0.0, 0.0);
    put_fragment(&r, 1, 2.0, 0.25, 0.0, 1.0, 0.0);
    r.f.far = 2.0;
    return r;
}

static void expect_pixel(moit_precision precision, const rays *r, moit_technique technique,
                         const double needed[4], double tolerance) {
    double found[4] = {NOT_A_NUMBER, NOT_A_NUMBER, NOT_A_NUMBER, NOT_A_NUMBER};
    moit_run run = plain_run();
    EXPECT(moit_composite(&r->f, &technique, true, blue, false, found, &run) == MOIT_OK);
    for (int c = 0; c < 4; ++c) EXPECT_NEAR(number(precision, found, c), needed[c], tolerance);
}

static void two_fragments_composite_as_the_papers_say(moit_precision precision) {
    rays r = red_before_green(precision);
    double unit = 4.0 * epsilon(precision);
    expect_pixel(precision, &r, simple(MOIT_SORTED), (double[]){.5, .125, .375, .625}, unit);
    expect_pixel(precision, &r, simple(MOIT_ALPHA_BLEND), (double[]){.375, .25, .375, .625}, unit);
    expect_pixel(precision, &r, simple(MOIT_WEIGHTED_SUM), (double[]){.5, .25, .25, .75}, unit);
    /* two layers of 3/8 hide 39/64, two parts red and one green */
    expect_pixel(precision, &r, simple(MOIT_WEIGHTED_AVERAGE),
                 (double[]){39.0 / 96.0, 39.0 / 192.0, 25.0 / 64.0, 39.0 / 64.0}, unit);
    double weights[2];
    set_number(precision, weights, 0, 3.0);
    set_number(precision, weights, 1, 1.0);
    moit_technique given = weighted(MOIT_WEIGHT_GIVEN);
    given.weighted.weights = weights;
    expect_pixel(precision, &r, given, (double[]){.625 * 6.0 / 7.0, .625 / 7.0, .375, .625}, unit);
    /* Two surfaces are known exactly from four moments, when a fragment does not occlude itself;
     * float32 keeps five digits of where they are. */
    for (int count = 4; count <= 8; count += 2) {
        moit_technique exact = power(count, precision);
        exact.moments.bias = 0.0;
        exact.moments.exclude_self = true;
        expect_pixel(precision, &r, exact, (double[]){.5, .125, .375, .625},
                     precision == MOIT_FLOAT64 ? 1e-7 : 1e-4);
    }
    free_rays(&r);
}

static void one_fragment_is_exact_without_chance(moit_precision precision) {
    moit_technique list[MOST_TECHNIQUES];
    int n = all_techniques(precision, list);
    rays r = empty_rays(precision, 1, (int64_t[]){1});
    put_fragment(&r, 0, 3.0, 0.25, 1.0, 0.5, 0.0);
    r.f.near = 2.0;
    r.f.far = 4.0;
    for (int i = 0; i < n; ++i) {
        if (moit_facts_of(list[i].kind).is_random) continue;
        /* a moment technique shades a lone fragment by itself unless told not to, and scales */
        list[i].normalize = true;
        double unit = rounding_of(&list[i], precision);
        expect_pixel(precision, &r, list[i], (double[]){.25, .125, .75, .25}, unit);
    }
    free_rays(&r);
}

/* Half a surface that passes all red, half of the green and no blue takes away a quarter of the
 * light behind it, and adds its own as ever. With alpha 1 it hides what is behind in blue alone. */
static void filters_dim_each_channel_by_its_own(moit_precision precision) {
    moit_technique list[MOST_TECHNIQUES];
    int n = all_techniques(precision, list);
    rays r = empty_rays(precision, 1, (int64_t[]){1});
    double transmission[3], total[3];
    set_number(precision, transmission, 0, 1.0);
    set_number(precision, transmission, 1, 0.5);
    set_number(precision, transmission, 2, 0.0);
    r.f.transmission = transmission;
    r.f.near = 2.0;
    r.f.far = 4.0;
    moit_run run = plain_run();
    for (int i = 0; i < n; ++i) {
        if (!moit_facts_of(list[i].kind).takes_transmission) continue;
        double unit = rounding_of(&list[i], precision);
        list[i].normalize = true;
        put_fragment(&r, 0, 3.0, 0.5, 1.0, 0.5, 0.0);
        expect_pixel(precision, &r, list[i], (double[]){.5, .25, .5, .25}, unit);
        put_fragment(&r, 0, 3.0, 1.0, 1.0, 0.5, 0.25);
        EXPECT(moit_total_transmittance(&r.f, &list[i], true, total, &run) == MOIT_OK);
        EXPECT_NEAR(number(precision, total, 0), 1.0, unit);
        EXPECT_NEAR(number(precision, total, 1), 0.5, unit);
        EXPECT_NEAR(number(precision, total, 2), 0.0, unit);
        expect_pixel(precision, &r, list[i], (double[]){1.0, .5, .25, .5}, unit);
    }
    free_rays(&r);
}

static void opaque_fragments_hide_what_is_behind(moit_precision precision) {
    rays r = empty_rays(precision, 1, (int64_t[]){4});
    put_fragment(&r, 0, 5.0, 1.0, 9.0, 9.0, 9.0);
    put_fragment(&r, 1, 4.0, 0.5, 9.0, 9.0, 9.0);
    put_fragment(&r, 2, 3.0, 1.0, 0.0, 1.0, 0.0);
    put_fragment(&r, 3, 1.0, 0.5, 1.0, 0.0, 0.0);
    r.f.far = 5.0;
    moit_technique list[MOST_TECHNIQUES];
    int n = all_techniques(precision, list);
    moit_run run = plain_run();
    for (int i = 0; i < n; ++i) {
        bool by_chance = moit_facts_of(list[i].kind).is_random;
        double unit = rounding_of(&list[i], precision);
        list[i].normalize = true;
        if (!by_chance) expect_pixel(precision, &r, list[i], (double[]){.5, .5, 0.0, 1.0}, unit);
        double T[4], lower[4], upper[4], total[1];
        EXPECT(moit_transmittance(&r.f, &list[i], true, T, &run) == MOIT_OK);
        EXPECT(moit_bounds(&r.f, &list[i], true, lower, upper, &run) == MOIT_OK);
        EXPECT(moit_total_transmittance(&r.f, &list[i], true, total, &run) == MOIT_OK);
        EXPECT(number(precision, total, 0) == 0.0);
        for (int k = 0; k < 2; ++k) {
            EXPECT(number(precision, T, k) == 0.0);
            EXPECT(number(precision, lower, k) == 0.0);
        }
        if (!by_chance) EXPECT_NEAR(number(precision, T, 2), 0.5, unit);
        EXPECT(number(precision, lower, 2) <= 0.5 && number(precision, upper, 2) >= 0.5);
    }
    free_rays(&r);
}

/* A curve counts what is strictly nearer; a wall shows itself and hides what is behind. */
static void curves_step_behind_their_fragments(moit_precision precision) {
    rays r = red_before_green(precision);
    const double depth[] = {1.0, 1.5, 2.0, 2.5}, through[] = {1.0, .5, .5, .375};
    moit_technique sorted = simple(MOIT_SORTED);
    moit_run run = plain_run();
    double curve[4];
    EXPECT(moit_curve(&r.f, &sorted, true, 4, depth, curve, &run) == MOIT_OK);
    for (int k = 0; k < 4; ++k) EXPECT(number(precision, curve, k) == through[k]);
    put_fragment(&r, 1, 2.0, 1.0, 0.0, 1.0, 0.0);
    EXPECT(moit_curve(&r.f, &sorted, true, 4, depth, curve, &run) == MOIT_OK);
    EXPECT(number(precision, curve, 2) == .5 && number(precision, curve, 3) == 0.0);
    free_rays(&r);
}

static void equal_depths_composite_in_arrival_order(moit_precision precision) {
    rays r = red_before_green(precision);
    set_number(precision, r.depth, 0, 2.0);
    r.f.near = 2.0;
    expect_pixel(precision, &r, simple(MOIT_SORTED), (double[]){.5, .125, .375, .625},
                 4.0 * epsilon(precision));
    free_rays(&r);
}

static void curves_stay_between_the_total_and_one(moit_precision precision) {
    rays r = random_rays(precision, (kind_of_rays){700, 12, 0.5, 8.0, 0.8, 0.0, 3});
    enum { DEPTHS = 33 };
    double depth[DEPTHS];
    for (int k = 0; k < DEPTHS; ++k) depth[k] = 0.25 * (k + 1); /* beyond the range at both ends */
    void *curve = room(r.f.pixels * DEPTHS, size_of(precision));
    moit_run run = plain_run();
    moit_technique list[MOST_TECHNIQUES];
    int n = all_techniques(precision, list);
    for (int i = 0; i < n; ++i) {
        if (!moit_facts_of(list[i].kind).has_curve) continue;
        bool by_chance = moit_facts_of(list[i].kind).is_random;
        EXPECT(moit_curve(&r.f, &list[i], true, DEPTHS, depth, curve, &run) == MOIT_OK);
        for (int64_t p = 0; p < r.f.pixels; ++p) {
            double total = exact_at(&r, p, 9.0);
            if (rounding_of(&list[i], precision) > 1e-5)
                total -= 12.0 * 0x1p-12; /* a half rounds for each fragment, a key its own */
            if (list[i].kind == MOIT_SLICES || list[i].kind == MOIT_NEURAL_SLICES)
                total *= exp(-12.0 * 5.6 / 255.0);        /* so do codes */
            if (list[i].kind == MOIT_AVBOIT) total = 0.0; /* nor does it know what is in front */
            for (int k = 0; k < DEPTHS; ++k) {
                double T = number(precision, curve, p * DEPTHS + k);
                EXPECT(T >= (by_chance ? 0.0 : total * (1.0 - 1e-5)) && T <= 1.0);
                if (depth[k] < r.f.near) EXPECT(T == 1.0);
                if (list[i].kind == MOIT_SORTED)
                    EXPECT_NEAR(T, exact_at(&r, p, depth[k]), epsilon(precision));
            }
        }
    }
    free(curve);
    free_rays(&r);
}

/* What is proved about the transmittance in front of a depth is never wrong. */
static void bounds_contain_the_exact_transmittance(moit_precision precision) {
    rays r = random_rays(precision, (kind_of_rays){1500, 16, 0.5, 8.0, 1.0, 0.02, 4});
    enum { DEPTHS = 9 };
    const double depth[DEPTHS] = {0.1, 0.5, 0.75, 1.0, 2.0, 3.5, 6.0, 8.0, 9.0};
    int64_t points = r.f.pixels * DEPTHS;
    double *lower = room(points > r.count ? points : r.count, sizeof(double));
    double *upper = room(points > r.count ? points : r.count, sizeof(double));
    moit_technique list[MOST_TECHNIQUES];
    int n = all_techniques(precision, list);
    moit_run run = plain_run();
    for (int i = 0; i < n; ++i) {
        EXPECT(moit_bounds(&r.f, &list[i], true, lower, upper, &run) == MOIT_OK);
        for (int64_t p = 0; p < r.f.pixels; ++p)
            for (int64_t k = r.offsets[p]; k < r.offsets[p + 1]; ++k) {
                double exact = exact_at(&r, p, number(precision, r.depth, k));
                EXPECT(number(precision, lower, k) <= exact);
                EXPECT(number(precision, upper, k) >= exact);
            }
        if (!moit_facts_of(list[i].kind).has_curve) continue;
        EXPECT(moit_curve_bounds(&r.f, &list[i], true, DEPTHS, depth, lower, upper, &run)
               == MOIT_OK);
        for (int64_t k = 0; k < points; ++k) {
            double exact = exact_at(&r, k / DEPTHS, depth[k % DEPTHS]);
            EXPECT(number(precision, lower, k) <= exact);
            EXPECT(number(precision, upper, k) >= exact);
        }
    }
    free(lower);
    free(upper);
    free_rays(&r);
}

/* With no pixels nothing is written; with no fragments there is nothing but background. */
static void nothing_is_transparent(moit_precision precision, int64_t pixels) {
    rays r = empty_rays(precision, pixels, (int64_t[3]){0});
    const double depth[2] = {0.5, 2.0};
    moit_technique list[MOST_TECHNIQUES];
    int n = all_techniques(precision, list);
    moit_run run = plain_run();
    run.threads = 4;
    for (int i = 0; i < n; ++i) {
        double image[12], total[3], curve[6], lower[6], upper[6];
        for (int k = 0; k < 6; ++k) curve[k] = lower[k] = upper[k] = total[k / 2] = NOT_A_NUMBER;
        EXPECT(moit_composite(&r.f, &list[i], true, blue, false, image, &run) == MOIT_OK);
        EXPECT(moit_total_transmittance(&r.f, &list[i], true, total, &run) == MOIT_OK);
        EXPECT(moit_transmittance(&r.f, &list[i], true, curve, &run) == MOIT_OK);
        EXPECT(moit_bounds(&r.f, &list[i], true, lower, upper, &run) == MOIT_OK);
        for (int64_t p = 0; p < pixels; ++p) {
            EXPECT(number(precision, total, p) == 1.0);
            for (int c = 0; c < 4; ++c)
                EXPECT(number(precision, image, 4 * p + c) == (c == 2 ? 1.0 : 0.0));
        }
        if (!moit_facts_of(list[i].kind).has_curve) continue;
        EXPECT(moit_curve(&r.f, &list[i], true, 2, depth, curve, &run) == MOIT_OK);
        EXPECT(moit_curve_bounds(&r.f, &list[i], true, 2, depth, lower, upper, &run) == MOIT_OK);
        for (int64_t k = 0; k < 2 * pixels; ++k) {
            EXPECT(number(precision, curve, k) == 1.0);
            EXPECT(number(precision, lower, k) <= 1.0 && number(precision, upper, k) == 1.0);
        }
        EXPECT(moit_curve(&r.f, &list[i], true, 0, depth, curve, &run) == MOIT_OK);
    }
    free_rays(&r);
}

/* Others sum, average or leave out, or hold what is left in numbers of the fragments' precision. */
static bool multiplies_up_in_double(moit_kind kind) {
    /* whole numbers and half floats lose what is much thinner than one of their steps */
    bool in_steps =
        kind == MOIT_AVBOIT || kind == MOIT_SLICES || kind == MOIT_ANCHORS || kind == MOIT_STRONG;
    return kind != MOIT_WEIGHTED_SUM && kind != MOIT_WEIGHTED_AVERAGE && kind != MOIT_DEPTH_PEELING
           && kind != MOIT_HYBRID && kind != MOIT_ADAPTIVE && kind != MOIT_MLAB && !in_steps;
}

/* A pixel that no tile was made for, between small ones. */
static void one_pixel_may_hold_a_hundred_thousand_fragments(moit_precision precision) {
    enum { MANY = 100000 };
    rays r = empty_rays(precision, 3, (int64_t[]){1, MANY, 1});
    uint64_t state = 5;
    for (int64_t i = 0; i < r.count; ++i) {
        double depth = 1.0 + 8.0 * next_random(&state), alpha = 5e-5 * next_random(&state);
        put_fragment(&r, i, depth, alpha, next_random(&state), 0.5, 1.0);
    }
    r.f.far = 9.0;
    int64_t *order = room(r.count, sizeof *order);
    double *exact = room(r.count, sizeof *exact);
    void *T = room(r.count, size_of(precision));
    double *lower = room(r.count, sizeof *lower), *upper = room(r.count, sizeof *upper);
    moit_run run = plain_run();
    EXPECT(moit_depth_order(&r.f, order, &run) == MOIT_OK);
    double total[3] = {1.0, 1.0, 1.0};
    for (int p = 0; p < 3; ++p)
        for (int64_t k = r.offsets[p]; k < r.offsets[p + 1]; ++k) {
            exact[order[k]] = total[p];
            total[p] *= 1.0 - number(precision, r.alpha, order[k]);
        }
    moit_technique list[MOST_TECHNIQUES];
    int n = all_techniques(precision, list);
    for (int i = 0; i < n; ++i) {
        bool sorted = list[i].kind == MOIT_SORTED;
        EXPECT(moit_transmittance(&r.f, &list[i], true, T, &run) == MOIT_OK);
        EXPECT(moit_bounds(&r.f, &list[i], true, lower, upper, &run) == MOIT_OK);
        for (int64_t k = 0; k < r.count; ++k) {
            EXPECT(isfinite(number(precision, T, k)));
            if (sorted) EXPECT_NEAR(number(precision, T, k), exact[k], 2.0 * epsilon(precision));
            EXPECT(number(precision, lower, k) <= exact[k] * (1.0 + 1e-10));
            EXPECT(number(precision, upper, k) >= exact[k] * (1.0 - 1e-10));
        }
        if (!multiplies_up_in_double(list[i].kind)) continue;
        if (moit_facts_of(list[i].kind).is_random) continue;
        double through[3];
        EXPECT(moit_total_transmittance(&r.f, &list[i], true, through, &run) == MOIT_OK);
        /* as many roundings of a double as factors; b0 of 2.5, and absorbances, in the precision */
        for (int p = 0; p < 3; ++p)
            EXPECT_NEAR(number(precision, through, p), total[p],
                        MANY * 0x1p-53 + 8.0 * epsilon(precision));
    }
    free(order);
    free(exact);
    free(T);
    free(lower);
    free(upper);
    free_rays(&r);
}

/* More than any memory holds is refused before anything is written. */
static void too_many_depths_are_refused(void) {
    rays r = red_before_green(MOIT_FLOAT32);
    moit_run run = plain_run();
    moit_technique sorted = simple(MOIT_SORTED), power4 = power(4, MOIT_FLOAT32);
    double depth = 1.0;
    float b[4] = {0}, one = 0.5f, out;
    EXPECT(moit_curve(&r.f, &sorted, true, (int64_t)1 << 40, &depth, &out, &run) == MOIT_NO_MEMORY);
    EXPECT(moit_moments_transmittance(&power4, MOIT_FLOAT32, 1, (int64_t)1 << 40, &one, b, &one,
                                      &out, &run)
           == MOIT_NO_MEMORY);
    free_rays(&r);
}

/* A picture of four by one pixels: nothing drawn in full, the two fragments in squares of two. */
static void pictures_of_sums_are_joined(moit_precision precision) {
    rays r = empty_rays(precision, 2, (int64_t[]){2, 0});
    put_fragment(&r, 0, 1.0, 0.5, 1.0, 0.0, 0.0);
    put_fragment(&r, 1, 2.0, 0.25, 0.0, 1.0, 0.0);
    r.f.far = 2.0;
    moit_technique sum = simple(MOIT_WEIGHTED_SUM), sorted = simple(MOIT_SORTED);
    moit_run run = plain_run();
    double small_sums[2 * MOIT_TARGET_SUMS], sums[4 * MOIT_TARGET_SUMS] = {0}, behind[12] = {0};
    float near[4] = {0.25f, 0.25f, 1.0f, 1.0f}, out[16];
    EXPECT(moit_has_target_sums(&sum) && !moit_has_target_sums(&sorted));
    EXPECT(moit_target_sums(&r.f, &sum, small_sums, &run) == MOIT_OK);
    for (int c = 0; c < MOIT_TARGET_SUMS; ++c) {
        EXPECT_NEAR(small_sums[c], ((double[]){.5, .25, 0.0, .75, 2.0})[c], 0.0);
        EXPECT_NEAR(small_sums[MOIT_TARGET_SUMS + c], 0.0, 0.0);
    }
    moit_target_picture whole = {4, 1, 1, sums, near},
                        small = {2, 1, 2, small_sums, (float[]){0.25f, 1.0f}};
    EXPECT(moit_join_targets(&sum, &whole, 1, &small, false, behind, out, &run) == MOIT_OK);
    /* three and one quarter of the first square's, between the two middles */
    for (int p = 0; p < 4; ++p)
        EXPECT_NEAR((double)out[4 * p], 0.5 * ((double[]){1.0, .75, .25, 0.0})[p], 1e-7);
    EXPECT_NEAR((double)out[3], 1.0, 0.0); /* opaque */
    EXPECT_NEAR((double)out[11], 0.25 * .75, 1e-7);
    EXPECT(moit_join_targets(&sum, &whole, 1, &small, true, behind, out, &run) == MOIT_OK);
    /* nearly all of the square with the same surface */
    EXPECT(out[4] > 0.49f && out[8] < 0.01f);
    free_rays(&r);
}

int main(void) {
    FOR_BOTH_PRECISIONS(precision) {
        two_fragments_composite_as_the_papers_say(precision);
        filters_dim_each_channel_by_its_own(precision);
        one_fragment_is_exact_without_chance(precision);
        opaque_fragments_hide_what_is_behind(precision);
        curves_step_behind_their_fragments(precision);
        equal_depths_composite_in_arrival_order(precision);
        curves_stay_between_the_total_and_one(precision);
        bounds_contain_the_exact_transmittance(precision);
        nothing_is_transparent(precision, 0);
        nothing_is_transparent(precision, 3);
        one_pixel_may_hold_a_hundred_thousand_fragments(precision);
        pictures_of_sums_are_joined(precision);
    }
    too_many_depths_are_refused();
    return verdict();
}
