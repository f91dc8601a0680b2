/* Backwards through techniques of power moments. */
#include "core/adjoints/power.h"
#include "core/techniques/table.h"

#include <math.h>
#include <string.h>

/* With less bias than that, rays of no more fragments than the rule has nodes are exact wherever
 * these lie. Steps of the curve and moments that move with them take each other away then, and what
 * is left of both is rounding. */
#define NO_BIAS 1e-12

static const moit_power_adjoints *adjoints_of(moit_isa isa) {
#if defined(__x86_64__) && !defined(MOIT_BASE_ONLY)
    if (isa == MOIT_ISA_AVX2) return &moit_power_adjoints_avx2;
    if (isa == MOIT_ISA_AVX512) return &moit_power_adjoints_avx512;
#endif
    (void)isa;
    return &moit_power_adjoints_base;
}

const char *moit_power_refusal(const moit_technique *technique) {
    const moit_moment_options *how = &technique->moments;
    if (how->bits == 16) return "words of 16 bits are steps; use bits=32";
    if (how->halves) return "half floats are steps; use storage=None";
    if (technique->resolution > 1)
        return "pixels that share a block's state have none yet; use resolution=1";
    if (technique->kind != MOIT_MOMENT_TRANSPARENCY) return NULL;
    if (technique->transparency.storage != MOIT_STORAGE_FLOAT)
        return "words of 16 bits are steps; use storage=\"float32\"";
    return technique->transparency.passes == 2 ? "two passes have none yet; use passes=1" : NULL;
}

/* Derivative of the absorbance by alpha. */
static double absorbance_slope(const moit_job *job, double alpha) {
    double most = job->max_alpha;
    if (moit_technique_rows[job->technique->kind].scales_alpha) return most / (1.0 - most * alpha);
    return alpha > most ? 0.0 : 1.0 / (1.0 - alpha);
}

/* One pixel: by what is absorbed in front of its fragments and by b0 to by_z and alpha. */
static void pull_pixel(const moit_job *job, const moit_tile *tile, int p, double by_b0,
                       const moit_adjoint *by, double *by_z, double *by_a) {
    const moit_technique *technique = job->technique;
    int first = tile->offsets[p], n = tile->offsets[p + 1] - first, count = technique->count;
    const double *a = (const double *)tile->absorbance + first;
    const double *z = (const double *)tile->z + first, *alpha = (const double *)tile->alpha + first;
    double b0 = ((const double *)tile->b0)[p], mean = 0.0, S[MOIT_MOST_TERMS];
    const moit_power_adjoints *adjoints = adjoints_of(job->run->isa);
    memset(by_a, 0, (size_t)n * sizeof *by_a);
    memset(by_z, 0, (size_t)n * sizeof *by_z);
    if (b0 > 0.0) {
        const double *rule = tile->rules + p * MOIT_RULE_SIZE(count);
        double *value = by->T + first, *slope = by->work[0] + first;
        by_b0 +=
            adjoints->sum_pulled(count, n, rule, b0, z, technique->moments.exclude_self ? a : NULL,
                                 technique->moments.overestimation, by->T + first, S, by_z, by_a);
        adjoints->read_polynomial(count, n, rule, S, z, value, slope);
        for (int i = 0; i < n; ++i) mean += a[i] / b0 * value[i];
        double keeps = 1.0 - job->bias;
        bool determined = n <= count / 2 && job->bias < NO_BIAS;
        for (int i = 0; i < n; ++i) {
            by_a[i] += keeps * (value[i] - mean) / b0;
            by_z[i] += keeps * (a[i] / b0) * slope[i];
            if (determined) by_z[i] = 0.0;
        }
    }
    for (int i = 0; i < n; ++i)
        by->alpha[first + i] += (by_a[i] + by_b0) * absorbance_slope(job, alpha[i]);
}

/* What pixels let through is the sum's exponential, but of Moment Transparency, which multiplies.
 */
void moit_power_pull_back(const moit_job *job, moit_tile *tile, const moit_adjoint *by) {
    bool multiplies = moit_technique_rows[job->technique->kind].total;
    double *by_z = by->work[1], *by_a = by->work[2];
    for (int p = 0; p < tile->pixels; ++p) {
        int first = tile->offsets[p];
        double by_b0 = multiplies ? 0.0 : -tile->total[p] * by->total[p];
        pull_pixel(job, tile, p, by_b0, by, by_z + first, by_a + first);
    }
    if (multiplies) moit_adjoint_of_totals(tile, by, by->total);
    moit_adjoint_of_warp(job, tile, by_z, by);
}
