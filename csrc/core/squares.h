/* Squares of pixels that an image is cut into. They count from display coordinates 0, 0, so that
 * crops have the squares of the whole; those at the image's edges may be cut off. */
#ifndef MOIT_SQUARES_H
#define MOIT_SQUARES_H

#include "moit.h"

typedef struct moit_squares {
    int64_t side, left, top; /* pixels that the first has beyond the image */
    int64_t width, height;   /* of the image in pixels */
    int64_t across, down;    /* how many squares */
} moit_squares;

/* side 0: the image is one. */
moit_squares moit_squares_of(const moit_fragments *f, int64_t side);

int64_t moit_square_at(const moit_squares *squares, int64_t pixel);

/* How many pixels of the image a square has. */
int64_t moit_square_pixels(const moit_squares *squares, int64_t square);

/* Whether the pixel holds the middle of its whole square, or is next to it in the image. */
bool moit_is_square_middle(const moit_squares *squares, int64_t pixel);

/* The two squares between whose middles a pixel lies, and the share of the second. `place` is the
 * distance from the first square's edge to the pixel's middle, in half pixels. */
typedef struct moit_between {
    int64_t low, high;
    double share;
} moit_between;

moit_between moit_between_squares(int64_t place, int64_t side, int64_t there);

/* The same of a pixel of the image, along its row and along its column. */
moit_between moit_squares_across(const moit_squares *squares, int64_t pixel);
moit_between moit_squares_down(const moit_squares *squares, int64_t pixel);

#endif
