/* What sums of powers bound of the mass in front of a place, with slopes by all of them: for arrays
 * that have a row a power. Each ray has one place, so a caller's derivatives are these slopes times
 * his own, and the rule of a ray is made once for both. */
#include "moit_gradients.h"

#include "core/adjoints/moments.h"
#include "core/techniques/moments.h"
#include "core/techniques/table.h"
#include "core/threads.h"

#include <float.h>
#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

enum { BLOCK = 256, ROOM = BLOCK + MOIT_PADDING, MOST_POWERS = 8 };

typedef struct {
    const moit_technique *technique;
    const moit_power_rows *given;
    const moit_stages *stages, *precise;
    const moit_moment_adjoints *adjoints;
    const moit_moment_steps *steps;
    bool in_one;      /* all of it by one loop */
    atomic_bool *odd; /* becomes true where numbers do not fit */
} rows_job;

/* A block's numbers: as given, b0, means, z and the answer; and in double. */
typedef struct {
    double b0_given[ROOM], b_given[ROOM * MOST_POWERS], z_given[ROOM], A[ROOM];
    double b0[ROOM], z[ROOM], one[ROOM], b[ROOM * MOST_POWERS], rules[ROOM * MOIT_MOST_RULE];
    double by_b0[ROOM], by_b[ROOM * MOST_POWERS], by_z[ROOM], by_own[ROOM];
    int32_t offsets[BLOCK + 1];
} block;

static void take_float(const moit_power_rows *given, int powers, int64_t first, int n, block *o) {
    const float *rows = given->rows, *mass = rows + first, *z = given->z;
    float *b0 = (float *)(void *)o->b0_given, *b = (float *)(void *)o->b_given;
    memcpy(b0, mass, (size_t)n * sizeof *b0);
    memcpy(o->z_given, z + first, (size_t)n * sizeof *z);
    for (int k = 0; k < powers; ++k)
        for (int p = 0; p < n; ++p) {
            float sum = rows[(k + 1) * given->rays + first + p];
            b[p * powers + k] = mass[p] > 0.0f ? sum / mass[p] : 0.0f;
        }
}

static void take_double(const moit_power_rows *given, int powers, int64_t first, int n, block *o) {
    const double *rows = given->rows, *mass = rows + first, *z = given->z;
    memcpy(o->b0_given, mass, (size_t)n * sizeof *mass);
    memcpy(o->z_given, z + first, (size_t)n * sizeof *z);
    for (int k = 0; k < powers; ++k)
        for (int p = 0; p < n; ++p) {
            double sum = rows[(k + 1) * given->rays + first + p];
            o->b_given[p * powers + k] = mass[p] > 0.0 ? sum / mass[p] : 0.0;
        }
}

/* Whether n rays' numbers are what they may be. */
#define FIT(number, absolute, greatest) \
    do { \
        const number *mass = (const number *)given->rows + first; \
        const number *z = (const number *)given->z + first, most = (number)given->most; \
        for (int p = 0; p < n; ++p) odd |= !(mass[p] >= 0 && mass[p] <= greatest); \
        for (int p = 0; p < n; ++p) odd |= !(absolute(z[p]) <= most); \
        for (int k = 1; k <= powers; ++k) { \
            const number *power = mass + k * given->rays; \
            for (int p = 0; p < n; ++p) odd |= !(absolute(power[p]) <= most * mass[p]); \
        } \
    } while (0)

static bool fit(const moit_power_rows *given, int powers, int64_t first, int n) {
    int odd = 0;
    if (given->precision == MOIT_FLOAT64) FIT(double, fabs, DBL_MAX);
    else FIT(float, fabsf, FLT_MAX);
    return !odd;
}
#undef FIT

