/* The levels of images on triangles. */
#include "moit_geometry.h"

#include <math.h>

static int half(int side) { return side > 1 ? side / 2 : 1; }

int64_t moit_level_texels(int width, int height) {
    int64_t sum = (int64_t)width * height;
    while (width > 1 || height > 1) {
        width = half(width);
        height = half(height);
        sum += (int64_t)width * height;
    }
    return sum;
}

/* What of texel `at` lies between the ends, all in units of which a texel has so many. */
static double overlap(int64_t at, int64_t units, int64_t begin, int64_t end) {
    int64_t low = at * units, high = low + units;
    if (low < begin) low = begin;
    if (high > end) high = end;
    return (double)(high - low);
}

typedef struct {
    double even[3], seen[3], alpha; /* colour as it is and by alpha */
} sums;

static void add(sums *s, const float *texel, double share) {
    double covers = share * (double)texel[3];
    s->alpha += covers;
    for (int c = 0; c < 3; ++c) {
        s->even[c] += share * (double)texel[c];
        s->seen[c] += covers * (double)texel[c];
    }
}

/* A texel of the smaller image has `width` units of a row, one of the larger `columns`. */
static sums sums_of(const float *from, int width, int height, int columns, int rows, int x, int y) {
    sums s = {0};
    int64_t left = (int64_t)x * width, right = left + width;
    int64_t top = (int64_t)y * height, bottom = top + height;
    double area = (double)width * height;
    for (int64_t i = top / rows; i * rows < bottom; ++i)
        for (int64_t k = left / columns; k * columns < right; ++k)
            add(&s, from + 4 * (i * width + k),
                overlap(k, columns, left, right) * overlap(i, rows, top, bottom) / area);
    return s;
}

/* The same where both sides are even. */
static sums sums_of_four(const float *from, int width, int x, int y) {
    sums s = {0};
    for (int i = 2 * y; i < 2 * y + 2; ++i)
        for (int k = 2 * x; k < 2 * x + 2; ++k) add(&s, from + 4 * ((int64_t)i * width + k), 0.25);
    return s;
}

static void put_mean(const sums *s, float *out) {
    for (int c = 0; c < 3; ++c)
        out[c] = (float)(s->alpha > 0.0 ? s->seen[c] / s->alpha : s->even[c]);
    out[3] = (float)fmin(s->alpha, 1.0);
}

void moit_fill_levels(int width, int height, float *texels) {
    while (width > 1 || height > 1) {
        const float *from = texels;
        int columns = half(width), rows = half(height);
        texels += 4 * (int64_t)width * height;
        bool even = width == 2 * columns && height == 2 * rows;
        for (int y = 0; y < rows; ++y)
            for (int x = 0; x < columns; ++x) {
                sums s = even ? sums_of_four(from, width, x, y)
                              : sums_of(from, width, height, columns, rows, x, y);
                put_mean(&s, texels + 4 * ((int64_t)y * columns + x));
            }
        width = columns;
        height = rows;
    }
}
