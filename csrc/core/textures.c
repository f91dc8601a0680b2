/* The levels of images on triangles. */
#include "moit.h"

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

static void put_mean(const float *from, int width, int height, int columns, int rows, int x, int y,
                     float *out) {
    /* a texel of the smaller image has `width` units of the row, one of the larger `columns` */
    int64_t left = (int64_t)x * width, right = left + width;
    int64_t top = (int64_t)y * height, bottom = top + height;
    double even[3] = {0}, seen[3] = {0}, alpha = 0.0, area = (double)width * height;
    for (int64_t i = top / rows; i * rows < bottom; ++i)
        for (int64_t k = left / columns; k * columns < right; ++k) {
            const float *texel = from + 4 * (i * width + k);
            double share = overlap(k, columns, left, right) * overlap(i, rows, top, bottom) / area;
            double covers = share * (double)texel[3];
            alpha += covers;
            for (int c = 0; c < 3; ++c) {
                even[c] += share * (double)texel[c];
                seen[c] += covers * (double)texel[c];
            }
        }
    for (int c = 0; c < 3; ++c) out[c] = (float)(alpha > 0.0 ? seen[c] / alpha : even[c]);
    out[3] = (float)fmin(alpha, 1.0);
}

void moit_fill_levels(int width, int height, float *texels) {
    while (width > 1 || height > 1) {
        const float *from = texels;
        int columns = half(width), rows = half(height);
        texels += 4 * (int64_t)width * height;
        for (int y = 0; y < rows; ++y)
            for (int x = 0; x < columns; ++x)
                put_mean(from, width, height, columns, rows, x, y,
                         texels + 4 * ((int64_t)y * columns + x));
        width = columns;
        height = rows;
    }
}
