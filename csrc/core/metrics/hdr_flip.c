/* FLIP over exposures. Andersson, Nilsson, Shirley, Akenine-Moeller, "Visualizing Errors in
 * Rendered High Dynamic Range Images", 2021: the greatest FLIP error of a pixel among exposures
 * that show the reference from its brightest to its median luminance. */
#include "core/metrics/flip.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Narkowicz's fit of the ACES curve, without the 0.6 of exposure that it contains:
 * x (square x + slope) / (x (square_below x + slope_below) + constant_below). */
static const double square = 0.36 * 2.51, slope = 0.6 * 0.03;
static const double square_below = 0.36 * 2.43, slope_below = 0.6 * 0.59, constant_below = 0.14;

/* x for which the curve gives y. */
static double radiance_for(double y) {
    double a = square - y * square_below, b = slope - y * slope_below, c = -y * constant_below;
    return (-b + sqrt(b * b - 4.0 * a * c)) / (2.0 * a);
}

/* Negative radiance is shown as black: the curve would turn it bright. */
static void expose(double exposure, double *row, int64_t width) {
    const double white = 100.0;               /* the curve is above 1 from 12 on */
    const double root = exp2(0.5 * exposure); /* twice, as 2^exposure itself may overflow */
    for (int64_t i = 0; i < width; ++i) {
        double x = row[i] > 0.0 ? row[i] * root * root : 0.0;
        x = x < white ? x : white;
        double y =
            x * (square * x + slope) / (x * (square_below * x + slope_below) + constant_below);
        row[i] = y < 1.0 ? y : 1.0;
    }
}

/* rank 0 is the least. Of numbers >= 0, whose bits are in order: a digit of 8 bits a round. */
static double of_rank(const double *values, int64_t count, int64_t rank) {
    uint64_t found = 0, known = 0;
    for (int shift = 56; shift >= 0; shift -= 8) {
        int64_t histogram[256] = {0};
        for (int64_t i = 0; i < count; ++i) {
            uint64_t bits;
            memcpy(&bits, &values[i], sizeof bits);
            if ((bits & known) == found) ++histogram[bits >> shift & 255];
        }
        uint64_t digit = 0;
        while (digit < 255 && rank >= histogram[digit]) rank -= histogram[digit++];
        found |= digit << shift;
        known |= (uint64_t)255 << shift;
    }
    double value;
    memcpy(&value, &found, sizeof value);
    return value;
}

typedef struct {
    double median, greatest;
} luminances;

/* Floored at the epsilon of float32, as flip-evaluator floors the median; the greatest, too, so
 * that a black reference has exposures: as if it were that bright. */
static bool luminances_of(const moit_image *image, luminances *found) {
    const int64_t width = image->width, count = image->height * width;
    const double share[3] = {0.2126, 0.7152, 0.0722};
    double *values = calloc((size_t)(count + width), sizeof(double)), *row = values + count;
    if (!values) return false;
    double greatest = 0.0;
    for (int64_t y = 0; y < image->height; ++y) {
        for (int channel = 0; channel < 3; ++channel) {
            moit_image_row(image, y, channel, row);
            for (int64_t x = 0; x < width; ++x)
                values[y * width + x] += row[x] > 0.0 ? share[channel] * row[x] : 0.0;
        }
    }
    for (int64_t i = 0; i < count; ++i) greatest = fmax(greatest, values[i]);
    const double least = (double)FLT_EPSILON;
    *found = (luminances){fmax(of_rank(values, count, count / 2), least), fmax(greatest, least)};
    free(values);
    return true;
}

static moit_status see_exposures(flip_comparison *flip, const moit_run *run) {
    luminances reference;
    if (!luminances_of(flip->images[1], &reference)) return MOIT_NO_MEMORY;
    const double level = log2(radiance_for(0.85));
    const double start = level - log2(reference.greatest), stop = level - log2(reference.median);
    const double stops = fmin(ceil(stop - start), 2.0 * DBL_MAX_EXP); /* no image has more */
    const int exposures = (int)fmax(2.0, stops);
    for (int i = 0; i < exposures; ++i) {
        /* Each exposure may be too short to ask by itself. */
        if (run->interrupted && run->interrupted(run->context)) return MOIT_INTERRUPTED;
        flip_display display = {expose, start + (stop - start) * i / (exposures - 1)};
        moit_status status = moit_flip_see(flip, display, run);
        if (status != MOIT_OK) return status;
    }
    return MOIT_OK;
}

moit_status moit_hdr_flip(const moit_image *image, const moit_image *reference, void *map,
                          double *error, const moit_run *run) {
    return moit_flip_pool(image, reference, map, error, see_exposures, run);
}
