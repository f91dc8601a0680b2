/* Sums over the pixels that read a block run in one order whatever threads there are: strips of
 * rows between the middles of blocks are taken by one thread each, and have room of their own. */
#include "core/adjoints/blocks.h"

#include "core/elementary.h"
#include "core/techniques/moments.h"
#include "core/techniques/table.h"

#include <stdlib.h>
#include <string.h>

#define LEAST_MASS 0x1p-900 /* of less no quotient is sure to be finite: it moves nothing */

static const moit_block_family *family_of(const moit_technique *technique) {
    return moit_technique_rows[technique->kind]->blocks;
}

moit_status moit_block_slopes_begin(const moit_job *job, moit_block_slopes *slopes) {
    moit_block_slopes s = {.squares = moit_squares_of(job->fragments, job->technique->resolution),
                           .numbers = 1 + family_of(job->technique)->numbers(job->technique),
                           .collects = true};
    s.strips = s.squares.down + 1;
    size_t row = (size_t)(s.squares.across * s.numbers);
    s.parts = calloc((size_t)s.strips * 2 * row + 1, sizeof *s.parts);
    s.by = calloc((size_t)s.squares.down * row + 1, sizeof *s.by);
    *slopes = s;
    return s.parts && s.by ? MOIT_OK : MOIT_NO_MEMORY;
}

moit_runs moit_block_strips(const moit_block_slopes *slopes) {
    const moit_squares *s = &slopes->squares;
    return (moit_runs){.first = (s->side / 2 - s->side - s->top) * s->width,
                       .length = s->side * s->width};
}

void moit_block_slopes_end(moit_block_slopes *slopes) {
    free(slopes->parts);
    free(slopes->by);
}

/* Where the pixel gives to; k: the corner, of moit_blocks_around. */
static double *part_of(const moit_block_slopes *slopes, int64_t pixel, int k) {
    const moit_squares *s = &slopes->squares;
    moit_between x = moit_squares_across(s, pixel);
    int64_t strip = (pixel / s->width + s->top + s->side - s->side / 2) / s->side;
    int64_t column = k % 2 ? x.high : x.low;
    return slopes->parts + ((2 * strip + k / 2) * s->across + column) * slopes->numbers;
}

void moit_block_slopes_join(moit_block_slopes *slopes) {
    const moit_squares *s = &slopes->squares;
    int64_t row = s->across * slopes->numbers;
    for (int64_t strip = 0; strip < slopes->strips; ++strip)
        for (int64_t lower = 0; lower < 2; ++lower) {
            int64_t last = s->down - 1, at = strip - 1 + lower;
            double *to = slopes->by + (at < 0 ? 0 : at < last ? at : last) * row;
            const double *part = slopes->parts + (2 * strip + lower) * row;
            for (int64_t k = 0; k < row; ++k) to[k] += part[k];
        }
    slopes->collects = false;
}

/* ---- Numbers that add up --------------------------------------------------------------------- */

void moit_mix_blocks(const moit_job *job, const moit_tile *tile, int p, int count, double *mixed) {
    moit_blocks_around around;
    moit_blocks_find_around(job, tile, p, 1, &around);
    for (int k = 0; k < count; ++k) mixed[k] = 0.0;
    for (int c = 0; c < 4; ++c) {
        const double *block = moit_block_state(job, 0, around.place[c][0]).numbers;
        for (int k = 0; k < count; ++k) mixed[k] += around.share[c][0] * block[k];
    }
}

double moit_give_sums(const moit_job *job, const moit_tile *tile, const moit_adjoint *by, int p,
                      const double *mixed, int total, double own, const double *by_read) {
    const moit_block_slopes *slopes = by->blocks;
    int count = slopes->numbers - 1;
    double scale = 1.0, all = 0.0, by_mixed = 0.0, low = mixed[total];
    bool scales = job->technique->full_total;
    for (int k = 0; k < count; ++k) all += by_read[k] * mixed[k];
    if (scales) {
        scale = low > LEAST_MASS ? own / low : 0.0;
        all = low > LEAST_MASS ? all / low : 0.0;
        by_mixed = -all * scale;
    }
    if (slopes->collects) {
        moit_blocks_around around;
        moit_blocks_find_around(job, tile, p, 1, &around);
        for (int c = 0; c < 4; ++c) {
            double *part = part_of(slopes, moit_pixel_at(tile, p), c);
            for (int k = 0; k < count; ++k)
                part[k] +=
                    around.share[c][0] * (scale * by_read[k] + (k == total ? by_mixed : 0.0));
        }
    }
    return scales ? all : 0.0;
}

