/* Backwards through techniques of moments. */
#include "core/adjoints/moments.h"

#include "core/adjoints/blocks.h"
#include "core/elementary.h"
#include "core/techniques/moment_transparency.h"
#include "core/techniques/moments.h"
#include "core/techniques/table.h"

#include <math.h>
#include <string.h>

typedef moit_moment_state state;

/* Whether rules are those of fragments as doubles have them, not of their moments. */
static bool has_exact_rules(const moit_job *job) {
    return job->technique->kind == MOIT_POWER_MOMENTS && job->given == MOIT_FLOAT64
           && job->bias < MOIT_LITTLE_BIAS && !job->blocks && !moit_any_state(job).holds;
}

/* A tile as rays of lanes read it, what was found kept in `by`. */
static moit_ray_state rays_of(const moit_job *job, const moit_tile *tile, const moit_adjoint *by) {
    const moit_technique *technique = job->technique;
    return (moit_ray_state){.count = technique->count,
                            .pixels = tile->pixels,
                            .offsets = tile->offsets,
                            .z = tile->z,
                            .own = technique->moments.exclude_self ? tile->absorbance : NULL,
                            .rules = tile->rules,
                            .b0 = tile->b0,
                            .low = has_exact_rules(job) ? by->low : NULL,
                            .beta = technique->moments.overestimation,
                            .kept = by->kept,
                            .apart = by->apart};
}

/* All pixels at once, by what `moit_moments_weigh_again` has left, with b0's derivatives in
 * by->total; false: one by one. */
static bool pull_together(const moit_job *job, const moit_tile *tile, const moit_adjoint *by) {
    const moit_moment_adjoints *adjoints = moit_moment_adjoints_of(job->technique, job->run->isa);
    if (!by->kept || job->depths || moit_any_state(job).holds) return false;
    moit_ray_state rays = rays_of(job, tile, by);
    moit_ray_pull pull = {.by = by->T,
                          .a = tile->absorbance,
                          .by_b0 = by->total,
                          .keeps = 1.0 - job->bias,
                          .leaves_depths = job->bias < MOIT_NO_BIAS,
                          .by_a = by->work[2],
                          .by_z = by->work[1]};
    return adjoints->rays.pull(&rays, &pull);
}

static void pull_one_pass(const moit_job *job, const moit_tile *tile, const moit_adjoint *by,
                          bool multiplies) {
    state s = moit_any_state(job);
    const double *b0 = tile->b0;
    if (job->technique->kind == MOIT_MOMENT_TRANSPARENCY) b0 = moit_mt_kept_of(job, tile, 0).b0;
    for (int p = 0; p < tile->pixels; ++p) {
        int first = tile->offsets[p];
        moit_move_state(tile, p, &s);
        s.b0 = b0[p];
        moit_readings at = moit_readings_of(job, tile, by, p, job->technique->moments.exclude_self);
        if (by->kept && !job->depths) at.kept = by->kept + first, at.apart = by->apart;
        double by_b0 = multiplies ? 0.0 : by->total[p];
        moit_pull_state(&s, by_b0, &at, tile->points[0] + first, tile->points[1] + first,
                        by->work[1] + first, by->work[2] + first);
    }
}

/* From T = 1 - (1 - T2) ratio to what the second pass absorbs, in place; by_b0: by the totals of
 * both. */
static void pull_ratio(int n, const double *T, double *by, double b0, double second_b0,
                       double by_b0[2]) {
    double covers = -moit_expm1(-second_b0), by_ratio = 0.0;
    double under = fmax(covers, 1e-4), ratio = -moit_expm1(-b0) / under;
    for (int i = 0; i < n; ++i) {
        bool seen = ratio > 0.0 && 1.0 - T[i] < ratio;
        by_ratio -= seen ? by[i] * (1.0 - T[i]) / ratio : 0.0;
        by[i] = seen ? -by[i] * (ratio - (1.0 - T[i])) : 0.0;
    }
    by_b0[0] = by_ratio * moit_exp(-b0) / under;
    by_b0[1] = covers >= under ? -by_ratio * ratio * moit_exp(-second_b0) / under : 0.0;
}

/* The second pass is of what the first lets through, a T; `weigh` has left a, T and their product
 * in points[2] and bounds, and what the second pass reads. */
