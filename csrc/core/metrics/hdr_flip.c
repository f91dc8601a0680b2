/* FLIP over exposures. Andersson, Nilsson, Shirley, Akenine-Moeller, "Visualizing Errors in
 * Rendered High Dynamic Range Images", 2021: the greatest FLIP error of a pixel among exposures
 * that show the reference from its brightest to its median luminance. */
#include "core/elementary.h"
#include "core/metrics/reference.h"
#include "core/threads.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double square = MOIT_ACES_SQUARE, slope = MOIT_ACES_SLOPE;
static const double square_below = MOIT_ACES_SQUARE_BELOW, slope_below = MOIT_ACES_SLOPE_BELOW;
static const double constant_below = MOIT_ACES_CONSTANT_BELOW;

/* x for which the curve gives y. */
static double radiance_for(double y) {
    double a = square - y * square_below, b = slope - y * slope_below, c = -y * constant_below;
    return (-b + sqrt(b * b - 4.0 * a * c)) / (2.0 * a);
}

/* A histogram's digit of numbers >= 0, whose bits are in order. The first holds bit 63 to 55. */
enum { DIGIT = 11, DIGITS = 1 << DIGIT };

typedef struct {
    const moit_image *image;
    int shift;
    uint64_t found, known; /* the bits before the digit, and which they are */
    double *rows;          /* 2 a worker */
    int64_t *histograms;   /* DIGITS a worker */
    double *greatest;      /* of each worker */
} luminance_count;

/* Luminances are at least the epsilon of float32, as flip-evaluator takes the median to be; the
 * greatest, too, so that a black reference has exposures: as if it were that bright. */
static void luminance_row(const moit_image *image, int64_t y, double *channel, double *luminance) {
    static const double share[3] = {0.2126, 0.7152, 0.0722};
    const int64_t width = image->width;
    const double least = (double)FLT_EPSILON;
    for (int64_t x = 0; x < width; ++x) luminance[x] = 0.0;
    for (int i = 0; i < 3; ++i) {
        moit_image_row(image, y, i, channel);
        for (int64_t x = 0; x < width; ++x)
            luminance[x] += channel[x] > 0.0 ? share[i] * channel[x] : 0.0;
    }
    for (int64_t x = 0; x < width; ++x) luminance[x] = luminance[x] > least ? luminance[x] : least;
}

static moit_status count_row(void *context, int64_t y, int thread) {
    const luminance_count *job = context;
    const int64_t width = job->image->width;
    double *channel = job->rows + 2 * width * thread, *luminance = channel + width;
    int64_t *histogram = job->histograms + DIGITS * (int64_t)thread;
    luminance_row(job->image, y, channel, luminance);
    double greatest = job->greatest[thread];
    for (int64_t x = 0; x < width; ++x) {
        uint64_t bits;
        memcpy(&bits, &luminance[x], sizeof bits);
        if ((bits & job->known) == job->found) ++histogram[bits >> job->shift & (DIGITS - 1)];
        greatest = luminance[x] > greatest ? luminance[x] : greatest;
    }
    job->greatest[thread] = greatest;
    return MOIT_OK;
}

/* The next digit of the luminance of rank *rank, the least being 0; what is left of the rank. */
static uint64_t digit_of(const luminance_count *job, int64_t workers, int64_t *rank) {
    uint64_t digit = 0;
    for (; digit < DIGITS - 1; ++digit) {
        int64_t here = 0;
        for (int64_t i = 0; i < workers; ++i) here += job->histograms[i * DIGITS + (int64_t)digit];
        if (*rank < here) break;
        *rank -= here;
    }
    return digit;
}

typedef struct {
    double median, greatest;
} luminances;

/* A digit a round: an image is read six times, and nothing of its size is kept. */
static moit_status find_luminances(luminance_count *job, int64_t workers, luminances *found,
                                   const moit_run *run) {
    const int64_t count = job->image->height * job->image->width;
    int64_t rank = count / 2;
    for (job->shift = 5 * DIGIT; job->shift >= 0; job->shift -= DIGIT) {
        memset(job->histograms, 0, sizeof(int64_t) * DIGITS * (size_t)workers);
        moit_status status = moit_parallel_for(run, job->image->height, count_row, job);
        if (status != MOIT_OK) return status;
        job->found |= digit_of(job, workers, &rank) << job->shift;
        job->known |= (uint64_t)(DIGITS - 1) << job->shift;
    }
    memcpy(&found->median, &job->found, sizeof found->median);
    found->greatest = 0.0;
    for (int64_t i = 0; i < workers; ++i) found->greatest = fmax(found->greatest, job->greatest[i]);
    return MOIT_OK;
}

static moit_status luminances_of(const moit_image *image, luminances *found, const moit_run *run) {
    const int64_t workers = moit_most_workers(run, image->height), width = image->width;
    double *rows = calloc((size_t)(workers * (2 * width + 1 + DIGITS)), sizeof(double));
    if (!rows) return MOIT_NO_MEMORY;
    luminance_count job = {.image = image, .rows = rows};
    job.greatest = rows + workers * 2 * width;
    job.histograms = (int64_t *)(job.greatest + workers);
    moit_status status = find_luminances(&job, workers, found, run);
    free(rows);
    return status;
}

static double logarithm2(double x) { return moit_log(x) / 0.69314718055994530942; }

static moit_status range_of(moit_reference *reference, const moit_run *run) {
    luminances of;
    moit_status status = luminances_of(&reference->image, &of, run);
    if (status != MOIT_OK) return status;
    const double level = logarithm2(radiance_for(0.85));
    const double start = level - logarithm2(of.greatest), stop = level - logarithm2(of.median);
    const double stops = fmin(ceil(stop - start), 2.0 * DBL_MAX_EXP); /* no image has more */
    reference->range = (flip_range){start, stop, (int)fmax(2.0, stops)};
    if (reference->flip)
        reference->hdr =
            moit_kept(reference, reference->range.exposures * moit_blocks_of(&reference->image),
                      sizeof *reference->hdr);
    reference->has_range = true;
    return MOIT_OK;
}

moit_status moit_hdr_flip_of(const moit_image *image, moit_reference *reference, void *map,
                             double *error, const moit_run *run) {
    if (!reference->has_range) {
        moit_status status = range_of(reference, run);
        if (status != MOIT_OK) return status;
    }
    const flip_range range = reference->range;
    flip_display *displays = malloc((size_t)range.exposures * sizeof *displays);
    if (!displays) return MOIT_NO_MEMORY;
    for (int i = 0; i < range.exposures; ++i) {
        double exposure = range.start + (range.stop - range.start) * i / (range.exposures - 1);
        displays[i] = (flip_display){.exposed = true, .root = moit_exp2(0.5 * exposure)};
    }
    moit_status status =
        moit_flip_on(image, reference, displays, range.exposures, reference->hdr, map, error, run);
    free(displays);
    return status;
}
