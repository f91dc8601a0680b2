#include "core/squares.h"

moit_squares moit_squares_of(const moit_fragments *f, int64_t side) {
    int64_t width = f->width ? f->width : f->pixels;
    moit_squares s = {.side = side,
                      .width = width,
                      .height = width ? f->pixels / width : 0,
                      .across = 1,
                      .down = 1};
    if (!side) return s;
    s.left = (f->left % side + side) % side;
    s.top = (f->top % side + side) % side;
    s.across = (s.left + s.width + side - 1) / side;
    s.down = (s.top + s.height + side - 1) / side;
    return s;
}

int64_t moit_square_at(const moit_squares *s, int64_t pixel) {
    if (!s->side) return 0;
    int64_t x = pixel % s->width + s->left, y = pixel / s->width + s->top;
    return y / s->side * s->across + x / s->side;
}

static int64_t within(int64_t x, int64_t most) { return x < 0 ? 0 : x < most ? x : most; }

static int64_t left_of(const moit_squares *s, int64_t square) {
    return square % s->across * s->side - s->left;
}

static int64_t top_of(const moit_squares *s, int64_t square) {
    return square / s->across * s->side - s->top;
}

int64_t moit_square_pixels(const moit_squares *s, int64_t square) {
    int64_t x = left_of(s, square), y = top_of(s, square);
    return (within(x + s->side, s->width) - within(x, s->width))
           * (within(y + s->side, s->height) - within(y, s->height));
}

bool moit_is_square_middle(const moit_squares *s, int64_t pixel) {
    int64_t square = moit_square_at(s, pixel);
    return pixel % s->width == within(left_of(s, square) + s->side / 2, s->width - 1)
           && pixel / s->width == within(top_of(s, square) + s->side / 2, s->height - 1);
}

moit_between moit_between_squares(int64_t place, int64_t side, int64_t there) {
    int64_t beyond = place - side; /* the first square's middle */
    int64_t low = beyond < 0 ? 0 : beyond / (2 * side), high = beyond < 0 ? 0 : low + 1;
    double share = beyond < 0 ? 0.0 : (double)(beyond - 2 * side * low) / (double)(2 * side);
    int64_t last = there - 1;
    return (moit_between){low < last ? low : last, high < last ? high : last, share};
}

moit_between moit_squares_across(const moit_squares *s, int64_t pixel) {
    return moit_between_squares(2 * (pixel % s->width + s->left) + 1, s->side, s->across);
}

moit_between moit_squares_down(const moit_squares *s, int64_t pixel) {
    return moit_between_squares(2 * (pixel / s->width + s->top) + 1, s->side, s->down);
}
