/* FLIP of two images at one exposure, for flip.c and hdr_flip.c. */
#ifndef MOIT_METRICS_FLIP_H
#define MOIT_METRICS_FLIP_H

#include "core/metrics/blocks.h"

/* Linear sRGB to XYZ over that of white: Rec. 709's primaries and D65 at (0.31271, 0.32902). */
static const double moit_xyz_over_white[3][3] = {
    {0.4338953888315031, 0.3762423726222511, 0.1898622385462458},
    {0.2126368216773238, 0.7151829818412507, 0.0721801964814255},
    {0.0177524231517299, 0.1094656286624651, 0.8727819481858050},
};

/* The seven rows that filtering along one row of opponent colours leaves. */
typedef enum {
    FLIP_LUMINANCE,
    FLIP_NARROW_RED_GREEN,
    FLIP_NARROW_BLUE_YELLOW,
    FLIP_WIDE_BLUE_YELLOW,
    FLIP_SMOOTH,
    FLIP_EDGE,
    FLIP_POINT,
    FLIP_PLANES
} flip_plane;

/* What is compared at each pixel: Hunt's L*, a*, b*, and the lengths of two gradients. */
typedef enum { FLIP_L, FLIP_A, FLIP_B, FLIP_EDGES, FLIP_POINTS, FLIP_SEEN } flip_seen_row;

/* A block as an eye sees it, of rows that have been asked for. */
typedef struct {
    uint64_t rows; /* bit y: row y is there */
    float values[BLOCK_SIDE][FLIP_SEEN][BLOCK_SIDE];
} flip_seen;

/* A separable filter's row of weights, centre first. The other side mirrors it: `edge`'s with the
 * opposite sign. */
typedef struct {
    int reach;
    float weights[BLOCK_REACH + 1];
} flip_filter;

typedef struct {
    flip_filter luminance, red_green, blue_yellow[2]; /* contrast sensitivity */
    flip_filter smooth, edge, point;                  /* features, of one reach */
    float to_opponent[3][3], from_opponent[3][3];
} flip_filters;

/* Narkowicz's fit of the ACES curve, without the 0.6 of exposure that it contains:
 * x (square x + slope) / (x (square_below x + slope_below) + constant_below). */
#define MOIT_ACES_SQUARE (0.36 * 2.51)
#define MOIT_ACES_SLOPE (0.6 * 0.03)
#define MOIT_ACES_SQUARE_BELOW (0.36 * 2.43)
#define MOIT_ACES_SLOPE_BELOW (0.6 * 0.59)
#define MOIT_ACES_CONSTANT_BELOW 0.14

/* From linear radiance to the display's linear [0, 1]: clipped, or exposed first, by 2^exposure on
 * the ACES curve. */
typedef struct {
    bool exposed;
    double root; /* of 2^exposure: applied twice, as 2^exposure itself may overflow */
} flip_display;

/* What a table for one instruction set has, of rows of a block; the bits are the same in all. */
typedef struct {
    /* Three rows of radiance, round a block, in opponent space as the display shows them. */
    void (*show)(const flip_filters *filters, flip_display display, const double *const rgb[3],
                 float opponent[3][BLOCK_STRIDE]);
    /* All filters along a row: `opponent` begins BLOCK_REACH before the block. */
    void (*along)(const flip_filters *filters, const float opponent[3][BLOCK_STRIDE],
                  float planes[FLIP_PLANES][BLOCK_SIDE]);
    /* All filters across rows, of which planes[BLOCK_REACH] is the one that is seen. */
    void (*see)(const flip_filters *filters, const float planes[][FLIP_PLANES][BLOCK_SIDE],
                float seen[FLIP_SEEN][BLOCK_SIDE]);
    /* Raises errors to those between two rows. */
    void (*raise)(const float image[FLIP_SEEN][BLOCK_SIDE],
                  const float reference[FLIP_SEEN][BLOCK_SIDE], float errors[BLOCK_SIDE]);
} flip_lines;

const flip_lines *moit_flip_lines_of(moit_isa isa);

void moit_flip_prepare(flip_filters *filters);

/* The exposures of HDR-FLIP, in stops. */
typedef struct {
    double start, stop;
    int exposures; /* at least two */
} flip_range;

/* The metric of errors seen on `count` displays: of each pixel the greatest counts. kept, if not
 * NULL: (count, blocks) pointers to how the reference is seen. */
moit_status moit_flip_on(const moit_image *image, moit_reference *reference,
                         const flip_display *displays, int count, flip_seen **kept, void *map,
                         double *error, const moit_run *run);

#endif
