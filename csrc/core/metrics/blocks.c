/* Blocks of images: what they hold, where they differ, and the sums of their errors. */
#include "core/metrics/blocks.h"

#include <math.h>
#include <stdlib.h>

static int64_t blocks_along(int64_t length) { return (length + BLOCK_SIDE - 1) / BLOCK_SIDE; }

int64_t moit_blocks_across(const moit_image *image) { return blocks_along(image->width); }

int64_t moit_blocks_of(const moit_image *image) {
    return blocks_along(image->width) * blocks_along(image->height);
}

static int shorter(int64_t left) { return left < BLOCK_SIDE ? (int)left : BLOCK_SIDE; }

image_block moit_block_at(const moit_image *image, int64_t block) {
    const int64_t across = blocks_along(image->width);
    const int64_t x = block % across * BLOCK_SIDE, y = block / across * BLOCK_SIDE;
    return (image_block){x, y, shorter(image->width - x), shorter(image->height - y)};
}

static void load_block(const moit_image *image, const image_block *block, int reach,
                       int64_t (*inside)(int64_t at, int64_t count), block_source source) {
    const int step = image->channels, side = BLOCK_SIDE + 2 * reach;
    int64_t column[BLOCK_STRIDE];
    for (int x = 0; x < BLOCK_STRIDE; ++x)
        column[x] = step * inside(block->x - reach + (x < side ? x : side - 1), image->width);
    for (int y = 0; y < side; ++y) {
        const int64_t start = inside(block->y - reach + y, image->height) * image->width * step;
        double *r = source[0][y], *g = source[1][y], *b = source[2][y];
        if (image->precision == MOIT_FLOAT32) {
            const float *from = (const float *)image->pixels + start;
            for (int x = 0; x < BLOCK_STRIDE; ++x) {
                const float *pixel = from + column[x];
                r[x] = (double)pixel[0], g[x] = (double)pixel[1], b[x] = (double)pixel[2];
            }
        } else {
            const double *from = (const double *)image->pixels + start;
            for (int x = 0; x < BLOCK_STRIDE; ++x) {
                const double *pixel = from + column[x];
                r[x] = pixel[0], g[x] = pixel[1], b[x] = pixel[2];
            }
        }
    }
}

static void find_least_that_differ(const block_source a, const block_source b, int reach,
                                   double least[BLOCK_ROWS]) {
    for (int y = 0; y < BLOCK_SIDE + 2 * reach; ++y) {
        double lowest = (double)INFINITY;
        for (int channel = 0; channel < 3; ++channel) {
            const double *p = a[channel][y], *q = b[channel][y];
            for (int x = 0; x < BLOCK_STRIDE; ++x) {
                double lower = p[x] < q[x] ? p[x] : q[x];
                lower = p[x] != q[x] ? lower : (double)INFINITY;
                lowest = lower < lowest ? lower : lowest;
            }
        }
        least[y] = lowest;
    }
}

void moit_load_both(const moit_image *image, const moit_image *reference, const image_block *block,
                    int reach, int64_t (*inside)(int64_t at, int64_t count), block_source of_image,
                    block_source of_reference, double least[BLOCK_ROWS]) {
    load_block(image, block, reach, inside, of_image);
    load_block(reference, block, reach, inside, of_reference);
    find_least_that_differ(of_image, of_reference, reach, least);
}

/* wide[y]: whether any of rows y to y + 2 reach is marked. */
static void reached_rows(const bool *marked, int reach, int rows, bool *wide) {
    int within = 0;
    for (int y = 0; y < 2 * reach; ++y) within += marked[y];
    for (int y = 0; y < rows; ++y) {
        within += marked[y + 2 * reach];
        wide[y] = within > 0;
        within -= marked[y];
    }
}

uint64_t moit_rows_within_reach(const image_block *block, int reach, const bool *marked) {
    bool reached[BLOCK_SIDE];
    reached_rows(marked, reach, BLOCK_SIDE, reached);
    uint64_t rows = 0;
    for (int y = 0; y < block->height; ++y) rows |= (uint64_t)reached[y] << y;
    return rows;
}

void moit_rows_needed(uint64_t rows, int reach, bool *needed) {
    bool marked[BLOCK_ROWS + 2 * BLOCK_REACH] = {false};
    for (int y = 0; y < BLOCK_SIDE; ++y) marked[y + 2 * reach] = rows >> y & 1;
    reached_rows(marked, reach, BLOCK_SIDE + 2 * reach, needed);
}

bool moit_begin_errors(block_errors *errors, const moit_image *image, void *map) {
    const int64_t rows = image->height * moit_blocks_across(image);
    *errors = (block_errors){image, map, malloc((size_t)rows * sizeof(double))};
    return errors->sums != NULL;
}

void moit_put_errors(const block_errors *errors, const image_block *block, int64_t index, int y,
                     const double *row, int first, int end) {
    const moit_image *image = errors->image;
    const int64_t across = moit_blocks_across(image), at = block->y + y;
    double sum = 0.0;
    for (int x = first; x < end; ++x) sum += row[x];
    errors->sums[at * across + index % across] = sum;
    if (!errors->map) return;
    const int64_t start = at * image->width + block->x;
    if (image->precision == MOIT_FLOAT32) {
        float *to = (float *)errors->map + start;
        for (int x = 0; x < block->width; ++x) to[x] = (float)row[x];
    } else {
        double *to = (double *)errors->map + start;
        for (int x = 0; x < block->width; ++x) to[x] = row[x];
    }
}

double moit_end_errors(block_errors *errors) {
    const int64_t across = moit_blocks_across(errors->image);
    double total = 0.0;
    for (int64_t y = 0; y < errors->image->height; ++y) {
        double sum = 0.0;
        for (int64_t i = 0; i < across; ++i) sum += errors->sums[y * across + i];
        total += sum;
    }
    free(errors->sums);
    return total;
}