/* From derivatives by the means, b0 being what it is, to those by the rows. */
static void give_slopes(const rows_job *job, int powers, int64_t first, int n, block *o) {
    const moit_power_rows *to = job->given;
    double keeps = 1.0 - job->technique->moments.bias;
    for (int p = 0; p < n; ++p) {
        bool there = o->b0[p] > 0.0;
        double by_mass = there ? o->by_b0[p] : 0.0;
        for (int k = 0; k < powers; ++k) {
            int at = p * powers + k;
            double by_row = there ? keeps * o->by_b[at] / o->b0[p] : 0.0;
            by_mass -= by_row * moit_number(to->precision, o->b_given, at);
            moit_set_number(to->precision, to->slopes, (k + 1) * to->rays + first + p, by_row);
        }
        moit_set_number(to->precision, to->slopes, first + p, by_mass);
        moit_set_number(to->precision, to->by_z, first + p, there ? o->by_z[p] : 0.0);
    }
}

static moit_status answer_block(void *context, int64_t item, int thread) {
    const rows_job *job = context;
    const moit_power_rows *given = job->given;
    const moit_technique *technique = job->technique;
    int powers = technique->count;
    int64_t first = item * BLOCK, left = given->rays - first;
    int n = (int)(left < BLOCK ? left : BLOCK);
    size_t scalar = moit_scalar_size(given->precision);
    if (!fit(given, powers, first, n)) atomic_store(job->odd, true);
    if (job->in_one) {
        moit_rows rows = {.rays = given->rays,
                          .rows = given->rows,
                          .z = given->z,
                          .bound = given->bound,
                          .slopes = given->slopes,
                          .by_z = given->by_z,
                          .bias = technique->moments.bias,
                          .least = job->steps->least,
                          .beta = technique->moments.overestimation,
                          .safe = job->steps->safe};
        job->adjoints->bound_rows(powers, &rows, first, n);
        return MOIT_OK;
    }
    block o;
    double beta = technique->moments.overestimation;
    (void)thread;
    (given->precision == MOIT_FLOAT64 ? take_double : take_float)(given, powers, first, n, &o);
    for (int p = 0; p <= n; ++p) o.offsets[p] = p;
    /* lanes beyond the last ray are read, too */
    memset((char *)o.z_given + (size_t)n * scalar, 0, MOIT_PADDING * scalar);
    moit_moments_read(job->precise, given->precision, technique, NULL, technique->moments.bias, n,
                      o.b_given, o.b, o.rules);
    job->stages->moments[MOIT_POWER].transmittance(powers, NULL, n, o.offsets, o.z_given, NULL,
                                                   o.rules, o.b0_given, beta, true, o.A);
    memcpy((char *)given->bound + (size_t)first * scalar, o.A, (size_t)n * scalar);
    if (!given->slopes) return MOIT_OK;
    for (int p = 0; p < n; ++p) {
        o.b0[p] = moit_number(given->precision, o.b0_given, p);
        o.z[p] = moit_number(given->precision, o.z_given, p);
        o.one[p] = 1.0;
    }
    job->adjoints->pull_each(powers, n, o.rules, o.b0, o.z, NULL, beta, o.one, o.by_b0, o.by_b,
                             o.by_z, o.by_own);
    give_slopes(job, powers, first, n, &o);
    return MOIT_OK;
}

moit_status moit_bound_of_rows(const moit_technique *technique, const moit_power_rows *rows,
                               bool *all_fit, const moit_run *run) {
    atomic_bool odd = false;
    moit_moment_steps steps = moit_technique_moments(technique, rows->precision);
    rows_job job = {.technique = technique,
                    .given = rows,
                    .stages = moit_stages_of(rows->precision, run->isa),
                    .precise = moit_stages_of(MOIT_FLOAT64, run->isa),
                    .adjoints = moit_moment_adjoints_of(technique, run->isa),
                    .steps = &steps,
                    .odd = &odd,
                    .in_one = rows->precision == MOIT_FLOAT32 && technique->count <= MOIT_ROWS_COUNT
                              && technique->moments.bias >= MOIT_ROWS_BIAS};
    moit_status status =
        moit_parallel_for(run, (rows->rays + BLOCK - 1) / BLOCK, answer_block, &job);
    *all_fit = !odd;
    return status;
}
