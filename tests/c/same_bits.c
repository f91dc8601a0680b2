/* Answers are the same bits for every number of threads and every instruction set, and for callers
 * that call at once. This is the program to run under a thread sanitizer. */
#include <pthread.h>

#include "asked.h"

/* Two items of work at least for a pool: no grain is of more than 2048 pixels. */
enum { PIXELS = 2304, SIDE = 32, CALLERS = 3 };

/* Each set with another number of threads: what changes a bit does so for any that it is beside. */
static void threads_and_isa_change_no_bit(const rays *r, const moit_technique *technique) {
    answer first[ANSWERS], other[ANSWERS];
    ask(r, technique, &(moit_run){.threads = 1, .isa = MOIT_ISA_BASE}, first);
    for (int isa = MOIT_ISA_BASE; isa < MOIT_ISA_COUNT; ++isa) {
        if (!moit_isa_supported((moit_isa)isa)) continue; /* it runs as the base, once more */
        int threads = isa == (int)moit_isa_best() ? 4 : 2 + isa;
        ask(r, technique, &(moit_run){.threads = threads, .isa = (moit_isa)isa}, other);
        EXPECT(same(first, other));
        forget(other);
    }
    forget(first);
}

typedef struct {
    const rays *r;
    moit_technique technique;
    answer found[ANSWERS];
} caller;

static void *call(void *argument) {
    caller *c = argument;
    ask(c->r, &c->technique, &(moit_run){.threads = 2, .isa = moit_isa_best()}, c->found);
    return NULL;
}

static void callers_at_once_do_not_disturb_each_other(const rays *r) {
    pthread_t threads[CALLERS];
    caller callers[CALLERS];
    answer alone[ANSWERS];
    moit_run run = plain_run();
    moit_technique technique = power(6, r->f.precision);
    ask(r, &technique, &run, alone);
    for (int i = 0; i < CALLERS; ++i) {
        callers[i] = (caller){.r = r, .technique = technique};
        if (pthread_create(&threads[i], NULL, call, &callers[i])) exit(2);
    }
    for (int i = 0; i < CALLERS; ++i) {
        pthread_join(threads[i], NULL);
        EXPECT(same(alone, callers[i].found));
        forget(callers[i].found);
    }
    forget(alone);
}

static void threads_and_isa_change_no_error_of_images(moit_precision precision) {
    int64_t size = 3 * SIDE * SIDE;
    void *pixels = room(size, size_of(precision)), *other = room(size, size_of(precision));
    void *map = room(SIDE * SIDE, size_of(precision)),
         *again = room(SIDE * SIDE, size_of(precision));
    uint64_t state = 8;
    for (int64_t i = 0; i < size; ++i) {
        set_number(precision, pixels, i, 2.0 * next_random(&state));
        set_number(precision, other, i, 2.0 * next_random(&state));
    }
    const moit_image image = {pixels, SIDE, SIDE, 3, precision};
    const moit_image reference = {other, SIDE, SIDE, 3, precision};
    moit_image_error *const errors[] = {moit_mse,  moit_rmse, moit_mae,     moit_psnr,
                                        moit_ssim, moit_flip, moit_hdr_flip};
    for (size_t i = 0; i < sizeof errors / sizeof *errors; ++i)
        for (int threads = 1; threads <= 4; ++threads) {
            static double first;
            double error = NOT_A_NUMBER;
            moit_isa isa = threads % 2 ? MOIT_ISA_BASE : moit_isa_best();
            moit_run run = {.threads = threads, .isa = isa};
            EXPECT(errors[i](&image, &reference, threads == 1 ? map : again, &error, &run)
                   == MOIT_OK);
            if (threads == 1) first = error;
            EXPECT(error == first);
            if (threads > 1) EXPECT(!memcmp(map, again, SIDE * SIDE * size_of(precision)));
        }
    free(pixels);
    free(other);
    free(map);
    free(again);
}

int main(void) {
    FOR_BOTH_PRECISIONS(precision) {
        rays r = random_rays(precision, (kind_of_rays){PIXELS, 6, 0.5, 9.0, 0.9, 0.02, 7});
        moit_technique list[MOST_TECHNIQUES];
        int n = all_techniques(precision, list);
        for (int i = 0; i < n; ++i) threads_and_isa_change_no_bit(&r, &list[i]);
        callers_at_once_do_not_disturb_each_other(&r);
        free_rays(&r);
        threads_and_isa_change_no_error_of_images(precision);
    }
    return verdict();
}
