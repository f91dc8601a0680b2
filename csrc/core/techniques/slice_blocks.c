/* What pixels read of slices that blocks of pixels keep: of the blocks around each. */
#include "core/techniques/slices.h"

#include <math.h>
#include <string.h>

/* Blocks along a row or column whose middles are around a pixel, and their shares. */
typedef struct {
    int64_t at[4];
    double share[4];
} around;

static int64_t within_blocks(int64_t block, int64_t there) {
    return block < 0 ? 0 : block < there ? block : there - 1;
}

static around two_blocks(int64_t pixel, int64_t side, int64_t there) {
    moit_between b = moit_between_squares(2 * pixel + 1, side, there);
    return (around){{b.low, b.high}, {1.0 - b.share, b.share}};
}

/* Of a cubic B-spline. */
static around four_blocks(int64_t pixel, int64_t side, int64_t there) {
    int64_t twice = 2 * pixel + 1 - side, low = twice < 0 ? -1 : twice / (2 * side);
    double in = (double)(twice - 2 * side * low) / (double)(2 * side), rest = 1.0 - in;
    around a = {.share = {rest * rest * rest / 6.0, (4.0 - in * in * (6.0 - 3.0 * in)) / 6.0,
                          (4.0 - rest * rest * (6.0 - 3.0 * rest)) / 6.0, in * in * in / 6.0}};
    for (int k = 0; k < 4; ++k) a.at[k] = within_blocks(low - 1 + k, there);
    return a;
}

/* The blocks around each of the tile's pixels, and their shares. */
static void find_corners(const moit_squares *b, const moit_tile *tile,
                         const moit_slice_rows *rows) {
    int n = rows->corners, of_row = n > 4 ? 4 : 2;
    around (*blocks)(int64_t, int64_t, int64_t) = n > 4 ? four_blocks : two_blocks;
    for (int p = 0; p < tile->pixels; ++p) {
        int64_t pixel = moit_pixel_at(tile, p), row = pixel / b->width;
        around x = blocks(pixel - row * b->width + b->left, b->side, b->across),
               y = blocks(row + b->top, b->side, b->down);
        for (int k = 0; k < n; ++k) {
            rows->corner[n * p + k] = y.at[k / of_row] * b->across + x.at[k % of_row];
            rows->share[n * p + k] = y.share[k / of_row] * x.share[k % of_row];
        }
    }
}

/* Sides of regions are multiples of those of blocks. */
int64_t moit_slice_region_of(const moit_slices *slices, int64_t block) {
    const moit_squares *b = &slices->blocks, *r = &slices->regions;
    if (!r->side) return 0;
    int64_t x = block % b->across * b->side + (r->left - b->left),
            y = block / b->across * b->side + (r->top - b->top);
    return y / r->side * r->across + x / r->side;
}

double moit_slice_steps_of(const moit_slices *slices, int64_t block) {
    return slices->sums[block * (slices->slots + 3) + slices->slots + 2];
}

/* What a byte holds of a pixel's total beside that of its block: their ratio, six digits of eight
 * octaves, the last of which has the number of a block's pixels. Rounded by Dekker's splitting. */
static double by_a_byte(const moit_slices *slices, int64_t pixel, double total) {
    const moit_squares *b = &slices->blocks;
    double of_block = moit_slice_steps_of(slices, moit_square_at(b, pixel)) * slices->quantum,
           octave = 1.0;
    if (of_block < 0x1p-10) of_block = 0x1p-10;
    while (octave < (double)(b->side * b->side)) octave *= 2.0;
    double ratio = total / of_block, turned = ratio * (0x1p47 + 1.0),
           rounded = turned - (turned - ratio);
    return of_block * fmin(fmax(rounded, 0x1p-8 * octave), octave);
}

/* Totals of pixels of their own, into tile->double_b0. */
static void find_own_totals(const moit_job *job, const moit_tile *tile,
                            const moit_slice_rows *rows) {
    moit_precision precision = job->fragments->precision;
    job->stages->fine_codes(tile->fragments, tile->absorbance, rows->near);
    for (int p = 0; p < tile->pixels; ++p) {
        double fine = 0.0; /* whole numbers: exact */
        for (int i = tile->offsets[p]; i < tile->offsets[p + 1]; ++i)
            fine += moit_number(precision, rows->near, i);
        tile->double_b0[p] = fine * 0x1p-16;
    }
    if (job->technique->slices.half_total)
        job->precise->half_absorbance(tile->pixels, tile->double_b0, tile->double_b0);
    for (int p = 0; job->technique->slices.byte_total && p < tile->pixels; ++p)
        tile->double_b0[p] = by_a_byte(job->prepared, moit_pixel_at(tile, p), tile->double_b0[p]);
}