void moit_take_sums(const moit_tile *tile, const moit_adjoint *by, int p, double *by_numbers) {
    const moit_block_slopes *slopes = by->blocks;
    int64_t at = moit_square_at(&slopes->squares, moit_pixel_at(tile, p));
    double pixels = (double)moit_square_pixels(&slopes->squares, at);
    for (int k = 0; k + 1 < slopes->numbers; ++k)
        by_numbers[k] = slopes->by[at * slopes->numbers + k] / pixels;
}

/* ---- Moments --------------------------------------------------------------------------------- */

/* A pixel reads sums of mass times powers: shares of the blocks'. What it is read by moves them by
 * a polynomial, which of power moments is told by its coefficients around the mean of the block
 * that it moves: around others they would lose digits where its fragments lie close together. Of
 * trigonometric moments it is told by waves. */
typedef struct {
    double numbers[MOIT_MOST_BLOCK_SLOPES]; /* the constant, and the others */
} polynomial;

/* That of S and, unless NULL, of `shape`. */
static polynomial polynomial_of(const moit_moment_state *s, const double *S,
                                const moit_shape *shape, double around) {
    polynomial p = {{0.0}};
    double rule[MOIT_MOST_RULE];
    memcpy(rule, s->rule, (size_t)s->rule_size * sizeof *rule);
    if (s->family == MOIT_POWER) {
        for (int k = 0; k < s->nodes; ++k) rule[k] -= around;
        p.numbers[0] = moit_moments_constant(s->nodes, rule, S);
    }
    moit_moments_of_terms(s->adjoints, s->family, &s->zone, s->nodes, rule, S, p.numbers + 1);
    if (shape) moit_add_shape(shape, around, p.numbers);
    return p;
}

/* What a distribution's moments make of it. */
static double expected(const polynomial *p, int numbers, const double *b) {
    double sum = p->numbers[0];
    for (int k = 0; k < numbers; ++k) sum += p->numbers[1 + k] * b[k];
    return sum;
}

/* What the pixel's own distribution makes of u' S u, the safe one mixed in: products of distances
 * from nodes are orthogonal there, so that no digit is lost. */
static double expected_of_terms(const moit_moment_state *s, const double *S) {
    const double *e = s->rule + s->nodes;
    double d = s->rule[2 * s->nodes], sum = 0.0;
    for (int k = 0, t = 0; k <= s->nodes; t += s->nodes + 1 - k, ++k)
        sum += S[t] * (k ? d / e[k - 1] : d);
    return sum;
}

typedef struct {
    const moit_job *job;
    const moit_tile *tile;
    const moit_block_slopes *slopes;
    const double *safe;
} giving;

/* A pixel's derivatives by its mass (by_mass) and by what S and `shape` move, to the blocks around
 * it. */
static void give_to_blocks(const giving *to, int p, const moit_moment_state *s, const double *S,
                           const moit_shape *shape, double by_mass,
                           const moit_blocks_around *around, int i) {
    const moit_job *job = to->job;
    const double *b = (const double *)to->tile->b + p * (to->slopes->numbers - 1);
    int numbers = to->slopes->numbers - 1;
    double mass = 0.0, kept, keeps = 1.0 - s->bias; /* 0 where all is the safe one */
    for (int k = 0; k < 4; ++k)
        mass += around->share[k][i]
                * *(const double *)moit_block_state(job, 0, around->place[k][i]).weight;
    polynomial whole = {{0.0}};
    if (mass > LEAST_MASS) whole = polynomial_of(s, S, shape, 0.0);
    if (s->family == MOIT_POWER && mass > LEAST_MASS) {
        double biased = expected_of_terms(s, S) + (shape ? shape->mean : 0.0);
        kept = biased - s->bias * expected(&whole, numbers, to->safe);
    } else kept = keeps * expected(&whole, numbers, b);
    for (int k = 0; k < 4; ++k) {
        double share = around->share[k][i];
        double *by = part_of(to->slopes, moit_pixel_at(to->tile, p), k);
        if (share == 0.0) continue;
        by[0] += share * by_mass;
        if (!(mass > LEAST_MASS)) continue;
        moit_state block = moit_block_state(job, 0, around->place[k][i]);
        polynomial own = s->family == MOIT_POWER
                             ? polynomial_of(s, S, shape, *(const double *)block.numbers)
                             : whole;
        by[0] -= share / mass * kept;
        for (int j = 0; j <= numbers; ++j) by[j] += share * keeps / mass * own.numbers[j];
    }
}

