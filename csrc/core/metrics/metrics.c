/* Errors of single pixels on linear values (mse, rmse, mae, psnr), and the rows of images. */
#include "core/metrics/metrics.h"
#include "core/elementary.h"
#include "core/threads.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>

void moit_image_row(const moit_image *image, int64_t y, int channel, double *row) {
    const int step = image->channels;
    const int64_t width = image->width, start = y * width * step + channel;
    if (image->precision == MOIT_FLOAT32) {
        const float *from = (const float *)image->pixels + start;
        for (int64_t x = 0; x < width; ++x) row[x] = (double)from[x * step];
    } else {
        const double *from = (const double *)image->pixels + start;
        for (int64_t x = 0; x < width; ++x) row[x] = from[x * step];
    }
}

/* Stores `width` values as row y of a map that has the precision of `image`; NULL: nothing. */
static void store_map_row(void *map, const moit_image *image, int64_t y, const double *row) {
    if (!map) return;
    const int64_t width = image->width, start = y * width;
    if (image->precision == MOIT_FLOAT32) {
        float *to = (float *)map + start;
        for (int64_t x = 0; x < width; ++x) to[x] = (float)row[x];
    } else {
        double *to = (double *)map + start;
        for (int64_t x = 0; x < width; ++x) to[x] = row[x];
    }
}

double moit_mean_of_rows(const double *sums, int64_t rows, int64_t count) {
    double sum = 0.0;
    for (int64_t y = 0; y < rows; ++y) sum += sums[y];
    return sum / (double)count;
}

int64_t moit_most_workers(const moit_run *run, int64_t items) {
    return run->threads < items ? run->threads : items;
}

static void assert_comparable(const moit_image *image, const moit_image *reference) {
    (void)image, (void)reference; /* where assertions are off */
    assert(image->height == reference->height && image->width == reference->width);
    assert(image->height >= MOIT_LEAST_SIDE && image->width >= MOIT_LEAST_SIDE);
    assert(image->channels == 3 || image->channels == 4);
    assert(reference->channels == 3 || reference->channels == 4);
}

/* What a map shows of a pixel's three differences. */
typedef enum { MEAN_SQUARE, ROOT_MEAN_SQUARE, MEAN_ABSOLUTE, DECIBEL } measure;

typedef struct {
    const moit_image *image, *reference;
    measure shown;
    void *map;
    double *rows;                 /* 4 a worker */
    double *squares, *magnitudes; /* of each row, summed */
} comparison;

double moit_decibel(double mean_square) {
    return -10.0 * (moit_log(mean_square) / 2.30258509299404568402);
}

static void store(const comparison *job, int64_t y, const double *squares, const double *magnitudes,
                  double *shown) {
    const int64_t width = job->image->width;
    const double *from = job->shown == MEAN_ABSOLUTE ? magnitudes : squares;
    for (int64_t x = 0; x < width; ++x) shown[x] = from[x] / 3.0;
    if (job->shown == ROOT_MEAN_SQUARE)
        for (int64_t x = 0; x < width; ++x) shown[x] = sqrt(shown[x]);
    if (job->shown == DECIBEL)
        for (int64_t x = 0; x < width; ++x) shown[x] = moit_decibel(shown[x]);
    store_map_row(job->map, job->image, y, shown);
}

static moit_status compare_row(void *context, int64_t y, int thread) {
    const comparison *job = context;
    const int64_t width = job->image->width;
    double *restrict a = job->rows + 4 * width * thread, *restrict b = a + width;
    double *restrict squares = b + width, *restrict magnitudes = squares + width;
    for (int64_t x = 0; x < 2 * width; ++x) squares[x] = 0.0;
    for (int channel = 0; channel < 3; ++channel) {
        moit_image_row(job->image, y, channel, a);
        moit_image_row(job->reference, y, channel, b);
        for (int64_t x = 0; x < width; ++x) {
            double difference = a[x] - b[x];
            squares[x] += difference * difference;
            magnitudes[x] += fabs(difference);
        }
    }
    double square = 0.0, magnitude = 0.0;
    for (int64_t x = 0; x < width; ++x) square += squares[x], magnitude += magnitudes[x];
    job->squares[y] = square, job->magnitudes[y] = magnitude;
    if (job->map) store(job, y, squares, magnitudes, a);
    return MOIT_OK;
}

static moit_status compare(measure shown, const moit_image *image, const moit_image *reference,
                           void *map, moit_mean_differences *means, const moit_run *run) {
    assert_comparable(image, reference);
    const int64_t height = image->height, width = image->width, count = 3 * height * width;
    const int64_t row_scratch = 4 * width * moit_most_workers(run, height);
    double *scratch = malloc(sizeof(double) * (size_t)(row_scratch + 2 * height));
    if (!scratch) return MOIT_NO_MEMORY;
    double *squares = scratch + row_scratch, *magnitudes = squares + height;
    comparison job = {image, reference, shown, map, scratch, squares, magnitudes};
    moit_status status = moit_parallel_for(run, height, compare_row, &job);
    if (status == MOIT_OK)
        *means = (moit_mean_differences){moit_mean_of_rows(squares, height, count),
                                         moit_mean_of_rows(magnitudes, height, count)};
    free(scratch);
    return status;
}

moit_status moit_differences(const moit_image *image, const moit_image *reference,
                             moit_mean_differences *means, const moit_run *run) {
    return compare(MEAN_SQUARE, image, reference, NULL, means, run);
}

moit_status moit_mse(const moit_image *image, const moit_image *reference, void *map, double *error,
                     const moit_run *run) {
    moit_mean_differences means;
    moit_status status = compare(MEAN_SQUARE, image, reference, map, &means, run);
    if (status == MOIT_OK) *error = means.square;
    return status;
}

moit_status moit_rmse(const moit_image *image, const moit_image *reference, void *map,
                      double *error, const moit_run *run) {
    moit_mean_differences means;
    moit_status status = compare(ROOT_MEAN_SQUARE, image, reference, map, &means, run);
    if (status == MOIT_OK) *error = sqrt(means.square);
    return status;
}

moit_status moit_mae(const moit_image *image, const moit_image *reference, void *map, double *error,
                     const moit_run *run) {
    moit_mean_differences means;
    moit_status status = compare(MEAN_ABSOLUTE, image, reference, map, &means, run);
    if (status == MOIT_OK) *error = means.magnitude;
    return status;
}

moit_status moit_psnr(const moit_image *image, const moit_image *reference, void *map,
                      double *error, const moit_run *run) {
    moit_mean_differences means;
    moit_status status = compare(DECIBEL, image, reference, map, &means, run);
    if (status == MOIT_OK) *error = moit_decibel(means.square);
    return status;
}
