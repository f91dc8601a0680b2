/* Thick fragments as thin ones: Gauss' rule of how absorbance lies in warped depth.
 *
 * A rule of n points has the measure's own moments up to degree 2 n - 1, and its integrals of what
 * is smooth to rounding where n is great enough: what a technique keeps of the points is what it
 * would keep of the thick fragment. Each point takes its share of the absorbance, so that together
 * they hide what the fragment hides, and emits that share of the light where it is. Nothing
 * cancels, however thin a fragment is: the rule is made within its own extent. */
#include "core/elementary.h"
#include "core/extents.h"
#include "core/gauss_rules.h"
#include "core/offsets.h"
#include "core/parts.h"
#include "core/thin_cells.h"
#include "core/threads.h"
#include "core/tile.h"

#include <math.h>
#include <stdlib.h>

enum { LEAST_POINTS = 3, BLOCK = 1024, TABLES = 3 };
static const int table_points[TABLES] = {32, 64, 192};

/* Legendre's rules, that measures are made of. */
typedef struct {
    double at[TABLES][MOIT_MOST_MEASURE_POINTS], weight[TABLES][MOIT_MOST_MEASURE_POINTS];
} legendre;

/* Depth within an extent by a variable x in [-1, 1] that warped depth is proportional to. */
typedef struct {
    bool is_log;
    double middle, half; /* depth is middle + half x, or middle exp(half x) */
} course;

static course course_of(const moit_extent *e, moit_warp warp) {
    if (warp == MOIT_WARP_LOG && e->front > 0.0)
        return (course){true, sqrt(e->front) * sqrt(e->back),
                        0.5 * (moit_log(e->back) - moit_log(e->front))};
    return (course){false, 0.5 * e->front + 0.5 * e->back, 0.5 * e->back - 0.5 * e->front};
}

static double depth_at(const course *c, double x) {
    return c->is_log ? c->middle * moit_exp(c->half * x) : c->middle + c->half * x;
}

/* How many points the integrals of exp(i frequency z) take, z from 0 to 1 over the whole range, to
 * 1e-9 of what is integrated: 2 (phase / 2)^(2 n) / (2 n)! is what is left over. */
static int points_for(double phase) {
    double left = 2.0, square = 0.25 * phase * phase;
    int n = 0;
    while (n < MOIT_MOST_RULE_POINTS && (n < LEAST_POINTS || !(left < 1e-9))) {
        ++n;
        left *= square / ((2 * n - 1) * (2 * n));
    }
    return n;
}

/* What the warp's whole range is in units of a course's half. */
static double range_of(const course *c, double near, double far) {
    if (c->is_log) return near > 0.0 ? moit_log(far) - moit_log(near) : HUGE_VAL;
    return far - near;
}

typedef struct {
    const moit_fragments *f;
    const moit_thinning *how;
    int64_t *offsets; /* of the points; their numbers are put at p + 1 where `out` is NULL */
    const moit_pieces *out;
    const legendre *tables;
    _Atomic bool changes;
} thin_job;

/* What is opaque hides all from where it begins: it is a surface there. What cells tell apart is
 * absorbance, and where there is none so is what asks. */
static bool is_thinned(const thin_job *job, int64_t i, const moit_extent *e) {
    return e->front < e->back && (job->how->volumes || e->is_gaussian) && !moit_is_opaque(job->f, i)
           && !(job->how->cells && moit_opacity_of(job->f, i, 0) == 0.0);
}

static void count_point(void *count, double depth, double share) {
    (void)depth;
    (void)share;
    ++*(int *)count;
}

/* The points that cells tell apart. */
static void give_in_cells(const thin_job *job, int64_t i, const moit_extent *e, double near,
                          double far, moit_give_point *give, void *context) {
    bool is_warped = job->how->warp != MOIT_WARP_NONE; /* else depth is [0, 1] already */
    moit_cells cells = {job->how->warp, is_warped ? near : 0.0, is_warped ? far : 1.0,
                        job->how->cells};
    double absorbed = -moit_log1p(-moit_opacity_of(job->f, i, 0));
    moit_points_of_cells(e, &cells, absorbed / job->how->step, give, context);
}

static int count_of(const thin_job *job, int64_t i, const moit_extent *e, double near, double far) {
    if (job->how->cells) {
        int count = 0;
        give_in_cells(job, i, e, near, far, count_point, &count);
        return count;
    }
    if (job->how->points) return job->how->points;
    course c = course_of(e, job->how->warp);
    double whole = range_of(&c, near, far);
    return points_for(whole > 0.0 ? job->how->frequency * fmin(1.0, c.half / whole) : 0.0);
}

