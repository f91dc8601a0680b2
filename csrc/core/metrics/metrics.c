/* Errors of single pixels on linear values (mse, rmse, mae, psnr), and the rows of images. */
#include "core/metrics/metrics.h"
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

void moit_store_map_row(void *map, const moit_image *image, int64_t y, const double *row) {
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

void moit_assert_comparable(const moit_image *image, const moit_image *reference) {
    (void)image, (void)reference; /* where assertions are off */
    assert(image->height == reference->height && image->width == reference->width);
    assert(image->height >= MOIT_LEAST_SIDE && image->width >= MOIT_LEAST_SIDE);
    assert(image->channels == 3 || image->channels == 4);
    assert(reference->channels == 3 || reference->channels == 4);
    assert(image->precision == reference->precision);
}

/* What a map shows of a pixel's three differences. */
typedef enum { MEAN_SQUARE, ROOT_MEAN_SQUARE, MEAN_ABSOLUTE, DECIBEL } measure;

typedef struct {
    const moit_image *image, *reference;
    measure shown;
    void *map;
    double *rows; /* 3 a worker */
    double *sums; /* of each row's squares or magnitudes */
} comparison;

static double decibel(double mean_square) { return -10.0 * log10(mean_square); }

static moit_status compare_row(void *context, int64_t y, int thread) {
    const comparison *job = context;
    const int64_t width = job->image->width;
    double *a = job->rows + 3 * width * thread, *b = a + width, *error = b + width;
    for (int64_t x = 0; x < width; ++x) error[x] = 0.0;
    for (int channel = 0; channel < 3; ++channel) {
        moit_image_row(job->image, y, channel, a);
        moit_image_row(job->reference, y, channel, b);
        for (int64_t x = 0; x < width; ++x) {
            double difference = a[x] - b[x];
            error[x] += job->shown == MEAN_ABSOLUTE ? fabs(difference) : difference * difference;
        }
    }
    double sum = 0.0;
    for (int64_t x = 0; x < width; ++x) sum += error[x];
    job->sums[y] = sum;
    if (!job->map) return MOIT_OK;
    for (int64_t x = 0; x < width; ++x) error[x] /= 3.0;
    if (job->shown == ROOT_MEAN_SQUARE)
        for (int64_t x = 0; x < width; ++x) error[x] = sqrt(error[x]);
    if (job->shown == DECIBEL)
        for (int64_t x = 0; x < width; ++x) error[x] = decibel(error[x]);
    moit_store_map_row(job->map, job->image, y, error);
    return MOIT_OK;
}

/* *mean is that of the squares or magnitudes, whatever the map shows. */
static moit_status compare(measure shown, const moit_image *image, const moit_image *reference,
                           void *map, double *mean, const moit_run *run) {
    moit_assert_comparable(image, reference);
    const int64_t height = image->height, width = image->width;
    const int64_t row_scratch = 3 * width * moit_most_workers(run, height);
    double *scratch = malloc(sizeof(double) * (size_t)(row_scratch + height));
    if (!scratch) return MOIT_NO_MEMORY;
    comparison job = {image, reference, shown, map, scratch, scratch + row_scratch};
    moit_status status = moit_parallel_for(run, height, compare_row, &job);
    if (status == MOIT_OK) *mean = moit_mean_of_rows(job.sums, height, 3 * height * width);
    free(scratch);
    return status;
}

moit_status moit_mse(const moit_image *image, const moit_image *reference, void *map, double *error,
                     const moit_run *run) {
    return compare(MEAN_SQUARE, image, reference, map, error, run);
}

moit_status moit_rmse(const moit_image *image, const moit_image *reference, void *map,
                      double *error, const moit_run *run) {
    moit_status status = compare(ROOT_MEAN_SQUARE, image, reference, map, error, run);
    if (status == MOIT_OK) *error = sqrt(*error);
    return status;
}

moit_status moit_mae(const moit_image *image, const moit_image *reference, void *map, double *error,
                     const moit_run *run) {
    return compare(MEAN_ABSOLUTE, image, reference, map, error, run);
}

moit_status moit_psnr(const moit_image *image, const moit_image *reference, void *map,
                      double *error, const moit_run *run) {
    moit_status status = compare(DECIBEL, image, reference, map, error, run);
    if (status == MOIT_OK) *error = decibel(*error);
    return status;
}
