/* Power moments by themselves: pass 1 and pass 2 are what the questions are made of. */
#include "expect.h"

enum { PIXELS = 900, DEPTHS = 7 };
static const double depth[DEPTHS] = {-1.0, -0.7, -0.1, 0.0, 0.3, 0.9, 1.0};

/* Depth is z already, so that the two ways may be compared bit by bit. */
static moit_technique unwarped(int count, moit_precision precision) {
    moit_technique t = power(count, precision);
    t.warp = MOIT_WARP_NONE;
    return t;
}

typedef struct {
    void *b0, *b, *z; /* (PIXELS), (PIXELS, count), (PIXELS, DEPTHS) */
} state;

static state gathered(const rays *r, const moit_technique *technique) {
    moit_precision precision = r->f.precision;
    state s = {room(PIXELS, size_of(precision)),
               room((int64_t)PIXELS * technique->count, size_of(precision)),
               room(PIXELS * DEPTHS, size_of(precision))};
    moit_run run = plain_run();
    EXPECT(moit_gather(&r->f, technique, true, s.b0, s.b, &run) == MOIT_OK);
    for (int64_t i = 0; i < PIXELS * DEPTHS; ++i) set_number(precision, s.z, i, depth[i % DEPTHS]);
    return s;
}

static void free_state(state *s) {
    free(s->b0);
    free(s->b);
    free(s->z);
}

static void moments_are_weighted_means(const rays *r, const moit_technique *technique,
                                       const state *s) {
    moit_precision precision = r->f.precision;
    for (int64_t p = 0; p < PIXELS; ++p) {
        double b0 = 0.0, b[8] = {0.0};
        for (int64_t i = r->offsets[p]; i < r->offsets[p + 1]; ++i) {
            double part = -log1p(-number(precision, r->alpha, i)), z = 1.0;
            b0 += part;
            for (int k = 0; k < technique->count; ++k)
                b[k] += part * (z *= number(precision, r->depth, i));
        }
        /* an absorbance is good to two roundings; b0 is below 40 */
        EXPECT_NEAR(number(precision, s->b0, p), b0, 4.0 * epsilon(precision) * (b0 + 1e-3));
        for (int k = 0; k < technique->count; ++k)
            EXPECT_NEAR(number(precision, s->b, p * technique->count + k),
                        b0 > 0.0 ? b[k] / b0 : 0.0, 8.0 * epsilon(precision));
    }
}

static void reconstruction_alone_equals_the_curve(const rays *r, const moit_technique *technique,
                                                  const state *s) {
    moit_precision precision = r->f.precision;
    size_t bytes = PIXELS * DEPTHS * size_of(precision);
    void *curve = room(PIXELS * DEPTHS, size_of(precision));
    void *alone = room(PIXELS * DEPTHS, size_of(precision));
    moit_run run = plain_run();
    EXPECT(moit_curve(&r->f, technique, true, DEPTHS, depth, curve, &run) == MOIT_OK);
    EXPECT(moit_moments_transmittance(technique, precision, PIXELS, DEPTHS, s->b0, s->b, s->z,
                                      alone, &run)
           == MOIT_OK);
    EXPECT(!memcmp(curve, alone, bytes));
    free(curve);
    free(alone);
}

/* Every pixel's fragments as its depths, in rows as long as the longest. */
static void reconstruction_alone_equals_the_transmittance(const rays *r,
                                                          const moit_technique *technique,
                                                          const state *s, int most) {
    moit_precision precision = r->f.precision;
    void *z = room((int64_t)PIXELS * most, size_of(precision));
    void *alone = room((int64_t)PIXELS * most, size_of(precision));
    void *T = room(r->count, size_of(precision));
    moit_run run = plain_run();
    for (int64_t p = 0; p < PIXELS; ++p)
        for (int64_t i = r->offsets[p]; i < r->offsets[p + 1]; ++i)
            set_number(precision, z, p * most + i - r->offsets[p], number(precision, r->depth, i));
    EXPECT(moit_transmittance(&r->f, technique, true, T, &run) == MOIT_OK);
    EXPECT(
        moit_moments_transmittance(technique, precision, PIXELS, most, s->b0, s->b, z, alone, &run)
        == MOIT_OK);
    for (int64_t p = 0; p < PIXELS; ++p)
        for (int64_t i = r->offsets[p]; i < r->offsets[p + 1]; ++i)
            EXPECT(number(precision, T, i)
                   == number(precision, alone, p * most + i - r->offsets[p]));
    free(z);
    free(alone);
    free(T);
}

static void bounds_alone_contain_the_exact(const rays *r, const moit_technique *technique,
                                           const state *s) {
    moit_precision precision = r->f.precision;
    void *lower = room(PIXELS * DEPTHS, size_of(precision));
    void *upper = room(PIXELS * DEPTHS, size_of(precision));
    moit_run run = plain_run();
    EXPECT(moit_moments_bounds(technique, precision, PIXELS, DEPTHS, s->b0, s->b, s->z, NULL, lower,
                               upper, &run)
           == MOIT_OK);
    for (int64_t i = 0; i < PIXELS * DEPTHS; ++i) {
        double exact = exact_at(r, i / DEPTHS, number(precision, s->z, i));
        EXPECT(number(precision, lower, i) <= exact && exact <= number(precision, upper, i));
    }
    free(lower);
    free(upper);
}

