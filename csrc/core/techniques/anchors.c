/* Anchors: fragments that matter most occlude exactly, all others as cells between them have them
 * (kernels/anchors.h). */
#include "core/elementary.h"
#include "core/techniques/options.h"
#include "core/techniques/table.h"

#include "kernels/anchor_numbers.h"

#include <math.h>

static bool anchors_fit(const moit_technique *technique) {
    return technique->anchors.cells >= 1 && technique->anchors.cells <= MOST_CELLS;
}

static int numbers_of(const moit_technique *technique) {
    return MOIT_ANCHOR_NUMBERS(technique->count, technique->anchors.cells);
}

static size_t bytes_of_numbers(const moit_job *job, int pixels) {
    return ((size_t)pixels * (size_t)numbers_of(job->technique) * job->scalar + 7) / 8 * 8;
}

size_t moit_bytes_of_keys(bool large, int fragments) {
    return (size_t)fragments * (large ? sizeof(uint64_t) : sizeof(uint32_t));
}

/* z in [0, 1] becomes what keys have of depth. */
void moit_words_of_keys(const moit_job *job, bool large, int n, void *z) {
    (large ? job->stages->fine_words : job->stages->words)(n, z);
}

static size_t anchors_scratch(const moit_job *job, int fragments, int pixels) {
    return bytes_of_numbers(job, pixels)
           + moit_bytes_of_keys(job->technique->anchors.large_keys, fragments);
}

/* What each pixel keeps, into tile->own; words into tile->z; tile->absorbance becomes -1 of
 * fragments that are kept. */
static void gather(const moit_job *job, moit_tile *tile) {
    const moit_technique *technique = job->technique;
    moit_precision precision = job->fragments->precision;
    int kept = technique->count, cells = technique->anchors.cells, width = numbers_of(technique);
    bool large = technique->anchors.large_keys;
    void *keys = tile->own + bytes_of_numbers(job, tile->pixels);
    job->stages->absorbance(tile->fragments, tile->alpha, job->max_alpha, tile->absorbance);
    moit_warp_tile(job, tile);
    job->stages->anchor_keys(large, technique->anchors.gamma, tile->fragments, tile->alpha, tile->z,
                             keys);
    job->stages->anchors(large, kept, cells, 1.0 - job->max_alpha, tile->pixels, tile->offsets,
                         tile->alpha, tile->z, keys, tile->absorbance, tile->own);
    for (int p = 0; p < tile->pixels; ++p) {
        int64_t first = (int64_t)p * width + 2 + kept;
        double absorbed = 0.0, steps = 0.0;
        for (int k = 0; k < kept; ++k) absorbed += moit_number(precision, tile->own, first + k);
        for (int c = 0; c < kept + cells; ++c)
            steps += moit_number(precision, tile->own, first + kept + c);
        tile->double_b0[p] = absorbed + steps / ANCHOR_STEPS;
    }
    job->precise->decay(tile->pixels, tile->double_b0, tile->total);
}

static void anchors_weigh(const moit_job *job, moit_tile *tile) {
    gather(job, tile);
    job->stages->anchor_transmittance(job->technique->count, job->technique->anchors.cells,
                                      tile->pixels, tile->offsets, tile->z, tile->absorbance,
                                      tile->own, tile->T);
}

static void anchors_curve(const moit_job *job, moit_tile *tile) {
    gather(job, tile);
    moit_moments_warp_curve(job, tile);
    moit_words_of_keys(job, job->technique->anchors.large_keys, tile->curve_offsets[tile->pixels],
                       tile->curve_z);
    job->stages->anchor_transmittance(job->technique->count, job->technique->anchors.cells,
                                      tile->pixels, tile->curve_offsets, tile->curve_z, NULL,
                                      tile->own, tile->curve);
}

/* ---- Bounds ---------------------------------------------------------------------------------- */

/* What a pixel's state proves: of each that is kept the least and the greatest absorbance that its
 * key may stand for, what rounding may have changed in all cells together, what is absorbed
 * beyond what fragments count with, and what is counted in the cell of the least key, too, where
 * that is full. */
typedef struct {
    const char *numbers;
    int kept, cells;
    double nearest, width;
    double word[MOST_KEPT], least[MOST_KEPT], most[MOST_KEPT];
    double slack, hidden, taken;
    int taken_at;
} proof;

static double number_of(const moit_job *job, const proof *it, int k) {
    return moit_number(job->fragments->precision, it->numbers, k);
}

/* The cell of a word, as kernels/anchors.h has it. */
static int cell_of(const proof *it, double word) {
    int cell = 0;
    for (int k = 0; k < it->kept; ++k) cell += it->word[k] <= word;
    double whole = floor(word);
    for (int j = 1; j < it->cells; ++j) cell += (whole - it->nearest) * it->cells >= j * it->width;
    return cell;
}

static void read_key(proof *it, int k, double word, double absorbed) {
    double root = rint(ANCHOR_ROOTS * moit_exp(-0.5 * absorbed));
    it->word[k] = word;
    it->least[k] = fmax(-2.0 * moit_log((root + 0.501) / ANCHOR_ROOTS), 0.0);
    it->most[k] = root > 0.501 ? -2.0 * moit_log((root - 0.501) / ANCHOR_ROOTS) : __builtin_inf();
    if (word == ANCHOR_NOWHERE) it->least[k] = it->most[k] = 0.0;
}

