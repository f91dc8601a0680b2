/* Pixels' states of moments, backwards: what was read of them to the fragments that they are of. */
#include "core/adjoints/moments.h"

#include "core/techniques/moments.h"
#include "core/techniques/table.h"

#include <math.h>
#include <string.h>

const moit_moment_adjoints *moit_moment_adjoints_of(const moit_technique *technique, moit_isa isa) {
    if (!moit_isa_supported(isa)) isa = MOIT_ISA_BASE;
    int family = moit_family_of(technique)->stages;
#if defined(__x86_64__) && !defined(MOIT_NO_AVX2)
    if (isa == MOIT_ISA_AVX2) return &moit_moment_adjoints_avx2[family];
#endif
#if defined(__x86_64__) && !defined(MOIT_NO_AVX512)
    if (isa == MOIT_ISA_AVX512) return &moit_moment_adjoints_avx512[family];
#endif
    return &moit_moment_adjoints_base[family];
}

const char *moit_mt_refusal(const moit_technique *technique) {
    if (technique->resolution < 2) return NULL;
    if (!technique->transparency.average)
        return "a block has the moments of the pixel at its middle, and those of the others move "
               "nothing; use resolution=1";
    return "blocks have moments of fragments that their pixels do not see; use resolution=1";
}

typedef moit_moment_state state;

static void add_shape(const moit_shape *shape, int n, const double *z, double *value,
                      double *slope) {
    for (int i = 0; i < n; ++i) {
        double x = z[i] - shape->middle, sum = 0.0, rise = 0.0;
        for (int k = 6; k > 0; --k) {
            rise = rise * x + k * shape->factor[k];
            sum = (sum + shape->factor[k]) * x;
        }
        value[i] += sum;
        slope[i] += rise;
    }
}

/* Whether moments say all of a pixel's fragments, wherever these lie: what is read there does not
 * hang on depth then, and what is computed of that is rounding. */
static bool is_determined(const moit_moment_state *s) {
    return s->surfaces <= s->nodes && s->bias < MOIT_NO_BIAS;
}

void moit_add_shape(const moit_shape *shape, double around, double *coefficients) {
    double beyond = around - shape->middle;
    for (int k = 1; k < 7; ++k) {
        double part = shape->factor[k]; /* times the binomial coefficient and powers of `beyond` */
        for (int j = k; part != 0.0 && j >= 0; --j) {
            coefficients[j] += part;
            part *= beyond * j / (k - j + 1);
        }
    }
}

/* By the share of the safe distribution that is mixed in. */
static double bias_pulled(const state *s, const double *S, const moit_shape *shape) {
    double by_b[1 + MOIT_MOST_NUMBERS] = {0.0}, sum = 0.0;
    int numbers = 2 * s->nodes;
    moit_moments_of_terms(s->adjoints, s->family, &s->zone, s->nodes, s->rule, S, by_b + 1);
    if (shape) moit_add_shape(shape, 0.0, by_b);
    for (int k = 0; k < numbers; ++k) sum += by_b[1 + k] * (s->safe[k] - s->biased[k]);
    return s->bias < 1.0 ? sum / (1.0 - s->bias) : 0.0; /* of nothing else nothing is known */
}

void moit_leave_depths(const moit_moment_state *s, const moit_readings *at) {
    for (int i = 0; is_determined(s) && i < at->n; ++i) at->by_z[i] = 0.0;
}

void moit_give_state(const moit_moment_state *s, const double *S, const moit_shape *shape,
                     double by_b0, double *value, double *slope, double *by_z, double *by_a) {
    double mass = s->holds ? 0.0 : s->b0;
    for (int i = 0; s->holds && i < s->n; ++i) mass += s->a[i];
    moit_spread from = {.a = s->a, .b0 = mass, .by_b0 = by_b0, .keeps = 1.0 - s->bias};
    s->adjoints->read_polynomial(s->count, &s->zone, s->n, s->rule, S, s->z, value, slope);
    if (is_determined(s)) memset(slope, 0, (size_t)s->n * sizeof *slope);
    if (shape) add_shape(shape, s->n, s->z, value, slope);
    s->adjoints->spread(s->n, &from, value, slope, by_z, by_a);
    if (s->by_bias) *s->by_bias = bias_pulled(s, S, shape);
}

/* By what was read of a state, and by b0. */
void moit_pull_state(const state *s, double by_b0, const moit_readings *at, double *value,
                     double *slope, double *by_z, double *by_a) {
    double S[MOIT_MOST_TERMS];
    if (s->b0 > 0.0) {
        by_b0 += s->adjoints->sum_pulled(s->count, &s->zone, at, s->rule, s->b0, s->beta, S);
        moit_leave_depths(s, at);
        moit_give_state(s, S, NULL, by_b0, value, slope, by_z, by_a);
        return;
    }
    for (int i = 0; i < s->n; ++i) by_a[i] += by_b0;
}

static bool holds_fewer_bits(const moit_technique *technique) {
    return moit_stores_words(technique) || moit_stores_halves(technique)
           || (technique->kind == MOIT_MOMENT_TRANSPARENCY
               && technique->transparency.storage != MOIT_STORAGE_FLOAT);
}

state moit_any_state(const moit_job *job) {
    const moit_moment_family *family = moit_family_of(job->technique);
    return (state){.adjoints = moit_moment_adjoints_of(job->technique, job->run->isa),
                   .zone = job->zone,
                   .count = job->technique->count,
                   .nodes = family->numbers(job->technique->count) / 2,
                   .family = family->stages,
                   .rule_size = family->rule_size(job->technique->count),
                   .bias = job->bias,
                   .holds = holds_fewer_bits(job->technique),
                   .beta = job->technique->moments.overestimation};
}

void moit_move_state(const moit_tile *tile, int p, state *s) {
    int first = tile->offsets[p];
    s->n = s->surfaces = tile->offsets[p + 1] - first;
    s->rule = tile->rules + p * s->rule_size;
    s->a = (const double *)tile->absorbance + first;
    s->z = (const double *)tile->z + first;
    s->b0 = ((const double *)tile->b0)[p];
}
