/* Structural similarity. Wang, Bovik, Sheikh, Simoncelli, "Image quality assessment: from error
 * visibility to structural similarity", 2004, with its Gaussian window: sigma 1.5, cut at 11 taps,
 * covariances divided by the weights' sum, k1 = 0.01, k2 = 0.03.
 *
 * Block by block, and all in double: a variance is what is left of two nearly equal numbers. Of
 * rows whose pixels are equal in both images, as far as the window reaches, eq. 13 gives 1 without
 * an error of rounding: they are left out. */
#include "core/elementary.h"
#include "core/metrics/reference.h"
#include "core/threads.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* What a worker needs for a block. */
typedef struct {
    block_source image, reference;
    double encoded[SSIM_ROWS][BLOCK_STRIDE];
    double along[3][SSIM_ROWS][BLOCK_SIDE]; /* filtered along rows */
    double similarity[BLOCK_SIDE][BLOCK_SIDE];
    ssim_seen seen; /* of the reference, where nothing is kept */
} ssim_workplace;

typedef struct {
    const moit_image *image;
    moit_reference *reference;
    const ssim_lines *lines;
    double weights[SSIM_REACH + 1];
    block_errors errors;
    ssim_workplace *workplaces;
} ssim_comparison;

/* row[-1] is row[0], row[-2] is row[1]: the mirror stands between pixels. Columns and rows of a
 * block that the image has not, and their neighbours, may be any. */
static int64_t mirrored(int64_t at, int64_t count) {
    if (at < 0) return -1 - at;
    if (at < count) return at;
    const int64_t back = 2 * count - 1 - at;
    return back < 0 ? 0 : back;
}

static void filter_along(const ssim_comparison *job, const double row[BLOCK_STRIDE],
                         double out[BLOCK_SIDE]) {
    const double *lines[2 * SSIM_REACH + 1];
    for (int k = 0; k <= 2 * SSIM_REACH; ++k) lines[k] = row + k;
    job->lines->filter(job->weights, lines, out);
}

static void filter_across(const ssim_comparison *job, const double (*rows)[BLOCK_SIDE],
                          double out[BLOCK_SIDE]) {
    const double *lines[2 * SSIM_REACH + 1];
    for (int k = 0; k <= 2 * SSIM_REACH; ++k) lines[k] = rows[k];
    job->lines->filter(job->weights, lines, out);
}

/* The reference's part of the rows in `rows` that are not there yet. */
static void see(const ssim_comparison *job, uint64_t rows, ssim_workplace *work, ssim_seen *seen) {
    const uint64_t missing = rows & ~seen->rows;
    if (!missing) return;
    bool needed[SSIM_ROWS];
    moit_rows_needed(missing, SSIM_REACH, needed);
    for (int channel = 0; channel < 3; ++channel) {
        for (int y = 0; y < SSIM_ROWS; ++y) {
            if (!needed[y]) continue;
            double *encoded = seen->encoded[channel][y], squares[BLOCK_STRIDE];
            job->lines->encode(work->reference[channel][y], encoded);
            job->lines->multiply(encoded, encoded, squares);
            filter_along(job, encoded, work->along[0][y]);
            filter_along(job, squares, work->along[1][y]);
        }
        for (int y = 0; y < BLOCK_SIDE; ++y)
            for (int i = 0; missing >> y & 1 && i < 2; ++i)
                filter_across(job, work->along[i] + y, seen->means[channel][i][y]);
    }
    seen->rows |= missing;
}

static void compare(const ssim_comparison *job, int channel, uint64_t rows,
                    const bool needed[SSIM_ROWS], ssim_workplace *work, const ssim_seen *seen) {
    for (int y = 0; y < SSIM_ROWS; ++y) {
        if (!needed[y]) continue;
        double *encoded = work->encoded[y], product[BLOCK_STRIDE];
        job->lines->encode(work->image[channel][y], encoded);
        filter_along(job, encoded, work->along[0][y]);
        job->lines->multiply(encoded, encoded, product);
        filter_along(job, product, work->along[1][y]);
        job->lines->multiply(encoded, seen->encoded[channel][y], product);
        filter_along(job, product, work->along[2][y]);
    }
    for (int y = 0; y < BLOCK_SIDE; ++y) {
        if (!(rows >> y & 1)) continue;
        double means[3][BLOCK_SIDE];
        for (int i = 0; i < 3; ++i) filter_across(job, work->along[i] + y, means[i]);
        const double *const ours[3] = {means[0], means[1], means[2]};
        const double *const theirs[2] = {seen->means[channel][0][y], seen->means[channel][1][y]};
        job->lines->add(ours, theirs, work->similarity[y]);
    }
}

