/* References of errors: what they keep, and all errors of an image at once. */
#include "core/metrics/reference.h"

#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>

void *moit_kept(moit_reference *reference, int64_t count, size_t size) {
    const int64_t most = atomic_load(&reference->bytes_left), bytes = (int64_t)size;
    if (bytes > most || count > most / bytes) return NULL;
    if (atomic_fetch_sub(&reference->bytes_left, count * bytes) >= count * bytes) {
        void *kept = calloc((size_t)count, size);
        if (kept) return kept;
    }
    atomic_fetch_add(&reference->bytes_left, count * bytes);
    return NULL;
}

moit_reference *moit_reference_of(const moit_image *image, int64_t most_bytes) {
    moit_reference *reference = malloc(sizeof *reference);
    if (!reference) return NULL;
    *reference = (moit_reference){.image = *image, .bytes_left = most_bytes};
    const int64_t blocks = moit_blocks_of(image);
    reference->ssim = moit_kept(reference, blocks, sizeof *reference->ssim);
    reference->flip = moit_kept(reference, blocks, sizeof *reference->flip);
    return reference;
}

static void let_go(void *kept, int64_t count) {
    void **pointers = kept;
    if (!pointers) return;
    for (int64_t i = 0; i < count; ++i) free(pointers[i]);
    free(pointers);
}

void moit_free_reference(moit_reference *reference) {
    if (!reference) return;
    const int64_t blocks = moit_blocks_of(&reference->image);
    let_go(reference->ssim, blocks);
    let_go(reference->flip, blocks);
    let_go(reference->hdr, blocks * reference->range.exposures);
    free(reference);
}

static bool any(const bool *wanted, int first, int last) {
    for (int i = first; i <= last; ++i)
        if (wanted[i]) return true;
    return false;
}

moit_status moit_errors(const moit_image *image, moit_reference *reference,
                        const bool wanted[MOIT_METRICS], double errors[MOIT_METRICS],
                        const moit_run *run) {
    if (any(wanted, MOIT_MSE, MOIT_PSNR)) {
        moit_mean_differences means;
        moit_status status = moit_differences(image, &reference->image, &means, run);
        if (status != MOIT_OK) return status;
        errors[MOIT_MSE] = means.square;
        errors[MOIT_RMSE] = sqrt(means.square);
        errors[MOIT_MAE] = means.magnitude;
        errors[MOIT_PSNR] = moit_decibel(means.square);
    }
    static moit_error_of_block *const of_blocks[MOIT_METRICS] = {
        [MOIT_SSIM] = moit_ssim_of, [MOIT_FLIP] = moit_flip_of, [MOIT_HDR_FLIP] = moit_hdr_flip_of};
    for (int i = MOIT_SSIM; i < MOIT_METRICS; ++i) {
        if (!wanted[i]) continue;
        moit_status status = of_blocks[i](image, reference, NULL, &errors[i], run);
        if (status != MOIT_OK) return status;
    }
    return MOIT_OK;
}

/* An error of one image, whose reference is asked once. */
static moit_status once(moit_error_of_block *of, const moit_image *image,
                        const moit_image *reference, void *map, double *error,
                        const moit_run *run) {
    moit_reference unkept = {.image = *reference};
    return of(image, &unkept, map, error, run);
}

moit_status moit_ssim(const moit_image *image, const moit_image *reference, void *map,
                      double *error, const moit_run *run) {
    return once(moit_ssim_of, image, reference, map, error, run);
}

moit_status moit_flip(const moit_image *image, const moit_image *reference, void *map,
                      double *error, const moit_run *run) {
    return once(moit_flip_of, image, reference, map, error, run);
}

moit_status moit_hdr_flip(const moit_image *image, const moit_image *reference, void *map,
                          double *error, const moit_run *run) {
    return once(moit_hdr_flip_of, image, reference, map, error, run);
}