/* Of a fragment of mass a at z, of a block of so many pixels. */
static void take_from_block(const moit_job *job, const double *by, const moit_state *block,
                            int numbers, double pixels, double a, double z, double *by_z,
                            double *by_a) {
    double sum = 0.0, slope = 0.0;
    if (moit_family_of(job->technique)->stages == MOIT_POWER) {
        double x = z - *(const double *)block->numbers;
        for (int k = numbers; k >= 0; --k) {
            slope = slope * x + sum;
            sum = sum * x + by[k];
        }
    } else {
        const double turn = 4.0 * 3.141592653589793238 * job->zone.turns;
        sum = by[0];
        for (int k = 1; 2 * k <= numbers; ++k) {
            double c = moit_cos(k * turn * (z + 1.0)), s = moit_sin(k * turn * (z + 1.0));
            sum += by[2 * k - 1] * c + by[2 * k] * s;
            slope += k * turn * (by[2 * k] * c - by[2 * k - 1] * s);
        }
    }
    *by_a += sum / pixels;
    *by_z += a * slope / pixels;
}

static void take_all(const moit_job *job, const moit_tile *tile, const moit_adjoint *by) {
    const moit_block_slopes *slopes = by->blocks;
    const double *a = tile->absorbance, *z = tile->z;
    for (int p = 0; p < tile->pixels; ++p) {
        int64_t at = moit_square_at(&slopes->squares, moit_pixel_at(tile, p));
        double pixels = (double)moit_square_pixels(&slopes->squares, at);
        moit_state block = moit_block_state(job, 0, at);
        for (int i = tile->offsets[p]; i < tile->offsets[p + 1]; ++i)
            take_from_block(job, slopes->by + at * slopes->numbers, &block, slopes->numbers - 1,
                            pixels, a[i], z[i], by->work[1] + i, by->work[2] + i);
    }
}

void moit_moments_pull_blocks(const moit_job *job, const moit_tile *tile, const moit_adjoint *by,
                              moit_read_pixel *read) {
    moit_moment_state s = moit_any_state(job);
    moit_moment_steps steps = moit_technique_moments(job->technique, MOIT_FLOAT64);
    giving to = {job, tile, by->blocks, steps.safe};
    bool own_total = job->technique->full_total;
    moit_blocks_around around;
    moit_shape shape;
    for (int p = 0; p < tile->pixels; ++p) {
        int first = tile->offsets[p], i = p % MOIT_AROUND, left = tile->pixels - p;
        double S[MOIT_MOST_TERMS] = {0.0};
        if (i == 0)
            moit_blocks_find_around(job, tile, p, left < MOIT_AROUND ? left : MOIT_AROUND, &around);
        moit_move_state(tile, p, &s);
        moit_readings at = moit_readings_of(job, tile, by, p, job->technique->moments.exclude_self);
        if (by->kept && !job->depths) at.kept = by->kept + first, at.apart = by->apart;
        double by_b0 = own_total ? -tile->total[p] * by->total[p] : 0.0;
        if (s.b0 > 0.0 && read) by_b0 += read(job, tile, &s, p, by, S, &shape);
        else if (s.b0 > 0.0)
            by_b0 += s.adjoints->sum_pulled(s.count, &s.zone, &at, s.rule, s.b0, s.beta, S);
        if (to.slopes->collects)
            give_to_blocks(&to, p, &s, S, read && s.b0 > 0.0 ? &shape : NULL,
                           own_total ? 0.0 : by_b0, &around, i);
        for (int k = first; own_total && k < tile->offsets[p + 1]; ++k) by->work[2][k] += by_b0;
    }
    if (!to.slopes->collects) take_all(job, tile, by);
}
