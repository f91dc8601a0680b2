/* Power moments on a tile, and by themselves. Constants: supplement of Muenstermann et al. 2018. */
#include "core/power_moments.h"
#include "core/techniques.h"
#include "core/threads.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The vectors are float32, as the published shaders hold them: where eight moments are all but
 * degenerate, their rounding shows in the seventh digit of the transmittance. */
#define SINGLE(x) (double)(x##f)
static const moit_power_constants constants[3] = {
    {.published_bias = 5e-7,
     .default_bias = {5e-8, 1e-15},
     .covering_bias = {5e-7, 1e-14},
     .safe = {0, SINGLE(.375), 0, SINGLE(.375)}},
    {.published_bias = 5e-6,
     .default_bias = {5e-8, 1e-15},
     .covering_bias = {5e-6, 1e-13},
     .safe = {0, SINGLE(.48), 0, SINGLE(.451), 0, SINGLE(.45)}},
    {.published_bias = 5e-5,
     .default_bias = {1.5e-7, 1e-14},
     .covering_bias = {5e-5, 1e-12},
     .safe = {0, SINGLE(.75), 0, SINGLE(.67666666666666664), 0, SINGLE(.63), 0,
              SINGLE(.60030303030303034)}},
};

const moit_power_constants *moit_power_constants_of(int count) { return &constants[count / 2 - 2]; }

double moit_default_bias(int count, moit_precision precision) {
    return moit_power_constants_of(count)->default_bias[precision];
}

double moit_published_bias(int count) { return moit_power_constants_of(count)->published_bias; }

static void warp_tile(const moit_job *job, moit_tile *tile) {
    if (!job->technique->range_per_pixel) {
        moit_warp_map map = moit_image_warp(job);
        job->stages->warp(tile->fragments, tile->depth, &map, tile->z);
        return;
    }
    for (int p = 0; p < tile->pixels; ++p) {
        size_t start = (size_t)tile->offsets[p] * job->scalar;
        moit_warp_map map = moit_pixel_warp(job, tile, p);
        job->stages->warp(tile->offsets[p + 1] - tile->offsets[p],
                          (const char *)tile->depth + start, &map, (char *)tile->z + start);
    }
}

void moit_power_gather(const moit_job *job, moit_tile *tile) {
    job->stages->absorbance(tile->fragments, tile->alpha, job->max_alpha, tile->absorbance);
    warp_tile(job, tile);
    job->stages->power_sums(job->technique->count, tile->pixels, tile->offsets, tile->absorbance,
                            tile->z, tile->b0, tile->b);
}

static bool is_zero(const double *b, int count) {
    for (int k = 0; k < count; ++k)
        if (b[k] != 0.0) return false;
    return true;
}

/* Images have many empty pixels, and those share one rule: that of zero moments. So the others are
 * moved together first, their rules computed, and moved apart from the last to the first. */
void moit_power_read(const moit_stages *precise, moit_precision precision, int count, double bias,
                     int pixels, const void *b, double *wide_b, double *rules) {
    const moit_power_constants *known = moit_power_constants_of(count);
    /* What rounding of the stored moments may do to a pivot and the bias does not outweigh. */
    double unit = precision == MOIT_FLOAT64 ? 0x1p-50 : 0x1p-23;
    double least = fmax(unit * (1.0 - bias / known->covering_bias[precision]), 1e-15);
    size_t row = (size_t)count, size = MOIT_RULE_SIZE(row);
    int filled = 0;
    for (int p = 0; p < pixels; ++p) {
        double *own = wide_b + (size_t)filled * row;
        for (size_t k = 0; k < row; ++k)
            own[k] = moit_number(precision, b, (int64_t)((size_t)p * row + k));
        filled += !is_zero(own, count);
    }
    precise->power_rules(count, filled, wide_b, bias, known->safe, least, rules);
    if (filled == pixels) return;

    double zero[8] = {0}, of_zero[9];
    precise->power_rules(count, 1, zero, bias, known->safe, least, of_zero);
    for (int p = pixels; p-- > 0;) {
        double own[8];
        for (size_t k = 0; k < row; ++k)
            own[k] = moit_number(precision, b, (int64_t)((size_t)p * row + k));
        const double *rule = is_zero(own, count) ? of_zero : rules + (size_t)--filled * size;
        memmove(rules + (size_t)p * size, rule, size * sizeof *rules);
        memcpy(wide_b + (size_t)p * row, own, row * sizeof *wide_b);
    }
}

void moit_power_read_tile(const moit_job *job, moit_tile *tile) {
    moit_precision precision = job->fragments->precision;
    moit_power_read(job->precise, precision, job->technique->count, job->bias, tile->pixels,
                    tile->b, tile->wide_b, tile->rules);
    for (int p = 0; p < tile->pixels; ++p) tile->wide_b0[p] = moit_number(precision, tile->b0, p);
    job->precise->decay(tile->pixels, tile->wide_b0, tile->total);
}

void moit_power_weigh(const moit_job *job, moit_tile *tile) {
    const moit_technique *technique = job->technique;
    moit_power_gather(job, tile);
    moit_power_read_tile(job, tile);
    job->stages->power_transmittance(technique->count, tile->pixels, tile->offsets, tile->z,
                                     technique->exclude_self ? tile->absorbance : NULL, tile->rules,
                                     tile->b0, technique->overestimation, tile->T);
}

