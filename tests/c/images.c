/* Errors of images whose errors are known. */
#include "expect.h"

#include "moit_errors.h"

enum { HEIGHT = 21, WIDTH = 34 };

/* Channel c of pixel i is `base` plus a pattern; a fourth channel holds what must not be read. */
static void *pattern(moit_precision precision, int channels, double base) {
    void *pixels = room(HEIGHT * WIDTH * channels, size_of(precision));
    for (int64_t i = 0; i < HEIGHT * WIDTH; ++i)
        for (int c = 0; c < channels; ++c)
            set_number(precision, pixels, i * channels + c,
                       c == 3 ? 1e6 * (double)i : base + 0.125 * (double)((i * 7 + c) % 5));
    return pixels;
}

typedef struct {
    const char *name;
    moit_image_error *error;
    double equal,
        apart; /* of images that are equal, and 1/4 apart everywhere; NOT_A_NUMBER: not known */
} known_error;

static void errors_are_what_they_are_defined_to_be(moit_precision precision) {
    const known_error errors[] = {
        {"mse", moit_mse, 0.0, 0.0625},
        {"rmse", moit_rmse, 0.0, 0.25},
        {"mae", moit_mae, 0.0, 0.25},
        {"psnr", moit_psnr, INFINITE, 20.0 * log10(4.0)},
        {"ssim", moit_ssim, 1.0, NOT_A_NUMBER},
        {"flip", moit_flip, 0.0, NOT_A_NUMBER},
        {"hdr_flip", moit_hdr_flip, 0.0, NOT_A_NUMBER},
    };
    void *rgb = pattern(precision, 3, 0.125), *rgba = pattern(precision, 4, 0.125);
    void *apart = pattern(precision, 3, 0.375);
    void *map = room(HEIGHT * WIDTH, size_of(precision));
    const moit_image image = {rgb, HEIGHT, WIDTH, 3, precision};
    const moit_image with_alpha = {rgba, HEIGHT, WIDTH, 4, precision};
    const moit_image brighter = {apart, HEIGHT, WIDTH, 3, precision};
    moit_run run = {.threads = 2, .isa = moit_isa_best()};
    for (size_t i = 0; i < sizeof errors / sizeof *errors; ++i) {
        const known_error *e = &errors[i];
        double error = NOT_A_NUMBER;
        EXPECT(e->error(&image, &with_alpha, map, &error, &run) == MOIT_OK);
        /* ssim divides, flip takes roots of differences that round */
        if (isinf(e->equal)) EXPECT(error == e->equal);
        else EXPECT_NEAR(error, e->equal, 1e-9);
        for (int64_t k = 0; k < HEIGHT * WIDTH; ++k)
            EXPECT(number(precision, map, k) == e->equal
                   || fabs(number(precision, map, k) - e->equal) <= 1e-6);
        EXPECT(e->error(&brighter, &image, NULL, &error, &run) == MOIT_OK);
        if (isnan(e->apart)) {
            EXPECT(error > 0.0 && error < 1.0);
            continue;
        }
        EXPECT_NEAR(error, e->apart, 1e-12 * fabs(e->apart));
        EXPECT(e->error(&brighter, &image, map, &error, &run) == MOIT_OK);
        for (int64_t k = 0; k < HEIGHT * WIDTH; ++k)
            EXPECT_NEAR(number(precision, map, k), e->apart, 4.0 * epsilon(precision) * e->apart);
    }
    moit_reference *reference = moit_reference_of(&image, 1 << 22);
    EXPECT(reference != NULL);
    for (int again = 0; again < 2; ++again) {
        bool wanted[MOIT_METRICS];
        double found[MOIT_METRICS];
        for (int i = 0; i < MOIT_METRICS; ++i) wanted[i] = true;
        EXPECT(moit_errors(&brighter, reference, wanted, found, &run) == MOIT_OK);
        for (int i = 0; i < MOIT_METRICS; ++i) {
            double error = NOT_A_NUMBER;
            EXPECT(errors[i].error(&brighter, &image, NULL, &error, &run) == MOIT_OK);
            EXPECT(found[i] == error);
        }
    }
    moit_free_reference(reference);
    free(rgb);
    free(rgba);
    free(apart);
    free(map);
}

int main(void) {
    FOR_BOTH_PRECISIONS(precision) errors_are_what_they_are_defined_to_be(precision);
    return verdict();
}
