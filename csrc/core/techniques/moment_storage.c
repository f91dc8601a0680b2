/* What Moment Transparency keeps of moments: numbers, nodes, or words of 16 bits. */
#include "core/techniques/moment_transparency.h"

#include "core/techniques/table.h"
#include "core/threads.h"

void moit_mt_hold(const moit_mt_reader *reader, int pixels, void *b0, void *b) {
    moit_storage storage = reader->technique->transparency.storage;
    if (storage == MOIT_STORAGE_FLOAT) return;
    reader->stages->half_absorbance(pixels, b0, b0);
    if (storage != MOIT_STORAGE_UNORM16) return;
    enum { AT_ONCE = 64 };
    double wide[4 * AT_ONCE];
    for (int64_t first = 0; first < 4 * (int64_t)pixels; first += 4 * AT_ONCE) {
        int numbers =
            (int)(4 * (int64_t)pixels - first < 4 * AT_ONCE ? 4 * pixels - first : 4 * AT_ONCE);
        for (int k = 0; k < numbers; ++k) wide[k] = moit_number(reader->precision, b, first + k);
        reader->precise->unorm16_moments(reader->technique->transparency.symmetric, numbers / 4,
                                         wide, NULL);
        for (int k = 0; k < numbers; ++k) moit_set_number(reader->precision, b, first + k, wide[k]);
    }
}

void moit_mt_read(const moit_mt_reader *reader, int pixels, const void *b, double *double_b,
                  double *rules) {
    moit_moments_read(reader->precise, reader->precision, reader->technique, NULL, reader->bias,
                      pixels, b, double_b, rules);
    if (reader->technique->transparency.storage != MOIT_STORAGE_NONLINEAR) return;
    const double *range = moit_unit_range(reader->technique);
    reader->precise->nonlinear_moments(range[0], range[1] - range[0], pixels, rules, NULL);
}

enum { ITEM_PIXELS = 256 };

typedef struct {
    moit_mt_reader reader;
    int64_t pixels;
    const void *b;
    uint16_t *words;
} words_job;

static moit_status keep_words(void *context, int64_t item, int thread) {
    (void)thread;
    const words_job *job = context;
    const moit_mt_reader *reader = &job->reader;
    int64_t first = item * ITEM_PIXELS;
    int pixels = (int)(job->pixels - first < ITEM_PIXELS ? job->pixels - first : ITEM_PIXELS);
    const char *b = (const char *)job->b + 4 * (size_t)first * moit_scalar_size(reader->precision);
    double double_b[4 * ITEM_PIXELS], words[4 * ITEM_PIXELS],
        rules[ITEM_PIXELS * MOIT_RULE_SIZE(4)];
    if (reader->technique->transparency.storage == MOIT_STORAGE_NONLINEAR) {
        const double *range = moit_unit_range(reader->technique);
        moit_moments_read(reader->precise, reader->precision, reader->technique, NULL, reader->bias,
                          pixels, b, double_b, rules);
        reader->precise->nonlinear_moments(range[0], range[1] - range[0], pixels, rules, words);
    } else {
        for (int k = 0; k < 4 * pixels; ++k) double_b[k] = moit_number(reader->precision, b, k);
        reader->precise->unorm16_moments(reader->technique->transparency.symmetric, pixels,
                                         double_b, words);
    }
    for (int k = 0; k < 4 * pixels; ++k) job->words[4 * first + k] = (uint16_t)words[k];
    return MOIT_OK;
}

moit_status moit_moment_words_kept(const moit_technique *technique, moit_precision precision,
                                   int64_t pixels, const void *b, uint16_t *words,
                                   const moit_run *run) {
    words_job job = {
        .reader = {moit_stages_of(precision, run->isa), moit_stages_of(MOIT_FLOAT64, run->isa),
                   precision, technique, technique->moments.bias},
        .pixels = pixels,
        .b = b,
        .words = words,
    };
    return moit_parallel_for(run, (pixels + ITEM_PIXELS - 1) / ITEM_PIXELS, keep_words, &job);
}