static void nothing_stored_lets_everything_through(const moit_technique *technique,
                                                   moit_precision precision) {
    double b0 = 0.0, b[8] = {0.0}, z[3], T[3], lower[3], upper[3];
    for (int i = 0; i < 3; ++i) set_number(precision, z, i, i - 1.0);
    moit_run run = plain_run();
    EXPECT(moit_moments_transmittance(technique, precision, 1, 3, &b0, b, z, T, &run) == MOIT_OK);
    EXPECT(moit_moments_bounds(technique, precision, 1, 3, &b0, b, z, NULL, lower, upper, &run)
           == MOIT_OK);
    for (int i = 0; i < 3; ++i) {
        EXPECT(number(precision, T, i) == 1.0);
        EXPECT(number(precision, upper, i) == 1.0);
    }
    EXPECT(moit_moments_transmittance(technique, precision, 0, 3, &b0, b, z, T, &run) == MOIT_OK);
    EXPECT(moit_moments_bounds(technique, precision, 0, 3, &b0, b, z, NULL, lower, upper, &run)
           == MOIT_OK);
}

static void the_least_bias_makes_pivots_positive(const rays *r, const moit_technique *technique,
                                                 const state *s) {
    moit_precision precision = r->f.precision;
    double pivot[PIXELS], needed[PIXELS], other[PIXELS], most = 0.0;
    moit_technique bare = *technique;
    bare.moments.bias = 0.0;
    moit_run run = plain_run();
    EXPECT(moit_moments_pivots(&bare, precision, PIXELS, s->b0, s->b, pivot, &run) == MOIT_OK);
    EXPECT(moit_moments_least_bias(&bare, precision, PIXELS, s->b0, s->b, needed, &run) == MOIT_OK);
    int invalid = 0;
    for (int p = 0; p < PIXELS; ++p) {
        int64_t fragments = r->offsets[p + 1] - r->offsets[p];
        EXPECT((pivot[p] <= 0.0) == (needed[p] > 0.0));
        if (fragments == 0) EXPECT(pivot[p] == 1.0 && needed[p] == 0.0);
        /* so few surfaces that moments determine them: rounding alone, if not magnified */
        else if (fragments <= technique->count / 2)
            EXPECT(pivot[p] <= (precision == MOIT_FLOAT64 ? 1e-12 : 1e-3));
        invalid += pivot[p] <= 0.0;
        most = fmax(most, needed[p]);
    }
    EXPECT(invalid > 0 && most < (precision == MOIT_FLOAT64 ? 1e-12 : 1e-3));
    bare.moments.bias = most;
    EXPECT(moit_moments_pivots(&bare, precision, PIXELS, s->b0, s->b, other, &run) == MOIT_OK);
    for (int p = 0; p < PIXELS; ++p) EXPECT(other[p] > 0.0);
    bare.moments.bias = 0.0;
    for (int isa = 0; isa < MOIT_ISA_COUNT; ++isa) {
        if (!moit_isa_supported((moit_isa)isa)) continue;
        run = (moit_run){.threads = 1 + isa, .isa = (moit_isa)isa};
        EXPECT(moit_moments_pivots(&bare, precision, PIXELS, s->b0, s->b, other, &run) == MOIT_OK);
        EXPECT(!memcmp(pivot, other, sizeof pivot));
        EXPECT(moit_moments_least_bias(&bare, precision, PIXELS, s->b0, s->b, other, &run)
               == MOIT_OK);
        EXPECT(!memcmp(needed, other, sizeof needed));
    }
}

static void trigonometric_pivots_too(const rays *r) {
    moit_precision precision = r->f.precision;
    for (int count = 2; count <= 4; ++count) {
        moit_technique technique = unwarped(4, precision);
        technique.kind = MOIT_TRIGONOMETRIC_MOMENTS;
        technique.count = count;
        technique.moments.wrapping_zone = 0.3;
        state s = {room(PIXELS, size_of(precision)), room(PIXELS * 2 * 4, size_of(precision)),
                   NULL};
        moit_run run = plain_run();
        EXPECT(moit_moment_set(&technique) == 2 * count);
        EXPECT(moit_gather(&r->f, &technique, true, s.b0, s.b, &run) == MOIT_OK);
        the_least_bias_makes_pivots_positive(r, &technique, &s);
        free_state(&s);
    }
}

int main(void) {
    enum { MOST = 12 };
    FOR_BOTH_PRECISIONS(precision) {
        rays r = random_rays(precision, (kind_of_rays){PIXELS, MOST, -1.0, 1.0, 0.95, 0.0, 6});
        for (int count = 4; count <= 8; count += 2) {
            moit_technique technique = unwarped(count, precision);
            state s = gathered(&r, &technique);
            moments_are_weighted_means(&r, &technique, &s);
            reconstruction_alone_equals_the_curve(&r, &technique, &s);
            reconstruction_alone_equals_the_transmittance(&r, &technique, &s, MOST);
            bounds_alone_contain_the_exact(&r, &technique, &s);
            the_least_bias_makes_pivots_positive(&r, &technique, &s);
            nothing_stored_lets_everything_through(&technique, precision);
            free_state(&s);
        }
        trigonometric_pivots_too(&r);
        free_rays(&r);
    }
    return verdict();
}
