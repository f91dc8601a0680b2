/* Whatever a technique's curve is, where it renormalises the only fragment of a pixel counts as
 * much as it covers: those pixels, of which pictures have many, need no moments. */
#include "core/alone.h"

#include "core/techniques/moments.h"
#include "core/techniques/table.h"

#include <string.h>

/* Where fewer than one pixel in so many is alone, taking it out costs more than it saves; of four
 * moments or fewer a row may say another number, as their rules take less. */
enum { WORTH_IT = 8, FEW_MOMENTS = 4 };

/* Those whose total is exp(-b0), of a b0 that is one fragment's absorbance, neither rounded to
 * fewer bits nor a block's. In floats alone: the last bit of a double would be another. */
bool moit_takes_alone(const moit_job *job) {
    const moit_technique *technique = job->technique;
    const moit_technique_row *row = moit_technique_rows[technique->kind];
    return job->fragments->precision == MOIT_FLOAT32 && technique->normalize && !job->blocks
           && !job->fragments->transmission
           && (row->weigh == moit_moments_weigh || row->weigh == moit_bounded_weigh)
           && !row->scales_alpha && !moit_stores_words(technique) && !moit_stores_halves(technique)
           && !moit_extents_are_words(technique);
}

static bool are_many(const moit_technique *technique, const moit_tile *tile) {
    int alone = 0, worth = moit_technique_rows[technique->kind]->alone_in_few;
    if (technique->count > FEW_MOMENTS || !worth) worth = WORTH_IT;
    for (int p = 0; p < tile->pixels; ++p) alone += tile->offsets[p + 1] - tile->offsets[p] == 1;
    return alone > 0 && alone * worth >= tile->pixels;
}

static void move(const moit_job *job, void *to, int k, const void *from, int i, int n, int width) {
    size_t size = job->scalar * (size_t)width;
    if (!from || n == 0) return;
    memcpy((char *)to + (size_t)k * size, (const char *)from + (size_t)i * size, (size_t)n * size);
}

/* Lists pixels that are alone in tile->alone, with their fragments' places in tile->alone_at, and
 * moves the others' fragments together. Gives how many are alone. */
static int take_apart(const moit_job *job, moit_tile *tile) {
    int alone = 0, pixels = 0, kept = 0, run = 0, end = 0, all = tile->pixels;
    for (int p = 0; p <= all; ++p) {
        int first = end, place = p < all && tile->place ? tile->place[p] : p;
        if (p < all) end = tile->offsets[p + 1];
        if (p < all && end - first != 1) {
            tile->filled[pixels] = place;
            tile->offsets[++pixels] = kept + (end - run);
            continue;
        }
        move(job, tile->kept_depth, kept, tile->depth, run, first - run, 1);
        move(job, tile->kept_alpha, kept, tile->alpha, run, first - run, 1);
        move(job, tile->kept_color, kept, tile->color, run, first - run, 3);
        kept += first - run;
        run = end;
        if (p == all) break;
        tile->alone[alone] = place;
        tile->alone_at[alone++] = first;
    }
    tile->place = tile->filled;
    tile->pixels = pixels;
    tile->fragments = tile->given = kept;
    tile->depth = tile->kept_depth;
    tile->alpha = tile->emission = tile->kept_alpha;
    if (tile->color) tile->color = tile->kept_color;
    return alone;
}

void moit_composite_alone(const moit_job *job, moit_tile *tile, const double *background,
                          bool per_pixel, void *out) {
    moit_precision precision = job->fragments->precision;
    const void *alpha = tile->alpha, *color = tile->color;
    if (tile->source || tile->opacity[0] || tile->weights || !are_many(job->technique, tile))
        return;
    int alone = take_apart(job, tile);
    for (int k = 0; k < alone; ++k)
        moit_set_number(precision, tile->kept_weights, k,
                        moit_number(precision, alpha, tile->alone_at[k]));
    job->stages->absorbance(alone, tile->kept_weights, job->max_alpha, tile->absorbance);
    for (int k = 0; k < alone; ++k)
        tile->double_b0[k] = moit_number(precision, tile->absorbance, k);
    job->precise->decay(alone, tile->double_b0, tile->total);
    for (int k = 0; k < alone; ++k) {
        double covers = 1.0 - tile->total[k], *sum = tile->sums + 4 * k;
        for (int c = 0; c < 3; ++c)
            sum[c] =
                color ? covers * moit_number(precision, color, 3 * tile->alone_at[k] + c) : 0.0;
        sum[3] = covers;
    }
    job->stages->over(alone, tile->alone, tile->total, tile->sums, SCALE_NOT, background, per_pixel,
                      out);
}
