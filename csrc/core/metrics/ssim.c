/* Structural similarity. Wang, Bovik, Sheikh, Simoncelli, "Image quality assessment: from error
 * visibility to structural similarity", 2004, with its Gaussian window: sigma 1.5, cut at 11 taps,
 * covariances divided by the weights' sum, k1 = 0.01, k2 = 0.03.
 *
 * All in double: a variance is what is left of two nearly equal numbers. */
#include "core/metrics/metrics.h"
#include "core/threads.h"

#include <math.h>
#include <stdlib.h>

enum {
    REACH = 5,            /* taps on either side, and the border that the mean leaves out */
    PMOIT_SRGB_LANES = 4, /* local means of a, b, a^2 + b^2 and a b; eq. 13 needs no more */
};

static const double c1 = 0.01 * 0.01, c2 = 0.03 * 0.03;

typedef struct {
    const moit_image *images[2];
    int64_t stride; /* of a row of doubles, in whole lanes */
    int channel;    /* the one being worked on */
    double weights[REACH + 1];
    double *planes; /* (PMOIT_SRGB_LANES, height, stride), filtered along rows */
    double *sum;    /* (height, stride): similarity summed over channels */
    double *rows;   /* PMOIT_SRGB_LANES rows of padded_width a worker */
} similarity;

static int64_t padded_width(const similarity *job) {
    return job->stride + 2 * REACH + MOIT_SRGB_LANES;
}

/* row[-1] is row[0], row[-2] is row[1]: the mirror stands between pixels. */
static int64_t mirrored(int64_t x, int64_t width) {
    if (x < 0) return -1 - x;
    return x < width ? x : 2 * width - 1 - x;
}

/* out = sum over k of weights[|k|] lines[REACH + k]. */
static void filter(const double weights[REACH + 1], const double *const lines[2 * REACH + 1],
                   double *restrict out, int64_t width) {
    for (int64_t x = 0; x < width; ++x) {
        double sum = weights[0] * lines[REACH][x];
        for (int k = 1; k <= REACH; ++k)
            sum += weights[k] * (lines[REACH - k][x] + lines[REACH + k][x]);
        out[x] = sum;
    }
}

static double *plane_row(const similarity *job, int plane, int64_t y) {
    return job->planes + (plane * job->images[0]->height + y) * job->stride;
}

static moit_status filter_row(void *context, int64_t y, int thread) {
    const similarity *job = context;
    const int64_t width = job->images[0]->width, padded = padded_width(job);
    double *scratch = job->rows + PMOIT_SRGB_LANES * padded * thread + REACH;
    double *values[2] = {scratch, scratch + padded};
    for (int i = 0; i < 2; ++i) {
        moit_image_row(job->images[i], y, job->channel, values[i]);
        for (int64_t x = width; x < job->stride; ++x) values[i][x] = 0.0;
        moit_encode_srgb(values[i], job->stride);
        for (int64_t k = 1; k <= REACH; ++k) {
            values[i][-k] = values[i][mirrored(-k, width)];
            values[i][width - 1 + k] = values[i][mirrored(width - 1 + k, width)];
        }
    }
    double *squares = values[1] + padded, *products = squares + padded;
    for (int64_t x = -REACH; x < width + REACH; ++x) {
        double a = values[0][x], b = values[1][x];
        squares[x] = a * a + b * b;
        products[x] = a * b;
    }
    for (int plane = 0; plane < PMOIT_SRGB_LANES; ++plane) {
        const double *lines[2 * REACH + 1];
        for (int k = -REACH; k <= REACH; ++k) lines[REACH + k] = scratch + plane * padded + k;
        filter(job->weights, lines, plane_row(job, plane, y), width);
    }
    return MOIT_OK;
}

static moit_status similarity_row(void *context, int64_t y, int thread) {
    const similarity *job = context;
    const int64_t width = job->images[0]->width, height = job->images[0]->height;
    double *means[PMOIT_SRGB_LANES];
    for (int plane = 0; plane < PMOIT_SRGB_LANES; ++plane) {
        const double *lines[2 * REACH + 1];
        for (int k = -REACH; k <= REACH; ++k)
            lines[REACH + k] = plane_row(job, plane, mirrored(y + k, height));
        means[plane] = job->rows + (PMOIT_SRGB_LANES * thread + plane) * padded_width(job);
        filter(job->weights, lines, means[plane], width);
    }
    const double *a = means[0], *b = means[1], *squares = means[2], *products = means[3];
    double *restrict sum = job->sum + y * job->stride;
    for (int64_t x = 0; x < width; ++x) {
        double product = a[x] * b[x], square = a[x] * a[x] + b[x] * b[x];
        double covariance = products[x] - product, variances = squares[x] - square;
        double similar = ((2.0 * product + c1) * (2.0 * covariance + c2)) /* (13) */
                         / ((square + c1) * (variances + c2));
        sum[x] = job->channel == 0 ? similar : sum[x] + similar;
    }
    return MOIT_OK;
}

static void gaussian(double weights[REACH + 1]) {
    double sum = 0.0;
    for (int k = 0; k <= REACH; ++k) {
        weights[k] = exp(-0.5 * k * k / (1.5 * 1.5));
        sum += k ? 2.0 * weights[k] : weights[k];
    }
    for (int k = 0; k <= REACH; ++k) weights[k] /= sum;
}

/* Stores the map, gives the mean without the border where the mirror takes part. */
static double pool(const similarity *job, void *map) {
    const int64_t width = job->images[0]->width, height = job->images[0]->height;
    double total = 0.0;
    for (int64_t y = 0; y < height; ++y) {
        double *row = job->sum + y * job->stride, sum = 0.0;
        for (int64_t x = 0; x < width; ++x) row[x] /= 3.0;
        for (int64_t x = REACH; x < width - REACH; ++x) sum += row[x];
        if (y >= REACH && y < height - REACH) total += sum;
        moit_store_map_row(map, job->images[0], y, row);
    }
    return total / (double)((width - 2 * REACH) * (height - 2 * REACH));
}

moit_status moit_ssim(const moit_image *image, const moit_image *reference, void *map,
                      double *error, const moit_run *run) {
    moit_assert_comparable(image, reference);
    const int64_t height = image->height;
    similarity job = {.images = {image, reference},
                      .stride =
                          (image->width + MOIT_SRGB_LANES - 1) / MOIT_SRGB_LANES * MOIT_SRGB_LANES};
    gaussian(job.weights);
    const int64_t plane = height * job.stride;
    const int64_t rows = PMOIT_SRGB_LANES * padded_width(&job) * moit_most_workers(run, height);
    job.planes = malloc(sizeof(double) * (size_t)((PMOIT_SRGB_LANES + 1) * plane + rows));
    if (!job.planes) return MOIT_NO_MEMORY;
    job.sum = job.planes + PMOIT_SRGB_LANES * plane;
    job.rows = job.sum + plane;
    moit_status status = MOIT_OK;
    for (; job.channel < 3 && status == MOIT_OK; ++job.channel) {
        status = moit_parallel_for(run, height, filter_row, &job);
        if (status == MOIT_OK) status = moit_parallel_for(run, height, similarity_row, &job);
    }
    if (status == MOIT_OK) *error = pool(&job, map);
    free(job.planes);
    return status;
}