/* The rule of a fragment; returns how many points it has. */
static int rule_of(const thin_job *job, const moit_extent *e, int count, double *depth,
                   double *share) {
    course c = course_of(e, job->how->warp);
    double at[MOIT_MOST_MEASURE_POINTS], mass[MOIT_MOST_MEASURE_POINTS],
        here[MOIT_MOST_MEASURE_POINTS];
    /* as many that half a deviation is told from the next */
    double needed = c.is_log ? 4.0 * c.half : 0.0;
    if (e->is_gaussian)
        needed = c.is_log ? 4.0 * c.half * (1.0 + e->mean / e->deviation)
                          : 4.0 * (c.half / e->deviation);
    needed = fmax(needed, 2.0 * count + 8.0);
    int table = 0;
    while (table + 1 < TABLES && table_points[table] < needed) ++table;
    int points = table_points[table];
    for (int j = 0; j < points; ++j) {
        at[j] = job->tables->at[table][j];
        here[j] = c.is_log ? c.half * at[j] : c.middle + c.half * at[j];
    }
    if (c.is_log) {
        moit_exps(points, here, mass);
        for (int j = 0; j < points; ++j) here[j] = c.middle * mass[j];
    }
    moit_shares_at(e, points, here, e->front, e->back, mass);
    for (int j = 0; j < points; ++j) {
        mass[j] = job->tables->weight[table][j] * mass[j];
        if (c.is_log) mass[j] *= here[j] / c.middle;
    }
    count = moit_gauss_rule(points, at, mass, count, depth, share);
    for (int k = 0; k < count; ++k)
        depth[k] = fmin(e->back, fmax(e->front, depth_at(&c, depth[k])));
    if (count) return count;
    depth[0] = 0.5 * e->front + 0.5 * e->back;
    share[0] = 1.0;
    return 1;
}

/* Where a fragment's points go, and which is nearest to its depth. */
typedef struct {
    const thin_job *job;
    int64_t fragment, at;
    double depth, distance; /* its own, and how far from it the nearest is */
} placing;

static void put_point(void *context, double depth, double share) {
    placing *to = context;
    const thin_job *job = to->job;
    const moit_pieces *out = job->out;
    moit_precision precision = job->f->precision;
    moit_put_part(job->f, to->fragment, share, out, to->at);
    moit_set_number(precision, out->depth, to->at, depth);
    if (out->back) moit_set_number(precision, out->back, to->at, depth);
    if (fabs(depth - to->depth) < to->distance) {
        to->distance = fabs(depth - to->depth);
        out->first[to->fragment] = to->at;
    }
    ++to->at;
}

static void put_points(const thin_job *job, int64_t i, const moit_extent *e, double near,
                       double far, int count, int64_t at) {
    double depth[MOIT_MOST_RULE_POINTS], share[MOIT_MOST_RULE_POINTS];
    placing to = {job, i, at, moit_number(job->f->precision, job->f->depth, i), HUGE_VAL};
    job->out->first[i] = at;
    if (job->how->cells) {
        give_in_cells(job, i, e, near, far, put_point, &to);
        return;
    }
    int points = rule_of(job, e, count, depth, share);
    for (int k = 0; k < count; ++k)
        put_point(&to, depth[k < points ? k : points - 1], k < points ? share[k] : 0.0);
}

/* What a pixel's depths are warped from, if each has its own range. */
static void range_of_pixel(const moit_fragments *f, int64_t first, int64_t last, double *near,
                           double *far) {
    *near = HUGE_VAL;
    *far = -HUGE_VAL;
    for (int64_t i = first; i < last; ++i) {
        moit_extent e = moit_extent_of(f, i);
        *near = fmin(*near, e.front);
        *far = fmax(*far, e.back);
    }
}

static moit_status thin_block(void *context, int64_t item, int thread) {
    (void)thread;
    thin_job *job = context;
    const moit_fragments *f = job->f;
    int64_t first = item * BLOCK, last = first + BLOCK < f->pixels ? first + BLOCK : f->pixels;
    for (int64_t p = first; p < last; ++p) {
        int64_t begin = job->out ? job->offsets[p] : 0, at = begin;
        double near = f->near, far = f->far;
        if (job->how->range_per_pixel)
            range_of_pixel(f, f->offsets[p], f->offsets[p + 1], &near, &far);
        for (int64_t i = f->offsets[p]; i < f->offsets[p + 1]; ++i) {
            moit_extent e = moit_extent_of(f, i);
            bool thinned = is_thinned(job, i, &e);
            int count = thinned ? count_of(job, i, &e, near, far) : 1;
            if (thinned && !job->out) job->changes = true;
            if (job->out && thinned) put_points(job, i, &e, near, far, count, at);
            else if (job->out) {
                moit_copy_fragment(f, i, job->out, at);
                job->out->first[i] = at;
            }
            at += count;
        }
        if (!job->out) job->offsets[p + 1] = at - begin;
    }
    return MOIT_OK;
}

static int64_t blocks_of(int64_t pixels) { return (pixels + BLOCK - 1) / BLOCK; }

moit_status moit_point_offsets(const moit_fragments *fragments, const moit_thinning *how,
                               int64_t *offsets, bool *changes, const moit_run *run) {
    thin_job job = {.f = fragments, .how = how, .offsets = offsets};
    moit_status status = moit_parallel_for(run, blocks_of(fragments->pixels), thin_block, &job);
    if (status != MOIT_OK) return status;
    *changes = job.changes;
    moit_offsets_of_counts(offsets, fragments->pixels);
    return MOIT_OK;
}

moit_status moit_thin(const moit_fragments *fragments, const moit_thinning *how,
                      const int64_t *offsets, const moit_pieces *pieces, const moit_run *run) {
    legendre *tables = malloc(sizeof *tables);
    if (!tables) return MOIT_NO_MEMORY;
    for (int t = 0; t < TABLES; ++t)
        moit_legendre_rule(table_points[t], tables->at[t], tables->weight[t]);
    thin_job job = {
        .f = fragments, .how = how, .offsets = (int64_t *)offsets, .out = pieces, .tables = tables};
    moit_status status = moit_parallel_for(run, blocks_of(fragments->pixels), thin_block, &job);
    free(tables);
    return status;
}