void moit_power_warp_curve(const moit_job *job, moit_tile *tile) {
    /* depths in the fragments' precision, in an array that is free until the curve is drawn */
    for (int64_t k = 0; k < job->depths; ++k)
        moit_set_number(job->fragments->precision, tile->curve, k, job->depth[k]);
    for (int p = 0; p < tile->pixels; ++p) {
        char *z = (char *)tile->curve_z + (size_t)tile->curve_offsets[p] * job->scalar;
        if (p > 0 && !job->technique->range_per_pixel) {
            memcpy(z, tile->curve_z, (size_t)job->depths * job->scalar);
            continue;
        }
        moit_warp_map map =
            job->technique->range_per_pixel ? moit_pixel_warp(job, tile, p) : moit_image_warp(job);
        job->stages->warp((int)job->depths, tile->curve, &map, z);
    }
}

void moit_power_curve(const moit_job *job, moit_tile *tile) {
    moit_power_gather(job, tile);
    moit_power_read_tile(job, tile);
    moit_power_warp_curve(job, tile);
    job->stages->power_transmittance(job->technique->count, tile->pixels, tile->curve_offsets,
                                     tile->curve_z, NULL, tile->rules, tile->b0,
                                     job->technique->overestimation, tile->curve);
}

/* ---- Moments by themselves ------------------------------------------------------------------- */

enum { BLOCK_POINTS = 8192, BLOCK_PIXELS = 256 };

typedef struct {
    const moit_technique *technique;
    const moit_stages *stages, *precise;
    moit_precision precision;
    double bias;
    int64_t pixels, depths;
    int block_pixels;
    const char *b0, *b, *z;
    char *out;
    char *memory;
    size_t part, scalar;
} moments_job;

static size_t rounded_up(size_t bytes) { return (bytes + 63) / 64 * 64; }

/* Copies a block's z to padded scratch and its T from there: the arrays of a caller end where they
 * end. */
static moit_status answer_block(void *context, int64_t item, int thread) {
    const moments_job *job = context;
    int count = job->technique->count;
    int64_t first = item * job->block_pixels;
    int pixels =
        (int)(first + job->block_pixels < job->pixels ? job->block_pixels : job->pixels - first);
    int64_t points = (int64_t)pixels * job->depths, room = (int64_t)job->block_pixels * job->depths;

    char *memory = job->memory + (size_t)thread * job->part;
    char *z = memory, *T = z + rounded_up((size_t)(room + MOIT_PADDING) * job->scalar);
    double *wide_b = (double *)(T + rounded_up((size_t)(room + MOIT_PADDING) * job->scalar));
    double *rules = wide_b + (int64_t)job->block_pixels * 8;
    int32_t *offsets = (int32_t *)(rules + (int64_t)job->block_pixels * 9);

    memcpy(z, job->z + (size_t)(first * job->depths) * job->scalar, (size_t)points * job->scalar);
    for (int p = 0; p <= pixels; ++p) offsets[p] = (int32_t)(p * job->depths);
    moit_power_read(job->precise, job->precision, count, job->bias, pixels,
                    job->b + (size_t)(first * count) * job->scalar, wide_b, rules);
    job->stages->power_transmittance(count, pixels, offsets, z, NULL, rules,
                                     job->b0 + (size_t)first * job->scalar,
                                     job->technique->overestimation, T);
    memcpy(job->out + (size_t)(first * job->depths) * job->scalar, T, (size_t)points * job->scalar);
    return MOIT_OK;
}

moit_status moit_moments_transmittance(const moit_technique *technique, moit_precision precision,
                                       int64_t pixels, int64_t depths, const void *b0,
                                       const void *b, const void *z, void *out,
                                       const moit_run *run) {
    if (pixels == 0 || depths == 0) return MOIT_OK;
    if (depths > INT32_MAX / 4) return MOIT_NO_MEMORY;
    moments_job job = {
        .technique = technique,
        .stages = moit_stages_of(precision, run->isa),
        .precise = moit_stages_of(MOIT_FLOAT64, run->isa),
        .precision = precision,
        .bias = technique->bias,
        .pixels = pixels,
        .depths = depths,
        .b0 = b0,
        .b = b,
        .z = z,
        .out = out,
        .scalar = precision == MOIT_FLOAT64 ? sizeof(double) : sizeof(float),
    };
    int64_t fit = BLOCK_POINTS / depths;
    job.block_pixels = (int)(fit < 1 ? 1 : fit > BLOCK_PIXELS ? BLOCK_PIXELS : fit);
    size_t points = (size_t)job.block_pixels * (size_t)depths + MOIT_PADDING;
    job.part = 2 * rounded_up(points * job.scalar)
               + rounded_up((size_t)job.block_pixels * 17 * sizeof(double)
                            + (size_t)(job.block_pixels + 1) * sizeof(int32_t));
    int64_t blocks = (pixels + job.block_pixels - 1) / job.block_pixels;
    int64_t threads = run->threads < blocks ? run->threads : blocks;
    job.memory = aligned_alloc(64, job.part * (size_t)threads);
    if (!job.memory) return MOIT_NO_MEMORY;
    moit_status status = moit_parallel_for(run, blocks, answer_block, &job);
    free(job.memory);
    return status;
}
