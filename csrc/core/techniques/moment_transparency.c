/* Moment Transparency (Sharpe 2018): power moments of scaled alpha, read from what words of 16 bits
 * keep, or gathered a second time from what the first let through, or both for blocks of pixels
 * (blocks.h). */
#include "core/techniques/moment_transparency.h"

#include "core/techniques/options.h"
#include "core/techniques/table.h"

#include <assert.h>
#include <string.h>

/* ---- Tiles ----------------------------------------------------------------------------------- */

/* What a tile has beside tile->b0 and b, in tile->own. */
typedef struct {
    char *second_b0, *second_b;   /* of the second pass */
    char *held_b0[2], *held_b[2]; /* what the storage keeps of either pass */
    char *absorbance;             /* of the second pass; padded */
} own;

static own own_of(const moit_job *job, char *memory, int fragments, int pixels, size_t *bytes) {
    size_t per_pixel = (size_t)pixels * job->scalar, used = 0;
    char *parts[6];
    for (int i = 0; i < 6; ++i) {
        parts[i] = memory ? memory + used : NULL;
        used += (i % 2 ? 4 : 1) * per_pixel;
    }
    own o = {.second_b0 = parts[0],
             .second_b = parts[1],
             .held_b0 = {parts[2], parts[4]},
             .held_b = {parts[3], parts[5]},
             .absorbance = memory ? memory + used : NULL};
    *bytes = used + (size_t)fragments * job->scalar;
    return o;
}

static size_t mt_scratch(const moit_job *job, int fragments, int pixels) {
    size_t bytes;
    own_of(job, NULL, fragments, pixels, &bytes);
    return bytes;
}

static own room_of(const moit_job *job, const moit_tile *tile) {
    size_t bytes;
    return own_of(job, tile->own, 0, tile->pixels, &bytes);
}

static moit_mt_reader reader_of(const moit_job *job) {
    return (moit_mt_reader){job->stages, job->precise, job->fragments->precision, job->technique,
                            job->bias};
}

/* b0 and b of one pass as the storage keeps them, with their rules in tile->rules; returns b0. */
static const void *read_pass(const moit_job *job, moit_tile *tile, int pass) {
    moit_mt_reader reader = reader_of(job);
    own o = room_of(job, tile);
    const char *b0 = pass ? o.second_b0 : tile->b0, *b = pass ? o.second_b : tile->b;
    size_t bytes = (size_t)tile->pixels * job->scalar;
    if (job->technique->transparency.storage != MOIT_STORAGE_FLOAT && !job->blocks) {
        memcpy(o.held_b0[pass], b0, bytes);
        memcpy(o.held_b[pass], b, 4 * bytes);
        moit_mt_hold(&reader, tile->pixels, o.held_b0[pass], o.held_b[pass]);
        b0 = o.held_b0[pass];
        b = o.held_b[pass];
    }
    moit_mt_read(&reader, tile->pixels, b, tile->double_b, tile->rules);
    return b0;
}

moit_mt_kept moit_mt_kept_of(const moit_job *job, const moit_tile *tile, int pass) {
    own o = room_of(job, tile);
    if (job->technique->transparency.storage != MOIT_STORAGE_FLOAT && !job->blocks)
        return (moit_mt_kept){o.held_b0[pass], o.held_b[pass]};
    return pass ? (moit_mt_kept){o.second_b0, o.second_b} : (moit_mt_kept){tile->b0, tile->b};
}

static void sum_in_double(const moit_job *job, const moit_tile *tile, const double *a,
                          const double *z) {
    const moit_stages *stages = job->precise;
    if (job->fragments->precision == MOIT_FLOAT64)
        stages->moments[MOIT_POWER].sums(4, NULL, tile->pixels, tile->offsets, a, z,
                                         tile->double_b0, tile->double_b);
    else
        stages->plain_power_sums(tile->pixels, tile->offsets, a, z, tile->double_b0,
                                 tile->double_b);
}

static void round_to_storage(moit_precision precision, int pixels, const double *double_b0,
                             const double *double_b, void *b0, void *b) {
    for (int p = 0; p < pixels; ++p) moit_set_number(precision, b0, p, double_b0[p]);
    for (int k = 0; k < 4 * pixels; ++k) moit_set_number(precision, b, k, double_b[k]);
}

/* Both passes of a pixel's own moments, in double: what float32 rounds off a transmittance of the
 * first changes the second moments' last digit, and where these are all but degenerate that is
 * thousandths of what is read from them. What is stored is rounded all the same, but the first
 * total, where it is a number of the fragments' precision, is used before. */
