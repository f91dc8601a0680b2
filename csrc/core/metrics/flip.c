/* FLIP. Andersson, Nilsson, Akenine-Moeller, Oskarsson, Astroem, Fairchild, "FLIP: A Difference
 * Evaluator for Alternating Images", 2020.
 *
 * Block by block, on one display after the other: display and opponent space, all filters along
 * rows, then across them, and the comparison. Every filter separates: the blue-yellow one is a sum
 * of two Gaussians, the features are derivatives of one. A row looks the same in both images where
 * they are equal, or so bright that the display shows white for both, as far as filters reach: it
 * has no error, and is left out. */
#include "core/metrics/reference.h"
#include "core/threads.h"

#include <stdlib.h>
#include <string.h>

/* What a worker needs for a block. */
typedef struct {
    block_source image, reference;
    float planes[BLOCK_ROWS][FLIP_PLANES][BLOCK_SIDE];
    flip_seen image_seen, reference_seen;
    float errors[BLOCK_SIDE][BLOCK_SIDE];
} flip_workplace;

typedef struct {
    const moit_image *image;
    moit_reference *reference;
    const flip_display *displays;
    int count;
    flip_seen **kept;
    flip_filters filters;
    const flip_lines *lines;
    block_errors errors;
    flip_workplace *workplaces;
} flip_comparison;

/* The ends of an image repeat outside. */
static int64_t repeated(int64_t at, int64_t count) {
    return at < 0 ? 0 : at < count ? at : count - 1;
}

/* Sees the rows in `rows` that are not there yet. */
static void see(const flip_comparison *job, flip_display display, const block_source source,
                uint64_t rows, float planes[BLOCK_ROWS][FLIP_PLANES][BLOCK_SIDE], flip_seen *seen) {
    const uint64_t missing = rows & ~seen->rows;
    if (!missing) return;
    bool needed[BLOCK_ROWS];
    moit_rows_needed(missing, BLOCK_REACH, needed);
    for (int y = 0; y < BLOCK_ROWS; ++y) {
        if (!needed[y]) continue;
        const double *const rgb[3] = {source[0][y], source[1][y], source[2][y]};
        float opponent[3][BLOCK_STRIDE];
        job->lines->show(&job->filters, display, rgb, opponent);
        job->lines->along(&job->filters, opponent, planes[y]);
    }
    for (int y = 0; y < BLOCK_SIDE; ++y)
        if (missing >> y & 1) job->lines->see(&job->filters, planes + y, seen->values[y]);
    seen->rows |= missing;
}

/* The rows of a block within reach of what the display shows differently. */
static uint64_t rows_that_differ(flip_display display, const double least[BLOCK_ROWS],
                                 const image_block *block) {
    const double white = display.exposed ? 16.0 : 1.0; /* the curve is above 1 from 12 on */
    bool differs[BLOCK_ROWS];
    for (int y = 0; y < BLOCK_ROWS; ++y)
        differs[y] = least[y] * display.root * display.root < white;
    return moit_rows_within_reach(block, BLOCK_REACH, differs);
}

/* Where what is seen of the reference stays, or the worker's own place. */
static flip_seen *reference_seen(const flip_comparison *job, int display, int64_t block,
                                 flip_seen *own) {
    own->rows = 0;
    if (!job->kept) return own;
    flip_seen **kept = &job->kept[display * moit_blocks_of(job->image) + block];
    if (!*kept) *kept = moit_kept(job->reference, 1, sizeof **kept);
    return *kept ? *kept : own;
}

static moit_status compare_block(void *context, int64_t index, int thread) {
    const flip_comparison *job = context;
    flip_workplace *work = &job->workplaces[thread];
    const image_block block = moit_block_at(job->image, index);
    double least[BLOCK_ROWS];
    moit_load_both(job->image, &job->reference->image, &block, BLOCK_REACH, repeated, work->image,
                   work->reference, least);

    memset(work->errors, 0, sizeof work->errors);
    for (int i = 0; i < job->count; ++i) {
        const flip_display display = job->displays[i];
        const uint64_t rows = rows_that_differ(display, least, &block);
        if (!rows) continue;
        flip_seen *theirs = reference_seen(job, i, index, &work->reference_seen);
        flip_seen *ours = &work->image_seen;
        ours->rows = 0;
        see(job, display, work->reference, rows, work->planes, theirs);
        see(job, display, work->image, rows, work->planes, ours);
        for (int y = 0; y < block.height; ++y)
            if (rows >> y & 1)
                job->lines->raise(ours->values[y], theirs->values[y], work->errors[y]);
    }
    for (int y = 0; y < block.height; ++y) {
        double row[BLOCK_SIDE];
        for (int x = 0; x < BLOCK_SIDE; ++x) row[x] = (double)work->errors[y][x];
        moit_put_errors(&job->errors, &block, index, y, row, 0, block.width);
    }
    return MOIT_OK;
}

moit_status moit_flip_on(const moit_image *image, moit_reference *reference,
                         const flip_display *displays, int count, flip_seen **kept, void *map,
                         double *error, const moit_run *run) {
    flip_comparison job = {.image = image,
                           .reference = reference,
                           .displays = displays,
                           .count = count,
                           .kept = kept,
                           .lines = moit_flip_lines_of(run->isa)};
    moit_flip_prepare(&job.filters);
    const int64_t blocks = moit_blocks_of(image);
    const size_t workers = (size_t)moit_most_workers(run, blocks);
    if (!moit_begin_errors(&job.errors, image, map)) return MOIT_NO_MEMORY;
    job.workplaces = malloc(workers * sizeof *job.workplaces);
    moit_status status = MOIT_NO_MEMORY;
    if (job.workplaces) status = moit_parallel_for(run, blocks, compare_block, &job);
    free(job.workplaces);
    const double total = moit_end_errors(&job.errors);
    if (status == MOIT_OK) *error = total / (double)(image->height * image->width);
    return status;
}

/* The display's sRGB encoding, and the decoding that FLIP starts with, undo each other. */
moit_status moit_flip_of(const moit_image *image, moit_reference *reference, void *map,
                         double *error, const moit_run *run) {
    const flip_display clipped = {.exposed = false, .root = 1.0};
    return moit_flip_on(image, reference, &clipped, 1, reference->flip, map, error, run);
}