static void pull_two_passes(const moit_job *job, const moit_tile *tile, const moit_adjoint *by) {
    state second = moit_any_state(job), once = second;
    bool excludes = job->technique->moments.exclude_self;
    double *T = tile->bounds[0], *value = tile->points[0], *slope = tile->points[1];
    double *by_seen = by->work[0], *by_z = by->work[1], *by_a = by->work[2], by_b0[2];
    const double *a = tile->points[2], *seen = tile->bounds[1];
    const double *answer = job->depths ? tile->curve : tile->T;
    moit_mt_kept first_pass = moit_mt_kept_of(job, tile, 0);
    const double *first_b0 = first_pass.b0, *second_b0 = moit_mt_kept_of(job, tile, 1).b0;
    memset(by_seen, 0, (size_t)tile->fragments * sizeof *by_seen);
    for (int p = 0; p < tile->pixels; ++p) {
        int first = tile->offsets[p], place = job->depths ? tile->curve_offsets[p] : first;
        moit_readings at = moit_readings_of(job, tile, by, p, excludes);
        moit_move_state(tile, p, &second);
        second.b0 = second_b0[p];
        second.a = seen + first;
        if (at.own) at.own = seen + first;
        at.by_own = by_seen + first;
        pull_ratio(at.n, answer + place, by->T + place, first_b0[p], second.b0, by_b0);
        moit_pull_state(&second, by_b0[1], &at, value + first, slope + first, by_z + first,
                        by_seen + first);
        tile->sums[p] = by_b0[0];
    }
    moit_mt_reader reader = {job->stages, job->precise, job->fragments->precision, job->technique,
                             job->bias};
    moit_mt_read(&reader, tile->pixels, first_pass.b, tile->double_b, tile->rules);
    for (int i = 0; i < tile->fragments; ++i) {
        by_a[i] += T[i] * by_seen[i];
        T[i] *= -a[i] * by_seen[i]; /* by what the first pass absorbs */
    }
    for (int p = 0; p < tile->pixels; ++p) {
        int first = tile->offsets[p];
        moit_move_state(tile, p, &once);
        once.b0 = first_b0[p];
        once.a = a + first;
        moit_readings at = {.n = once.n,
                            .z = once.z,
                            .own = excludes ? once.a : NULL,
                            .by = T + first,
                            .by_z = by_z + first,
                            .by_own = by_a + first};
        moit_pull_state(&once, tile->sums[p], &at, value + first, slope + first, by_z + first,
                        by_a + first);
    }
}

/* Whether all pixels that absorb have rules by their fragments. */
static bool read_exactly(const moit_job *job, moit_tile *tile, const moit_adjoint *by) {
    moit_moment_steps steps = moit_technique_moments(job->technique, MOIT_FLOAT64);
    moit_exact_rays rays = {.pixels = tile->pixels,
                            .offsets = tile->offsets,
                            .a = tile->absorbance,
                            .z = tile->z,
                            .b0 = tile->b0,
                            .bias = job->bias,
                            .safe = steps.safe,
                            .rules = tile->rules,
                            .low = by->low};
    bool all = moit_moment_adjoints_of(job->technique, job->run->isa)
                   ->exact_rules(job->technique->count, &rays);
    memcpy(tile->double_b0, tile->b0, (size_t)tile->pixels * sizeof *tile->double_b0);
    job->precise->decay(tile->pixels, tile->double_b0, tile->total);
    return all;
}

void moit_moments_weigh_again(const moit_job *job, moit_tile *tile, const moit_adjoint *by) {
    const moit_moment_adjoints *adjoints = moit_moment_adjoints_of(job->technique, job->run->isa);
    moit_moments_gather(job, tile);
    bool exact = has_exact_rules(job);
    if (!exact || !read_exactly(job, tile, by)) {
        moit_moments_read_tile(job, tile);
        if (exact) read_exactly(job, tile, by); /* those that have some */
    }
    moit_ray_state rays = rays_of(job, tile, by);
    adjoints->rays.absorbance(&rays, tile->T);
    if (!tile->absorbed) job->stages->decay(tile->fragments, tile->T, tile->T);
}

/* What pixels let through is the sum's exponential, but of Moment Transparency, which multiplies.
 */
void moit_moments_pull_back(const moit_job *job, moit_tile *tile, const moit_adjoint *by) {
    bool multiplies = moit_technique_rows[job->technique->kind]->total
                      || (job->blocks && !job->technique->full_total);
    moit_adjoint_begin(job, tile, by);
    for (int p = 0; !multiplies && !job->blocks && p < tile->pixels; ++p)
        by->total[p] *= -tile->total[p]; /* by b0 from here on */
    if (job->blocks) moit_moments_pull_blocks(job, tile, by, NULL);
    else if (multiplies && job->technique->transparency.passes == 2) pull_two_passes(job, tile, by);
    else if (multiplies || !pull_together(job, tile, by)) pull_one_pass(job, tile, by, multiplies);
    moit_adjoint_of_absorbance(job, tile, by);
    if (multiplies) moit_adjoint_of_totals(tile, by, by->total);
    moit_adjoint_of_warp(job, tile, by);
}