static void gather_twice(const moit_job *job, moit_tile *tile) {
    const moit_technique *technique = job->technique;
    const moit_stages *stages = job->precise;
    const moit_moment_stages *power = &stages->moments[MOIT_POWER];
    moit_precision precision = job->fragments->precision;
    own o = room_of(job, tile);
    int n = tile->fragments, pixels = tile->pixels;
    double *alpha = tile->points[0], *z = tile->points[1], *a = tile->points[2],
           *T = tile->bounds[0], *seen = tile->bounds[1];
    moit_warp_tile(job, tile);
    for (int i = 0; i < n; ++i) {
        alpha[i] = moit_number(precision, tile->alpha, i);
        z[i] = moit_number(precision, tile->z, i);
    }
    stages->scaled_absorbance(n, alpha, job->max_alpha, a);
    sum_in_double(job, tile, a, z);
    round_to_storage(precision, pixels, tile->double_b0, tile->double_b, tile->b0, tile->b);
    const void *held_b0 = read_pass(job, tile, 0);
    if (technique->transparency.storage != MOIT_STORAGE_FLOAT)
        for (int p = 0; p < pixels; ++p) tile->double_b0[p] = moit_number(precision, held_b0, p);
    power->transmittance(4, NULL, pixels, tile->offsets, z,
                         technique->moments.exclude_self ? a : NULL, tile->rules, tile->double_b0,
                         technique->moments.overestimation, false, T);
    stages->occluded(n, a, T, seen);
    sum_in_double(job, tile, seen, z);
    round_to_storage(precision, pixels, tile->double_b0, tile->double_b, o.second_b0, o.second_b);
    for (int i = 0; technique->moments.exclude_self && i < n; ++i)
        moit_set_number(precision, o.absorbance, i, seen[i]);
}

/* Fills what the first pass stores, and the second where there is one. */
static void gather(const moit_job *job, moit_tile *tile) {
    const moit_technique *technique = job->technique;
    if (job->blocks) {
        moit_warp_tile(job, tile);
        moit_blocks_read(job, tile, 0);
        if (technique->transparency.passes == 2) moit_blocks_read(job, tile, 1);
        return;
    }
    if (technique->transparency.passes == 2) gather_twice(job, tile);
    else moit_moments_gather(job, tile);
}

/* The transmittance in front of z, whose fragments have the absorbances `own`, or NULL. */
static void reconstruct(const moit_job *job, moit_tile *tile, const int32_t *offsets, const void *z,
                        bool fragments, void *T) {
    const moit_technique *technique = job->technique;
    own o = room_of(job, tile);
    bool twice = technique->transparency.passes == 2;
    const void *absorbance = !fragments || !technique->moments.exclude_self ? NULL
                             : twice                                        ? o.absorbance
                                                                            : tile->absorbance;
    bool absorbed = tile->absorbed && !twice;
    const void *b0 = read_pass(job, tile, twice);
    job->stages->moments[MOIT_POWER].transmittance(4, NULL, tile->pixels, offsets, z, absorbance,
                                                   tile->rules, b0,
                                                   technique->moments.overestimation, absorbed, T);
    if (job->blocks && !twice && !absorbed) job->stages->dimmest(offsets[tile->pixels], T);
    if (!twice) return;
    bool held = technique->transparency.storage != MOIT_STORAGE_FLOAT && !job->blocks;
    job->stages->second_pass(tile->pixels, offsets, held ? o.held_b0[0] : tile->b0, b0, T);
}

static bool mt_fits(const moit_technique *technique) {
    bool interpolates = technique->resolution > 1;
    bool of_the_pixel = technique->transparency.storage == MOIT_STORAGE_NONLINEAR
                        || technique->moments.exclude_self || technique->full_total;
    return (technique->transparency.passes == 1 || technique->transparency.passes == 2)
           && !(interpolates && of_the_pixel);
}

static void mt_weigh(const moit_job *job, moit_tile *tile) {
    gather(job, tile);
    reconstruct(job, tile, tile->offsets, tile->z, true, tile->T);
    moit_total_product(job, tile);
}

static void mt_curve(const moit_job *job, moit_tile *tile) {
    gather(job, tile);
    moit_moments_warp_curve(job, tile);
    reconstruct(job, tile, tile->curve_offsets, tile->curve_z, false, tile->curve);
    moit_total_product(job, tile);
}

/* What two passes reconstruct is not asked for by its absorbance. */
static bool mt_absorbs(const moit_technique *technique) {
    return technique->transparency.passes != 2;
}

/* Totals are gathered as they are, and stored in half floats. Sums that are rounded to these at
 * every fragment, as other techniques have them, stop growing before. */
static bool mt_overflows(const moit_job *job, const moit_tile *tile, int p) {
    return job->technique->transparency.storage != MOIT_STORAGE_FLOAT && !job->blocks
           && moit_number(job->fragments->precision, tile->b0, p) >= MOIT_MOST_HALF;
}

/* ---- Blocks of pixels ------------------------------------------------------------------------ */

/* The second pass weighs fragments by what their block's first lets through. */
static void gather_for_block(const moit_job *job, moit_tile *tile, int pass) {
    const moit_moment_stages *power = &job->stages->moments[MOIT_POWER];
    moit_mt_reader reader = reader_of(job);
    own o = room_of(job, tile);
    if (pass == 0) {
        moit_moments_gather(job, tile);
        return;
    }
    job->stages->scaled_absorbance(tile->fragments, tile->alpha, job->max_alpha, tile->absorbance);
    moit_warp_tile(job, tile);
    moit_own_block_read(job, tile, 0);
    moit_mt_read(&reader, tile->pixels, tile->b, tile->double_b, tile->rules);
    power->transmittance(4, NULL, tile->pixels, tile->offsets, tile->z, NULL, tile->rules, tile->b0,
                         job->technique->moments.overestimation, false, tile->T);
    job->stages->occluded(tile->fragments, tile->absorbance, tile->T, tile->absorbance);
    power->sums(4, NULL, tile->pixels, tile->offsets, tile->absorbance, tile->z, o.second_b0,
                o.second_b);
}

