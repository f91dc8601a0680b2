/* Shadow maps: sums that add up, filtered and read between texels. */
#include "expect.h"

enum { WIDTH = 13, HEIGHT = 9, PIXELS = WIDTH * HEIGHT, TAPS = 5, POINTS = 700 };
static const double weights[TAPS] = {0.1, 0.2, 0.4, 0.2, 0.1};

static moit_technique moments(void) {
    moit_technique technique = {.kind = MOIT_POWER_MOMENTS, .count = 6, .warp = MOIT_WARP_LINEAR};
    technique.max_alpha = 0.998;
    technique.moments = (moit_moment_options){.bits = 32, .bias = 1e-12};
    return technique;
}

static moit_technique fourier(void) {
    moit_technique technique = moments();
    technique.kind = MOIT_FOURIER_OPACITY;
    technique.count = 7;
    technique.series = (moit_series_options){.bits = 32};
    return technique;
}

static moit_texels sums_of(const rays *r, const moit_technique *technique, void *sums) {
    moit_run run = plain_run();
    EXPECT(moit_texel_sums(&r->f, technique, sums, &run) == MOIT_OK);
    return (moit_texels){r->f.precision, WIDTH, HEIGHT, moit_texel_numbers(technique), sums};
}

static rays some_rays(moit_precision precision) {
    return random_rays(precision, (kind_of_rays){PIXELS, 6, 1.0, 9.0, 0.7, 0.0, 5});
}

static void sums_add_up(moit_precision precision) {
    rays r = some_rays(precision);
    moit_technique technique = moments();
    EXPECT(moit_texel_numbers(&technique) == 7);
    void *sums = room(7 * PIXELS, size_of(precision));
    sums_of(&r, &technique, sums);
    for (int64_t p = 0; p < PIXELS; ++p) {
        double expected[7] = {0};
        for (int64_t i = r.offsets[p]; i < r.offsets[p + 1]; ++i) {
            double a = -log1p(-number(precision, r.alpha, i)),
                   z = (number(precision, r.depth, i) - 5.0) / 4.0;
            for (int k = 0; k < 7; ++k, a *= z) expected[k] += a;
        }
        for (int k = 0; k < 7; ++k)
            EXPECT_NEAR(number(precision, sums, 7 * p + k), expected[k], 64 * epsilon(precision));
    }
    free(sums);
    free_rays(&r);
}

static void filters_are_sums_of_neighbours(moit_precision precision) {
    rays r = some_rays(precision);
    moit_technique technique = fourier();
    void *sums = room(7 * PIXELS, size_of(precision)), *out = room(7 * PIXELS, size_of(precision));
    moit_texels texels = sums_of(&r, &technique, sums);
    moit_run run = plain_run();
    EXPECT(moit_filter_texels(&texels, TAPS, weights, out, &run) == MOIT_OK);
    for (int y = 0; y < HEIGHT; ++y)
        for (int x = 0; x < WIDTH; ++x)
            for (int k = 0; k < 7; ++k) {
                double expected = 0.0;
                for (int i = 0; i < TAPS; ++i)
                    for (int j = 0; j < TAPS; ++j) {
                        int row = y + i - 2 < 0 ? 0 : y + i - 2 < HEIGHT ? y + i - 2 : HEIGHT - 1;
                        int column = x + j - 2 < 0 ? 0 : x + j - 2 < WIDTH ? x + j - 2 : WIDTH - 1;
                        expected += weights[i] * weights[j]
                                    * number(precision, sums, 7 * (row * WIDTH + column) + k);
                    }
                EXPECT_NEAR(number(precision, out, 7 * (y * WIDTH + x) + k), expected,
                            64 * epsilon(precision));
            }
    free(out);
    free(sums);
    free_rays(&r);
}

/* In a texel's middle, unfiltered, it is the curve of the pixel. */
static void middles_of_texels_are_curves(const moit_technique *technique) {
    rays r = some_rays(MOIT_FLOAT64);
    r.f.width = WIDTH;
    double *sums = room(moit_texel_numbers(technique) * PIXELS, sizeof *sums);
    moit_texels texels = sums_of(&r, technique, sums);
    const double depth[4] = {0.5, 3.0, 6.5, 9.5};
    double *curve = room(4 * PIXELS, sizeof *curve), *place = room(12 * PIXELS, sizeof *place),
           *found = room(4 * PIXELS, sizeof *found);
    moit_run run = plain_run();
    EXPECT(moit_curve(&r.f, technique, false, 4, depth, curve, &run) == MOIT_OK);
    for (int64_t i = 0; i < 4 * PIXELS; ++i) {
        place[3 * i] = 0.5 + (double)(i / 4 % WIDTH);
        place[3 * i + 1] = 0.5 + (double)(i / 4 / WIDTH);
        place[3 * i + 2] = depth[i % 4];
    }
    run.threads = 3;
    EXPECT(moit_shadow_at(&texels, technique, 1.0, 9.0, false, 4 * PIXELS, place, NULL, found, &run)
           == MOIT_OK);
    for (int64_t i = 0; i < 4 * PIXELS; ++i) EXPECT_NEAR(found[i], curve[i], 1e-9);
    free(found);
    free(place);
    free(curve);
    free(sums);
    free_rays(&r);
}

static void anything_goes_between(bool opaque) {
    moit_technique technique = moments();
    technique.count = 4;
    int numbers = opaque ? 4 : 5;
    float *sums = room(numbers * PIXELS, sizeof *sums);
    uint64_t state = 3;
    for (int i = 0; i < numbers * PIXELS; ++i)
        sums[i] = i / numbers % 3 ? (float)(2.0 * next_random(&state) - 1.0) : 0.0f;
    for (int p = 0; p < PIXELS && !opaque; ++p) sums[5 * p] = fabsf(sums[5 * p]);
    moit_texels texels = {MOIT_FLOAT32, WIDTH, HEIGHT, numbers, sums};
    double place[3 * POINTS], alpha[POINTS], found[POINTS];
    for (int i = 0; i < POINTS; ++i) {
        place[3 * i] = 20.0 * next_random(&state) - 3.0;
        place[3 * i + 1] = 20.0 * next_random(&state) - 3.0;
        place[3 * i + 2] = 12.0 * next_random(&state) - 1.0;
        alpha[i] = next_random(&state);
    }
    place[0] = place[4] = place[8] = NOT_A_NUMBER;
    place[9] = place[13] = place[17] = INFINITE;
    moit_run run = plain_run();
    EXPECT(moit_shadow_at(&texels, &technique, 1.0, 9.0, opaque, POINTS, place, alpha, found, &run)
           == MOIT_OK);
    for (int i = 0; i < POINTS; ++i) EXPECT(found[i] >= 0.0 && found[i] <= 1.0);
    free(sums);
}

int main(void) {
    FOR_BOTH_PRECISIONS(precision) {
        sums_add_up(precision);
        filters_are_sums_of_neighbours(precision);
    }
    moit_technique power = moments(), series = fourier();
    middles_of_texels_are_curves(&power);
    middles_of_texels_are_curves(&series);
    anything_goes_between(false);
    anything_goes_between(true);
    return verdict();
}
