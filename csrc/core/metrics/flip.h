/* FLIP of two images at one exposure, for flip.c and hdr_flip.c. */
#ifndef MOIT_METRICS_FLIP_H
#define MOIT_METRICS_FLIP_H

#include "core/metrics/metrics.h"

/* Linear sRGB to XYZ over that of white: Rec. 709's primaries and D65 at (0.31271, 0.32902). */
static const double moit_xyz_over_white[3][3] = {
    {0.4338953888315031, 0.3762423726222511, 0.1898622385462458},
    {0.2126368216773238, 0.7151829818412507, 0.0721801964814255},
    {0.0177524231517299, 0.1094656286624651, 0.8727819481858050},
};

enum {
    FLIP_LANES = 16,      /* rows of floats come in whole multiples of this: the widest lanes' */
    FLIP_MOST_REACH = 10, /* taps of a filter on either side, at 67.02 pixels per degree */
};

/* A separable filter's row of weights, centre first. The other side mirrors it, with the opposite
 * sign where odd. */
typedef struct {
    int reach;
    bool odd;
    float weights[FLIP_MOST_REACH + 1];
} flip_filter;

/* What a table for one instruction set has; the bits are the same in all. */
typedef struct {
    /* out += sum over k of weights[k] lines[FLIP_MOST_REACH + k]. */
    void (*add_filtered)(const flip_filter *filter, const float *const *lines, float *restrict out,
                         int64_t stride);
    /* The FLIP errors of a row from its FLIP_ROWS filtered rows of either image, `stride` apart.
     * `errors` may be the first row of `image`. */
    void (*errors)(const float from_opponent[3][3], const float *image, const float *reference,
                   float *errors, int64_t stride);
} flip_lines;

const flip_lines *moit_flip_lines_of(moit_isa isa);

/* A curve from linear radiance to the display's linear [0, 1], in place. */
typedef struct {
    void (*apply)(double exposure, double *row, int64_t width);
    double exposure; /* in stops */
} flip_display;

/* Everything a comparison needs, allocated once for any number of exposures. */
typedef struct {
    const moit_image *images[2];
    const flip_lines *lines;
    int64_t stride; /* of a row of floats, in whole lanes */
    flip_display display;
    flip_filter luminance, red_green, blue_yellow[2]; /* contrast sensitivity */
    flip_filter smooth, edge, point;                  /* features */
    float to_opponent[3][3], from_opponent[3][3];
    float *planes; /* both images, filtered along rows */
    void *scratch; /* of each worker */
    float *map;    /* (height, width) the greatest errors so far */
} flip_comparison;

/* Fills in the filters and the matrices. */
void moit_flip_prepare(flip_comparison *flip);

/* What is compared at each pixel: rows of a filtered image, in this order. */
typedef enum {
    FLIP_Y, /* opponent space */
    FLIP_RED_GREEN,
    FLIP_BLUE_YELLOW,
    FLIP_EDGE_X, /* gradients */
    FLIP_EDGE_Y,
    FLIP_POINT_X,
    FLIP_POINT_Y,
    FLIP_ROWS
} flip_row;

/* Raises every pixel of the map to the error seen on `display`, where that is greater. */
moit_status moit_flip_see(flip_comparison *flip, flip_display display, const moit_run *run);

/* The metric whose errors `see` gathers, by moit_flip_see at one or more exposures. */
moit_status moit_flip_pool(const moit_image *image, const moit_image *reference, void *map,
                           double *error,
                           moit_status (*see)(flip_comparison *flip, const moit_run *run),
                           const moit_run *run);

#endif