static moit_state state_of(const moit_job *job, const moit_tile *tile, int pass) {
    own o = room_of(job, tile);
    return pass ? (moit_state){o.second_b0, o.second_b} : (moit_state){tile->b0, tile->b};
}

static int numbers_of(const moit_technique *technique) {
    (void)technique;
    return 4;
}

static int passes_of(const moit_technique *technique) { return technique->transparency.passes; }

static void hold(const moit_job *job, int blocks, const moit_state *state) {
    moit_mt_reader reader = reader_of(job);
    moit_mt_hold(&reader, blocks, state->weight, state->numbers);
}

static bool is_of_middle(const moit_technique *technique) {
    return !technique->transparency.average;
}

const moit_block_family moit_mt_blocks = {.gather = gather_for_block,
                                          .state = state_of,
                                          .numbers = numbers_of,
                                          .hold = hold,
                                          .sets = passes_of,
                                          .of_farthest_surface = true,
                                          .of_middle = is_of_middle};

/* ---- Moments by themselves ------------------------------------------------------------------- */

/* Second moments follow the first in tile->b: b, then their b0 and b. */
void moit_mt_state(const moit_job *job, moit_tile *tile) {
    gather(job, tile);
    if (job->technique->transparency.passes < 2) return;
    own o = room_of(job, tile);
    size_t s = job->scalar;
    char *b = tile->b;
    for (size_t p = (size_t)tile->pixels; p-- > 0;) {
        memmove(b + 9 * p * s, b + 4 * p * s, 4 * s);
        memcpy(b + (9 * p + 4) * s, o.second_b0 + p * s, s);
        memcpy(b + (9 * p + 5) * s, o.second_b + 4 * p * s, 4 * s);
    }
}

/* Blocks' moments come as the storage keeps them. */
void moit_mt_transmittance(const moit_stages *stages, const moit_stages *precise,
                           moit_precision precision, const moit_technique *technique, double bias,
                           int pixels, const int32_t *offsets, const void *b0_, const void *b_,
                           const void *z, double *double_b, double *rules, void *T) {
    enum { MOST = MOIT_MOST_RAYS_ASKED };
    assert(pixels <= MOST);
    moit_mt_reader reader = {stages, precise, precision, technique, bias};
    bool twice = technique->transparency.passes == 2, held = technique->resolution > 1;
    size_t s = moit_scalar_size(precision);
    double b0[2][MOST], b[2][4 * MOST]; /* room for numbers of either precision */
    for (int pass = 0; pass <= (int)twice; ++pass) {
        size_t row = twice ? 9 : 4;
        for (size_t p = 0; p < (size_t)pixels; ++p) {
            const char *from = (const char *)b_ + row * p * s;
            memcpy((char *)b0[pass] + p * s, pass ? from + 4 * s : (const char *)b0_ + p * s, s);
            memcpy((char *)b[pass] + 4 * p * s, pass ? from + 5 * s : from, 4 * s);
        }
        if (!held) moit_mt_hold(&reader, pixels, b0[pass], b[pass]);
    }
    moit_mt_read(&reader, pixels, b[twice], double_b, rules);
    stages->moments[MOIT_POWER].transmittance(4, NULL, pixels, offsets, z, NULL, rules, b0[twice],
                                              technique->moments.overestimation, false, T);
    if (twice) stages->second_pass(pixels, offsets, b0[0], b0[1], T);
}

const moit_technique_row moit_moment_transparency_row = {
    .name = "moment-transparency",
    OPTIONS(COUNT, WARPED, RESOLUTION(INT_MAX), READ_MOMENTS,
            WHOLE("passes", transparency.passes, 1, 2),
            WHOLE("storage", transparency.storage, 0, MOIT_STORAGE_UNORM16),
            TRUTH("average", transparency.average), TRUTH("symmetric", transparency.symmetric)),
    .thick = MOIT_THICK_MIDDLE,
    .usual_counts = (const int[]){4, 0},
    .least_count = 4,
    .most_count = 4,
    .fits = mt_fits,
    .weigh = mt_weigh,
    .pull_back = moit_moments_pull_back,
    .refusal = moit_mt_refusal,
    .overflows = mt_overflows,
    .total = moit_total_product,
    .curve = mt_curve,
    .bounds = moit_power_bounds,
    .blocks = &moit_mt_blocks,
    .scratch = mt_scratch,
    .moments = &moit_mt_moments,
    .unit_range = {0.0, 1.0},
    .uses_warp = true,
    .scales_alpha = true,
    .reconstructs = true,
    .absorbs = mt_absorbs,
    .takes_points = true,
    .geometry_passes = 2};
