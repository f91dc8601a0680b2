/* Backwards through bounded neural transmittance, kernels/bounded_neural.h: the bounds as moments
 * have them, the network layer by layer, and what it sees of a pixel, the shape of its absorbance,
 * by central moments. Where a number that the network sees is clamped, it stays so. */
#include "core/elementary.h"
#include "core/adjoints/blocks.h"
#include "core/adjoints/networks.h"
#include "core/techniques/table.h"

#include <math.h>
#include <string.h>

enum { OF_FRAGMENT = 4, MOST_INPUTS = 10, CHUNK = 64, STRIDE = CHUNK + MOIT_PADDING };

const char *moit_bounded_refusal(const moit_technique *technique) {
    if (moit_extents_are_words(technique))
        return "extents in words are steps; use depth_range=\"image\"";
    return NULL;
}

/* By what fragments see of a pixel: its mean (as a depth), 1 / deviation, total, and `seen`. */
typedef struct {
    double mean, inverse_deviation, total, seen[6];
} by_outline;

/* Central moments of a rule, from the second on; and its mean. */
static double central_moments(int nodes, const double *rule, double moment[7]) {
    const double *g = rule, *e = rule + nodes;
    double share[4], all = 0.0, mean = 0.0, d = rule[2 * nodes];
    for (int i = 0; i < nodes; ++i) {
        double slope = 1.0;
        for (int k = 0; k < nodes; ++k)
            if (k != i) slope *= g[i] - g[k];
        share[i] = d / fmax(e[i] * slope * slope, 1e-300);
        all += share[i];
    }
    for (int i = 0; i < nodes; ++i) mean += share[i] / fmax(all, 1e-300) * (g[i] - g[0]);
    for (int k = 0; k < 7; ++k) moment[k] = k == 2 * nodes ? d : 0.0;
    for (int i = 0; i < nodes; ++i) {
        double power = share[i] / fmax(all, 1e-300), beside = (g[i] - g[0]) - mean;
        for (int k = 0; k <= 2 * nodes && k < 7; ++k, power *= beside) moment[k] += power;
    }
    return g[0] + mean;
}

static bool within(double x, double least, double most) { return x > least && x < most; }

/* From outlines to the polynomial whose mean changes as they make the loss do; the logarithm of the
 * deviation is not `clamped`. */
static moit_shape pull_outline(int count, const double *rule, bool clamped, const by_outline *by) {
    moit_shape s = {0};
    double m[7], by_m[7] = {0.0};
    s.middle = central_moments(count / 2, rule, m);
    double variance = fmax(m[2], 1e-30), deviation = sqrt(variance), by_variance = 0.0;
    by_variance -= 0.5 * by->inverse_deviation / (variance * deviation);
    if (!clamped) by_variance += 0.5 * by->seen[1] / variance;
    double ratio = m[3] / (variance * deviation);
    if (within(ratio, -6.0, 6.0)) {
        by_m[3] += by->seen[2] / (variance * deviation);
        by_variance -= 1.5 * by->seen[2] * ratio / variance;
    }
    ratio = m[4] / (variance * variance);
    if (within(ratio, 1.0, 403.428793492735123)) {
        by_m[4] += by->seen[3] / m[4];
        by_variance -= 2.0 * by->seen[3] / variance;
    }
    if (count > 4) {
        ratio = m[5] / (variance * variance * deviation);
        if (fabs(ratio) < 2.2e4) {
            double slope = by->seen[4] / (1.0 + fabs(ratio));
            by_m[5] += slope / (variance * variance * deviation);
            by_variance -= 2.5 * slope * ratio / variance;
        }
        ratio = m[6] / (variance * variance * variance);
        if (within(ratio, 1.0, 1.6e5)) {
            by_m[6] += by->seen[5] / m[6];
            by_variance -= 3.0 * by->seen[5] / variance;
        }
    }
    by_m[2] = m[2] > 1e-30 ? by_variance : 0.0;
    s.factor[1] = by->mean;
    for (int k = 2; k <= count; ++k) { /* the mean moves, too */
        s.factor[k] += by_m[k];
        s.factor[1] -= k * m[k - 1] * by_m[k];
        s.mean += m[k] * by_m[k]; /* and that of the distance from it is 0 */
    }
    return s;
}

/* Some places of a pixel, with what the network sees of them in columns: by_least and by_most
 * become what the bounds of absorbance change by. */