static proof proof_of(const moit_job *job, const moit_tile *tile, int p) {
    moit_precision precision = job->fragments->precision;
    const moit_technique *technique = job->technique;
    int kept = technique->count, others = 0, without_place = 0;
    proof it = {.kept = kept, .cells = technique->anchors.cells};
    it.numbers = tile->own + (size_t)p * (size_t)numbers_of(technique) * job->scalar;
    it.nearest = number_of(job, &it, 0);
    it.width = number_of(job, &it, 1) - it.nearest + 1.0;
    for (int k = 0; k < kept; ++k) {
        read_key(&it, k, number_of(job, &it, 2 + k), number_of(job, &it, 2 + kept + k));
        without_place -= it.word[k] != ANCHOR_NOWHERE;
    }
    double held = -moit_log1p(-job->max_alpha);
    for (int i = tile->offsets[p]; i < tile->offsets[p + 1]; ++i) {
        double absorbed = -moit_log1p(-moit_number(precision, tile->alpha, i));
        bool is_kept = moit_number(precision, tile->absorbance, i) < 0.0;
        double counted = is_kept ? held : fmin(held, ANCHOR_FULL / ANCHOR_STEPS);
        if (absorbed > counted) it.hidden += absorbed - counted;
        without_place += is_kept;
        others += !is_kept;
    }
    double last = number_of(job, &it, 2 + 2 * kept - 1);
    it.taken_at = cell_of(&it, it.word[kept - 1]);
    for (int k = 0; k < kept; ++k)
        if (it.word[k] == it.word[kept - 1] && number_of(job, &it, 2 + kept + k) == last)
            it.taken += fmin(ceil(last * ANCHOR_STEPS), ANCHOR_FULL);
    it.slack = others * (1.001 / ANCHOR_STEPS);
    if (without_place > 0) {
        it.slack += without_place * (2.0 / ANCHOR_STEPS);
        it.hidden += without_place * (it.most[kept - 1] - last);
        it.slack += without_place * (last - it.least[kept - 1]);
    }
    return it;
}

/* Between what is surely in front of a word and what may be: a word to each side is not sure, as
 * rounding may have put two depths the wrong way round. alpha: of the fragment that asks, own: as
 * the stages have it; both 0 of a depth. */
static void bounds_at(const moit_job *job, const proof *it, double word, double alpha, double own,
                      double *lower, double *upper) {
    double least = 0.0, most = it->hidden, absorbed = -moit_log1p(-alpha);
    int from = cell_of(it, word - 1.0), to = cell_of(it, word + 1.0);
    bool takes_itself = own < 0.0;
    for (int k = 0; k < it->kept; ++k) {
        if (it->word[k] < word - 1.0) least += it->least[k];
        bool itself = takes_itself && it->word[k] == word && it->least[k] <= absorbed
                      && absorbed <= it->most[k];
        if (itself) takes_itself = false;
        else if (it->word[k] <= word + 1.0) most += it->most[k];
    }
    for (int c = 0; c <= to; ++c) {
        double steps = number_of(job, it, 2 + 2 * it->kept + c);
        bool is_full = steps >= ANCHOR_FULL;
        double twice = is_full && c == it->taken_at ? fmin(it->taken, steps) : 0.0;
        if (c < from) least += (steps - twice) / ANCHOR_STEPS;
        most += is_full ? __builtin_inf() : steps / ANCHOR_STEPS;
    }
    double counted = fmin(fmax(own, 0.0), ANCHOR_FULL / ANCHOR_STEPS);
    most = fmax(most + it->slack - counted, 0.0);
    *lower = moit_exp(-most) * (1.0 - 0x1p-20);
    *upper = fmin(moit_exp(-fmax(least - it->slack, 0.0)) * (1.0 + 0x1p-20), 1.0);
}

static void anchors_bounds(const moit_job *job, moit_tile *tile, double *lower, double *upper) {
    moit_precision precision = job->fragments->precision;
    gather(job, tile);
    if (job->depths) {
        moit_moments_warp_curve(job, tile);
        moit_words_of_keys(job, job->technique->anchors.large_keys,
                           tile->curve_offsets[tile->pixels], tile->curve_z);
    }
    /* what lies in front of all is proved exactly */
    job->stages->products(tile->pixels, tile->offsets, tile->alpha, tile->total);
    const int32_t *offsets = job->depths ? tile->curve_offsets : tile->offsets;
    for (int p = 0; p < tile->pixels; ++p) {
        proof it = proof_of(job, tile, p);
        for (int i = offsets[p]; i < offsets[p + 1]; ++i) {
            bool asks = !job->depths;
            bounds_at(job, &it, moit_number(precision, asks ? tile->z : tile->curve_z, i),
                      asks ? moit_number(precision, tile->alpha, i) : 0.0,
                      asks ? moit_number(precision, tile->absorbance, i) : 0.0, lower + i,
                      upper + i);
        }
    }
}

const moit_technique_row moit_anchors_row = {
    .name = "anchors",
    OPTIONS(COUNT, WARPED, WHOLE("cells", anchors.cells, 1, MOST_CELLS),
            NUMBER("gamma", anchors.gamma), TRUTH("large_keys", anchors.large_keys)),
    .usual_counts = (const int[]){4, 0},
    .least_count = 1,
    .most_count = MOST_KEPT,
    .fits = anchors_fit,
    .weigh = anchors_weigh,
    .curve = anchors_curve,
    .bounds = anchors_bounds,
    .scratch = anchors_scratch,
    .unit_range = {0.0, 1.0},
    .uses_warp = true,
    .reconstructs = true,
    .takes_points = true,
    .geometry_passes = 3};
