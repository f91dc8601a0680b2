/* Moments in words of 16 bits: what a tile's fragments leave in them, and what that proves. */
#include "core/elementary.h"
#include "core/techniques/moments.h"
#include "core/techniques/table.h"

#include <math.h>

bool moit_stores_words(const moit_technique *technique) {
    const moit_moment_family *family = moit_family_of(technique);
    return family && !family->state && technique->moments.bits == 16;
}

uint16_t *moit_moment_words(const moit_tile *tile) { return (uint16_t *)(void *)tile->own; }

size_t moit_moments_scratch(const moit_job *job, int fragments, int pixels) {
    (void)fragments;
    return moit_stores_words(job->technique) ? (size_t)pixels * MOIT_MOST_NUMBERS * sizeof(uint16_t)
                                             : 0;
}

void moit_moments_gather_words(const moit_job *job, moit_tile *tile) {
    const moit_technique *technique = job->technique;
    moit_precision precision = job->fragments->precision;
    int family = moit_family_of(technique)->stages, count = technique->count;
    uint16_t *words = moit_moment_words(tile);
    job->stages->moments[family].words(count, &job->zone, technique->moments.b0_is_half,
                                       tile->pixels, tile->offsets, tile->absorbance, tile->z,
                                       words, tile->b0);
    for (int p = 0; p < tile->pixels; ++p) tile->double_b0[p] = moit_number(precision, tile->b0, p);
    job->precise->moments[family].decoded(count, tile->pixels, words, tile->double_b0,
                                          tile->double_b);
    int64_t numbers = (int64_t)tile->pixels * moit_moment_numbers(technique);
    for (int64_t i = 0; i < numbers; ++i) moit_set_number(precision, tile->b, i, tile->double_b[i]);
}

/* For sums of up to some thousand fragments. */
enum { ASSUMED_FRAGMENTS = 4096 };

/* Words are rounded at every fragment, by as much as they hold of it where there are many: of them
 * nothing follows. b0 never falls, so that every sum that was rounded to it was at most as large.
 */
void moit_moment_words_bounds(const moit_technique *technique, moit_precision precision,
                              int64_t pixels, int64_t depths, const void *b0, const void *alpha,
                              void *lower, void *upper) {
    double max_alpha = moit_held_max_alpha(precision, technique->max_alpha);
    bool half = technique->moments.b0_is_half || moit_stores_halves(technique);
    double unit = half ? 0x1p-11 : 0x1p-24, least = 0x1p-25;       /* below normal halves */
    double digits = precision == MOIT_FLOAT64 ? 0x1p-50 : 0x1p-21; /* of an absorbance */
    for (int64_t p = 0; p < pixels; ++p) {
        double most = moit_number(precision, b0, p);
        most += ASSUMED_FRAGMENTS * (unit * most + (half ? least : 0.0));
        for (int64_t i = p * depths; i < (p + 1) * depths; ++i) {
            double own =
                alpha ? -moit_log1p(-fmin(moit_number(precision, alpha, i), max_alpha)) : 0.0;
            double low =
                most > 0.0 ? moit_exp(-fmax(most - own, 0.0) - digits * (most + own)) : 1.0;
            moit_set_bounds(precision, lower, upper, i, low, 1.0);
        }
    }
}