static void pull_places(const moit_job *job, const moit_moment_state *s, const double *outline,
                        const moit_readings *at, int first, int n, const double *column,
                        double *by_least, double *by_most, by_outline *by, double *by_w) {
    int inputs = OF_FRAGMENT + s->count;
    moit_network_shape network = {job->technique->bounded.network, inputs, 8, 8};
    double total = fmax(s->b0, 1e-30), inverse_deviation = outline[1];
    for (int i = 0; i < n; ++i) {
        double x[MOST_INPUTS], by_x[MOST_INPUTS] = {0.0}, by_A = at->by[first + i];
        for (int k = 0; k < inputs; ++k) x[k] = column[k * STRIDE + i];
        double least = column[inputs * STRIDE + i], room = column[(inputs + 1) * STRIDE + i];
        moit_network_activity a = moit_ask_network(&network, x);
        moit_pull_network(&network, x, &a, by_A * room, by_x, by_w);
        double by_room = room > 0.0 ? by_A * a.share + by_x[1] / total : 0.0;
        by_least[i] = by_A + by_x[0] / total - by_room;
        by_most[i] = by_room;
        if (s->b0 > 1e-30) by->total -= (by_x[0] * least + by_x[1] * room) / (total * total);
        if (at->own) at->by_own[first + i] += by_x[2];
        if (fabs(x[3]) < 8.0) {
            double beside = at->z[first + i] - s->rule[0] - outline[0];
            at->by_z[first + i] += by_x[3] * inverse_deviation;
            by->mean -= by_x[3] * inverse_deviation;
            by->inverse_deviation += by_x[3] * beside;
        }
        for (int k = 0; k < s->count; ++k) by->seen[k] += by_x[OF_FRAGMENT + k];
    }
}

static double read_pixel(const moit_job *job, const moit_tile *tile, const moit_moment_state *s,
                         int p, const moit_adjoint *by, double *S, moit_shape *shape) {
    const double *outline = moit_bounded_outlines(job, tile) + p * MOIT_OUTLINE_SIZE;
    double *by_least = tile->bounds[0], *by_most = tile->bounds[1], more[MOIT_MOST_TERMS];
    double column[(MOST_INPUTS + 2) * STRIDE], by_b0 = 0.0;
    moit_readings at = moit_readings_of(job, tile, by, p, true);
    by_outline o = {0};
    for (int i = 0; i < at.n; i += CHUNK) {
        int n = at.n - i < CHUNK ? at.n - i : CHUNK, ends[2] = {0, n};
        job->stages->bounded_features(s->count, 1, ends, at.z + i, at.own ? at.own + i : NULL,
                                      s->rule, outline, &s->b0, job->technique->bounded.network,
                                      STRIDE, column);
        pull_places(job, s, outline, &at, i, n, column, by_least + i, by_most + i, &o, by->network);
    }
    for (int most = 0; most < 2; ++most) {
        at.by = most ? by_most : by_least;
        double *terms = most ? more : S;
        by_b0 += s->adjoints->sum_pulled(s->count, &s->zone, &at, s->rule, s->b0, most, terms);
    }
    moit_leave_depths(s, &at);
    for (int t = 0; t < MOIT_MOST_TERMS; ++t) S[t] += more[t];
    double logarithm = moit_log(fmax(s->b0, 1e-30));
    by_b0 += o.total + (within(logarithm, -8.0, 8.0) ? o.seen[0] / s->b0 : 0.0);
    bool clamped = !(outline[MOIT_OUTLINE_SHARED + 1] > -8.0);
    if (!clamped) moit_adjoint_of_unit(job, tile, p, o.seen[1], by);
    *shape = pull_outline(s->count, s->rule, clamped, &o);
    return by_b0;
}

void moit_bounded_pull_pixel(const moit_job *job, const moit_tile *tile, const moit_moment_state *s,
                             int p, const moit_adjoint *by) {
    int first = tile->offsets[p];
    double S[MOIT_MOST_TERMS], by_b0 = -tile->total[p] * by->total[p];
    moit_shape shape;
    by_b0 += read_pixel(job, tile, s, p, by, S, &shape);
    moit_give_state(s, S, &shape, by_b0, tile->points[0] + first, tile->points[1] + first,
                    by->work[1] + first, by->work[2] + first);
}

void moit_bounded_pull_back(const moit_job *job, moit_tile *tile, const moit_adjoint *by) {
    moit_moment_state s = moit_any_state(job);
    moit_adjoint_begin(job, tile, by);
    if (by->blocks) moit_moments_pull_blocks(job, tile, by, read_pixel);
    for (int p = 0; !by->blocks && p < tile->pixels; ++p) {
        moit_move_state(tile, p, &s);
        if (s.b0 > 0.0) {
            moit_bounded_pull_pixel(job, tile, &s, p, by);
            continue;
        }
        double by_b0 = -tile->total[p] * by->total[p];
        for (int i = tile->offsets[p]; i < tile->offsets[p + 1]; ++i) by->work[2][i] += by_b0;
    }
    moit_adjoint_of_absorbance(job, tile, by);
    if (by->blocks && !job->technique->full_total) moit_adjoint_of_totals(tile, by, by->total);
    moit_adjoint_of_warp(job, tile, by);
}
