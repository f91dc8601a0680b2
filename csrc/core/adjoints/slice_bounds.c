/* Backwards through what power moments prove of slices: where a transmittance is kept at a bound it
 * moves as that does (techniques/slice_moments.c, power_bounds.c). What rounding widens bounds by,
 * what max_alpha cuts off, and what keeping nodes within [-2, 2] widens them by, stays. */
#include "core/adjoints/moments.h"
#include "core/elementary.h"
#include "core/techniques/slices.h"

#include "core/techniques/moments.h"
#include "core/techniques/table.h"

#include <math.h>
#include <string.h>

enum { COUNT = 4 };

void moit_slices_take_bounded(const moit_job *job, const moit_tile *tile, const moit_adjoint *by) {
    double *at_lower = tile->bounds[0], *at_upper = tile->bounds[1];
    const double *T = job->depths ? tile->curve : tile->T;
    bool absorbed = tile->absorbed && !job->depths;
    int n = moit_slice_offsets(job, tile)[tile->pixels];
    for (int i = 0; i < n; ++i) {
        double least = absorbed ? -moit_log(at_upper[i]) : at_upper[i];
        double most = absorbed ? -moit_log(at_lower[i]) : at_lower[i];
        bool upper = T[i] == least, lower = !upper && T[i] == most;
        at_lower[i] = lower ? by->T[i] : 0.0;
        at_upper[i] = upper ? by->T[i] : 0.0;
        if (lower || upper) by->T[i] = 0.0;
    }
}

/* By both bounds of pixel p's places; z is that of moments. */
static void pull_pixel(const moit_job *of, const moit_tile *tile, const moit_adjoint *by,
                       moit_moment_state *s, int p, double *by_z, double *by_place) {
    double S[2][MOIT_MOST_TERMS], by_b0 = 0.0;
    int first = tile->offsets[p];
    moit_move_state(tile, p, s);
    if (!(s->b0 > 0.0)) return;
    for (int lower = 0; lower < 2; ++lower) {
        moit_readings at = moit_readings_of(of, tile, by, p, lower);
        int place = moit_slice_offsets(of, tile)[p];
        double *given = tile->bounds[lower ? 0 : 1] + place;
        at.by = given;
        at.by_z = by_place + place;
        by_b0 += s->adjoints->sum_pulled(COUNT, &s->zone, &at, s->rule, s->b0, lower, S[lower]);
        moit_leave_depths(s, &at);
    }
    for (int t = 0; t < MOIT_MOST_TERMS; ++t) S[0][t] += S[1][t];
    moit_give_state(s, S[0], NULL, by_b0, tile->points[1] + first, tile->points[2] + first,
                    by_z + first, by->work[2] + first);
}

void moit_slices_pull_bounds(const moit_job *job, moit_tile *tile, const moit_adjoint *by) {
    moit_technique moments;
    moit_job of = moit_slices_job_of_moments(job, &moments);
    double *by_z = by->work[0], *by_place = job->depths ? tile->points[0] : by_z;
    /* from z of moments to that of slices, whose range is half as long */
    double rise = job->technique->warp == MOIT_WARP_NONE ? 1.0 : 2.0;
    int n = tile->fragments, places = moit_slice_offsets(job, tile)[tile->pixels];
    of.bias = moit_bias_of_bounds(MOIT_FLOAT64, COUNT);
    moit_moments_gather(&of, tile);
    moit_moments_read(of.precise, MOIT_FLOAT64, &moments, NULL, of.bias, tile->pixels, tile->b,
                      tile->double_b, tile->rules);
    if (job->depths) moit_moments_warp_curve(&of, tile);
    memset(by_z, 0, (size_t)n * sizeof *by_z);
    if (job->depths) memset(by_place, 0, (size_t)places * sizeof *by_place);
    moit_moment_state s = moit_any_state(&of);
    for (int p = 0; p < tile->pixels; ++p) pull_pixel(&of, tile, by, &s, p, by_z, by_place);
    for (int i = 0; i < n; ++i) by->work[1][i] += rise * by_z[i];
    for (int i = 0; job->depths && i < places; ++i) by->curve_z[i] += rise * by_place[i];
    moit_warp_tile(job, tile);
    if (job->depths) moit_moments_place_curve(job, tile);
}