/* Of the blocks around a pixel those count more whose totals are as its own: where geometry ends
 * within a block they have been drawn of other surfaces. */
static void weigh_by_totals(const moit_slices *slices, const moit_tile *tile,
                            const moit_slice_rows *rows) {
    for (int p = 0; p < tile->pixels; ++p) {
        double *share = rows->share + 4 * p, sum = 0.0;
        for (int k = 0; k < 4; ++k) {
            double total = moit_slice_steps_of(slices, rows->corner[4 * p + k]) * slices->quantum,
                   own = tile->double_b0[p],
                   apart = 8.0 * (total - own) / (fmax(total, own) + 0x1p-10);
            share[k] *= 1.0 / (1.0 + apart * apart) + 0x1p-10;
            sum += share[k];
        }
        for (int k = 0; k < 4; ++k) share[k] /= sum;
    }
}

static void give_totals(const moit_job *job, const moit_tile *tile, const int32_t *offsets,
                        const moit_slice_places *places, const moit_slice_rows *rows) {
    const moit_slices *slices = job->prepared;
    moit_precision precision = job->fragments->precision;
    for (int p = 0; p < tile->pixels; ++p) {
        double steps = 0.0;
        for (int k = 0; k < 4; ++k)
            steps += rows->share[4 * p + k] * moit_slice_steps_of(slices, rows->corner[4 * p + k]);
        double low = steps * slices->quantum;
        for (int i = offsets[p]; i < offsets[p + 1]; ++i) {
            moit_set_number(precision, places->low, i, low);
            moit_set_number(precision, places->full, i,
                            job->technique->full_total ? tile->double_b0[p] : low);
        }
    }
}

/* Shares that go by opaque surfaces, in place of bilinear ones. */
static void guide(const moit_job *job, const moit_tile *tile, const moit_slice_rows *rows) {
    const moit_slices *slices = job->prepared;
    moit_blocks_around of;
    for (int first = 0; first < tile->pixels; first += MOIT_AROUND) {
        int n = tile->pixels - first < MOIT_AROUND ? tile->pixels - first : MOIT_AROUND;
        moit_find_blocks_around(job, &slices->blocks, &slices->guides, tile, first, n, &of);
        for (int i = 0; i < n; ++i)
            for (int k = 0; k < 4; ++k) rows->share[4 * (first + i) + k] = of.share[k][i];
    }
}

void moit_slice_corners(const moit_job *job, const moit_tile *tile, const moit_slice_rows *rows) {
    const moit_slices *slices = job->prepared;
    find_corners(&slices->blocks, tile, rows);
    if (slices->guides.guided) guide(job, tile, rows);
}

void moit_slice_corner(const moit_job *job, const moit_tile *tile, const int32_t *offsets,
                       const moit_slice_places *places, const moit_slice_rows *rows, int k) {
    const moit_slices *slices = job->prepared;
    moit_precision precision = job->fragments->precision;
    for (int p = 0; p < tile->pixels; ++p) {
        int64_t block = rows->corner[rows->corners * p + k];
        rows->table_of[p] = slices->table + moit_slice_region_of(slices, block) * slices->cells;
        rows->sums_of[p] = slices->sums + block * (slices->slots + 3);
        for (int i = offsets[p]; i < offsets[p + 1]; ++i)
            moit_set_number(precision, places->weight, i, rows->share[rows->corners * p + k]);
    }
    job->stages->slice_join(tile->pixels, offsets, rows->table_of, places->cell, places->slot,
                            places->from, places->share);
    job->stages->slice_shares(offsets[tile->pixels], places->from, places->share, NULL,
                              places->inside, places->joined, NULL, NULL);
}

void moit_slice_blocks_read(const moit_job *job, const moit_tile *tile, const int32_t *offsets,
                            const moit_slice_places *places, const moit_slice_rows *rows) {
    int n = offsets[tile->pixels];
    moit_slice_corners(job, tile, rows);
    if (job->technique->full_total) {
        find_own_totals(job, tile, rows);
        weigh_by_totals(job->prepared, tile, rows);
    }
    memset(places->depth, 0, ((size_t)n + MOIT_PADDING) * job->scalar);
    for (int k = 0; k < 4; ++k) {
        moit_slice_corner(job, tile, offsets, places, rows, k);
        job->stages->slice_fetch(tile->pixels, offsets, rows->sums_of, places->slot, places->before,
                                 places->at, places->behind);
        job->stages->slice_depths(n, places->before, places->at, places->behind, places->joined,
                                  places->twice);
        job->stages->slice_blend(n, places->weight, places->twice, places->depth);
    }
    give_totals(job, tile, offsets, places, rows);
}
