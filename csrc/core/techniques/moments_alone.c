/* Moments by themselves: pass 2 for arrays of a caller. */
#include "core/system.h"
#include "core/techniques/moments.h"
#include "core/techniques/table.h"
#include "core/threads.h"

#include <string.h>

enum { BLOCK_POINTS = 8192, BLOCK_PIXELS = 1024 };

typedef struct {
    const moit_technique *technique;
    const moit_stages *stages, *precise;
    moit_precision precision;
    double bias;
    int64_t pixels, depths;
    int block_pixels;
    bool absorbed; /* -ln T is asked for */
    const char *b0, *b, *z;
    char *out;
    char *memory;
    size_t part, scalar;
    moit_wrapping_zone zone;
} moments_job;

/* Copies a block's z to padded scratch and its T from there: the arrays of a caller end where they
 * end. */
static moit_status answer_block(void *context, int64_t item, int thread) {
    const moments_job *job = context;
    const moit_moment_family *family = moit_family_of(job->technique);
    int count = job->technique->count, numbers = moit_moment_numbers(job->technique);
    int64_t first = item * job->block_pixels;
    int pixels =
        (int)(first + job->block_pixels < job->pixels ? job->block_pixels : job->pixels - first);
    int64_t points = (int64_t)pixels * job->depths, room = (int64_t)job->block_pixels * job->depths;

    char *memory = job->memory + (size_t)thread * job->part;
    char *z = memory, *T = z + moit_aligned_size((size_t)(room + MOIT_PADDING) * job->scalar);
    double *double_b =
        (double *)(T + moit_aligned_size((size_t)(room + MOIT_PADDING) * job->scalar));
    double *rules = double_b + (int64_t)job->block_pixels * MOIT_MOST_NUMBERS;
    int32_t *offsets =
        (int32_t *)(rules + (int64_t)(job->block_pixels + MOIT_PADDING) * MOIT_MOST_RULE);

    memcpy(z, job->z + (size_t)(first * job->depths) * job->scalar, (size_t)points * job->scalar);
    for (int p = 0; p <= pixels; ++p) offsets[p] = (int32_t)(p * job->depths);
    const void *b0 = job->b0 + (size_t)first * job->scalar,
               *b = job->b + (size_t)(first * numbers) * job->scalar;
    moit_rays_asked asked = {pixels, job->depths == 1 ? NULL : offsets, b0, b, z, NULL};
    if (family->transmittance) {
        family->transmittance(job->stages, job->precise, job->precision, job->technique, job->bias,
                              pixels, offsets, b0, b, z, double_b, rules, T);
    } else if (!moit_moments_by_rows(job->stages, job->precise, job->precision, job->technique,
                                     job->bias, job->absorbed, &asked, (float *)rules, T)) {
        moit_moments_read(job->precise, job->precision, job->technique, &job->zone, job->bias,
                          pixels, b, double_b, rules);
        job->stages->moments[family->stages].transmittance(
            count, &job->zone, pixels, offsets, z, NULL, rules, b0,
            job->technique->moments.overestimation, job->absorbed, T);
    }
    memcpy(job->out + (size_t)(first * job->depths) * job->scalar, T, (size_t)points * job->scalar);
    return MOIT_OK;
}

static moit_status answer(const moit_technique *technique, moit_precision precision, int64_t pixels,
                          int64_t depths, const void *b0, const void *b, const void *z,
                          bool absorbed, void *out, const moit_run *run) {
    if (pixels == 0 || depths == 0) return MOIT_OK;
    if (depths > INT32_MAX / 4) return MOIT_NO_MEMORY;
    moments_job job = {
        .technique = technique,
        .stages = moit_stages_of(precision, run->isa),
        .precise = moit_stages_of(MOIT_FLOAT64, run->isa),
        .precision = precision,
        .bias = technique->moments.bias,
        .zone = moit_wrapping_zone_of(technique),
        .pixels = pixels,
        .depths = depths,
        .b0 = b0,
        .b = b,
        .z = z,
        .out = out,
        .absorbed = absorbed,
        .scalar = precision == MOIT_FLOAT64 ? sizeof(double) : sizeof(float),
    };
    int64_t fit = BLOCK_POINTS / depths,
            most = moit_family_of(technique)->transmittance ? MOIT_MOST_RAYS_ASKED : BLOCK_PIXELS;
    if (pixels < most) most = pixels;
    job.block_pixels = (int)(fit < 1 ? 1 : fit > most ? most : fit);
    size_t points = (size_t)job.block_pixels * (size_t)depths + MOIT_PADDING;
    job.part = 2 * moit_aligned_size(points * job.scalar)
               + moit_aligned_size((size_t)(job.block_pixels + MOIT_PADDING)
                                       * (MOIT_MOST_NUMBERS + MOIT_MOST_RULE) * sizeof(double)
                                   + (size_t)(job.block_pixels + 1) * sizeof(int32_t));
    int64_t blocks = (pixels + job.block_pixels - 1) / job.block_pixels;
    int64_t threads = run->threads < blocks ? run->threads : blocks;
    job.memory = moit_aligned_memory(job.part * (size_t)threads);
    if (!job.memory) return MOIT_NO_MEMORY;
    moit_status status = moit_parallel_for(run, blocks, answer_block, &job);
    moit_free_aligned(job.memory);
    return status;
}

moit_status moit_moments_transmittance(const moit_technique *technique, moit_precision precision,
                                       int64_t pixels, int64_t depths, const void *b0,
                                       const void *b, const void *z, void *out,
                                       const moit_run *run) {
    return answer(technique, precision, pixels, depths, b0, b, z, false, out, run);
}

moit_status moit_moments_absorbance(const moit_technique *technique, moit_precision precision,
                                    int64_t pixels, int64_t depths, const void *b0, const void *b,
                                    const void *z, void *out, const moit_run *run) {
    return answer(technique, precision, pixels, depths, b0, b, z, true, out, run);
}