/* Where the reference's part stays, or the worker's own place. */
static ssim_seen *reference_seen(moit_reference *reference, int64_t block, ssim_seen *own) {
    own->rows = 0;
    if (!reference->ssim) return own;
    ssim_seen **kept = &reference->ssim[block];
    if (!*kept) *kept = moit_kept(reference, 1, sizeof **kept);
    return *kept ? *kept : own;
}

static uint64_t rows_that_differ(const double least[BLOCK_ROWS], const image_block *block) {
    bool differs[SSIM_ROWS];
    for (int y = 0; y < SSIM_ROWS; ++y) differs[y] = least[y] < (double)INFINITY;
    return moit_rows_within_reach(block, SSIM_REACH, differs);
}

/* Stores a block's errors; the mean leaves out the border where the mirror takes part. */
static void put(const ssim_comparison *job, const image_block *block, int64_t index, uint64_t rows,
                double (*similarity)[BLOCK_SIDE]) {
    const int64_t right = job->image->width - SSIM_REACH, below = job->image->height - SSIM_REACH;
    const int first = block->x ? 0 : SSIM_REACH;
    const int end = (int)(right - block->x < block->width ? right - block->x : block->width);
    for (int y = 0; y < block->height; ++y) {
        const int64_t at = block->y + y;
        const bool counts = at >= SSIM_REACH && at < below;
        for (int x = 0; x < BLOCK_SIDE; ++x)
            similarity[y][x] = rows >> y & 1 ? similarity[y][x] / 3.0 : 1.0;
        moit_put_errors(&job->errors, block, index, y, similarity[y], first, counts ? end : first);
    }
}

static moit_status compare_block(void *context, int64_t index, int thread) {
    const ssim_comparison *job = context;
    ssim_workplace *work = &job->workplaces[thread];
    const image_block block = moit_block_at(job->image, index);
    double least[BLOCK_ROWS];
    moit_load_both(job->image, &job->reference->image, &block, SSIM_REACH, mirrored, work->image,
                   work->reference, least);
    const uint64_t rows = rows_that_differ(least, &block);
    if (rows) {
        bool needed[SSIM_ROWS];
        moit_rows_needed(rows, SSIM_REACH, needed);
        ssim_seen *seen = reference_seen(job->reference, index, &work->seen);
        see(job, rows, work, seen);
        memset(work->similarity, 0, sizeof work->similarity);
        for (int channel = 0; channel < 3; ++channel)
            compare(job, channel, rows, needed, work, seen);
    }
    put(job, &block, index, rows, work->similarity);
    return MOIT_OK;
}

static void gaussian(double weights[SSIM_REACH + 1]) {
    double sum = 0.0;
    for (int k = 0; k <= SSIM_REACH; ++k) {
        weights[k] = moit_exp(-0.5 * k * k / (1.5 * 1.5));
        sum += k ? 2.0 * weights[k] : weights[k];
    }
    for (int k = 0; k <= SSIM_REACH; ++k) weights[k] /= sum;
}

moit_status moit_ssim_of(const moit_image *image, moit_reference *reference, void *map,
                         double *error, const moit_run *run) {
    ssim_comparison job = {
        .image = image, .reference = reference, .lines = moit_ssim_lines_of(run->isa)};
    gaussian(job.weights);
    const int64_t blocks = moit_blocks_of(image), width = image->width, height = image->height;
    if (!moit_begin_errors(&job.errors, image, map)) return MOIT_NO_MEMORY;
    job.workplaces = malloc((size_t)moit_most_workers(run, blocks) * sizeof *job.workplaces);
    moit_status status = MOIT_NO_MEMORY;
    if (job.workplaces) status = moit_parallel_for(run, blocks, compare_block, &job);
    free(job.workplaces);
    const double total = moit_end_errors(&job.errors);
    if (status == MOIT_OK)
        *error = total / (double)((width - 2 * SSIM_REACH) * (height - 2 * SSIM_REACH));
    return status;
}
