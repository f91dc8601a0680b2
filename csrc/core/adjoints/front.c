/* Backwards through front layers, techniques/front.c: the nearest exactly, and the tail through its
 * moments, whose bias grows as the tail is less of the whole. Which are the nearest stays. */
#include "core/adjoints/moments.h"
#include "core/techniques/moments.h"
#include "core/techniques/table.h"

const char *moit_front_refusal(const moit_technique *technique) {
    moit_technique tail = moit_front_tail(technique);
    return tail.kind == MOIT_BOUNDED_NEURAL ? moit_bounded_refusal(&tail) : NULL;
}

/* ---- What an image makes of the tail --------------------------------------------------------- */

static bool is_front(const moit_job *job, const moit_tile *tile, int i) {
    return tile->rank[i] < job->technique->count;
}

/* What T of the tail is scaled by, and what it covers as it is. */
static double scale_of(const moit_job *job, const moit_tile *tile, int p, const double *T,
                       double *covers) {
    const double *alpha = tile->alpha;
    *covers = 0.0;
    for (int i = tile->offsets[p]; i < tile->offsets[p + 1]; ++i)
        if (!is_front(job, tile, i)) *covers += alpha[i] * T[i];
    double due = moit_front_through(job, tile)[p] - tile->total[p];
    return job->technique->normalize && *covers > 0.0 ? due / *covers : 1.0;
}

void moit_front_see(const moit_job *job, const moit_tile *tile, double *T) {
    for (int p = 0; p < tile->pixels; ++p) {
        double covers, scale = scale_of(job, tile, p, T, &covers);
        for (int i = tile->offsets[p]; i < tile->offsets[p + 1]; ++i)
            if (!is_front(job, tile, i)) T[i] *= scale;
    }
}

/* The nearest of pixel p, in tile->order. */
static int kept_of(const moit_job *job, const moit_tile *tile, int p) {
    int n = tile->offsets[p + 1] - tile->offsets[p];
    return n < job->technique->count ? n : job->technique->count;
}

void moit_front_unsee(const moit_job *job, const moit_tile *tile, const moit_adjoint *by) {
    const double *alpha = tile->alpha, *T = tile->T;
    for (int p = 0; job->technique->normalize && p < tile->pixels; ++p) {
        double covers, scale = scale_of(job, tile, p, T, &covers), by_scale = 0.0;
        int first = tile->offsets[p], end = tile->offsets[p + 1];
        if (!(covers > 0.0)) continue;
        for (int i = first; i < end; ++i)
            if (!is_front(job, tile, i)) by_scale += by->T[i] * T[i];
        double by_due = by_scale / covers, by_covers = -by_due * scale;
        for (int i = first; i < end; ++i) {
            if (is_front(job, tile, i)) continue;
            by->T[i] = by->T[i] * scale + by_covers * alpha[i];
            by->alpha[i] += by_covers * T[i];
        }
        by->total[p] -= by_due;
        moit_adjoint_of_products(kept_of(job, tile, p), tile->order + first, alpha, NULL, by_due,
                                 by->alpha, by->work[0]);
    }
}

/* ---- States ---------------------------------------------------------------------------------- */

typedef struct {
    const moit_job *job, *own; /* of front layers, and of what reads their tail */
    const double *T;           /* of the tail alone, at fragments or in curves */
    double *a;                 /* (fragments) of the tail, 0 of the nearest */
} front;

/* Pixel p's curve: from by->T to what the tail absorbs, in place; by_T, by that in front of each of
 * the nearest; gives that by what all of these let through. */
static double pull_curve(const front *f, const moit_tile *tile, int p, const moit_adjoint *by,
                         double *by_T) {
    const double *depth = tile->depth;
    const int32_t *order = tile->order + tile->offsets[p];
    int kept = kept_of(f->job, tile, p);
    double through = moit_front_through(f->job, tile)[p], by_through = 0.0;
    bool small = f->job->technique->front.small_keys; /* which have depth as z */
    for (int k = 0; k < kept; ++k) by_T[order[k]] = 0.0;
    for (int64_t k = 0, i = p * f->job->depths; k < f->job->depths; ++k, ++i) {
        int nearer = 0;
        double asked = small ? ((const double *)tile->curve_z)[i] : f->job->depth[k];
        while (nearer < kept && depth[order[nearer]] < asked) ++nearer;
        if (nearer < kept) by_T[order[nearer]] += by->T[i];
        else by_through += by->T[i] * f->T[i];
        by->T[i] = nearer < kept ? 0.0 : -by->T[i] * through * f->T[i];
    }
    return by_through;
}

/* The same of fragments. */
static double pull_fragments(const front *f, const moit_tile *tile, int p, const moit_adjoint *by,
                             double *by_T) {
    double through = moit_front_through(f->job, tile)[p], by_through = 0.0;
    for (int i = tile->offsets[p]; i < tile->offsets[p + 1]; ++i) {
        bool near = is_front(f->job, tile, i);
        by_T[i] = near ? by->T[i] : 0.0;
        if (!near) by_through += by->T[i] * f->T[i];
        by->T[i] = near ? 0.0 : -by->T[i] * through * f->T[i];
    }
    return by_through;
}

/* By the tail's state, of which nothing goes to the nearest. */
static void pull_tail(const front *f, const moit_tile *tile, int p, const moit_adjoint *by) {
    int first = tile->offsets[p], kept = kept_of(f->job, tile, p);
    double *by_z = by->work[1], *by_a = by->work[2], by_bias = 0.0, before[2][MOIT_MOST_LAYERS];
    const int32_t *order = tile->order + first;
    moit_moment_state s = moit_any_state(f->own);
    moit_move_state(tile, p, &s);
    if (!(s.b0 > 0.0)) return;
    moit_tail_bias bias = moit_front_bias(f->job, p, tile);
    s.a = f->a + first;
    s.surfaces -= kept;
    s.bias = bias.bias;
    s.safe = moit_family_of(f->own->technique)->constants(f->own->technique)->safe;
    s.biased = tile->double_b + p * 2 * s.nodes;
    s.by_bias = &by_bias;
    for (int k = 0; k < kept; ++k) {
        before[0][k] = by_z[order[k]];
        before[1][k] = by_a[order[k]];
    }
    if (f->own->technique->kind == MOIT_BOUNDED_NEURAL)
        moit_bounded_pull_pixel(f->own, tile, &s, p, by);
    else {
        moit_readings at =
            moit_readings_of(f->own, tile, by, p, f->own->technique->moments.exclude_self);
        moit_pull_state(&s, -tile->total[p] * by->total[p], &at, tile->points[0] + first,
                        tile->points[1] + first, by_z + first, by_a + first);
    }
    for (int i = first; i < tile->offsets[p + 1]; ++i) by_a[i] += by_bias * bias.by_rest;
    for (int k = 0; k < kept; ++k) {
        by_z[order[k]] = before[0][k];
        by_a[order[k]] = before[1][k];
    }
    for (int i = first; i < tile->offsets[p + 1]; ++i) by_a[i] += by_bias * bias.by_all;
}

/* A curve has not left what reads it at fragments. What keys of 32 bits hold moves as if they held
 * all digits: fragments are what their keys say, by z and alpha, and z hangs on depth. */
void moit_front_pull_back(const moit_job *job, moit_tile *tile, const moit_adjoint *by) {
    moit_technique tail = moit_front_tail(job->technique);
    moit_job own = *job;
    own.technique = &tail;
    own.bias = tail.moments.bias;
    own.warp = moit_warp_over(&tail, job->fragments->near, job->fragments->far);
    front f = {.job = job, .own = &own, .T = moit_front_tails(tile), .a = by->work[0]};
    double *by_T = tile->points[0]; /* until pull_tail works with it */
    const double *alpha = tile->alpha, *through = moit_front_through(job, tile);
    moit_adjoint_begin(job, tile, by);
    for (int i = 0; i < tile->fragments; ++i)
        f.a[i] = is_front(job, tile, i) ? 0.0 : ((const double *)tile->absorbance)[i];
    for (int p = 0; p < tile->pixels; ++p) {
        int first = tile->offsets[p];
        double by_through = (job->depths ? pull_curve : pull_fragments)(&f, tile, p, by, by_T);
        if (through[p] > 0.0) by_through += by->total[p] * (tile->total[p] / through[p]);
        moit_adjoint_of_products(kept_of(job, tile, p), tile->order + first, alpha, by_T,
                                 by_through, by->alpha, tile->points[1]);
        pull_tail(&f, tile, p, by);
    }
    moit_adjoint_of_absorbance(&own, tile, by);
    if (job->technique->front.small_keys) {
        tile->depth = by->depth_given;
        moit_adjoint_of_warp(job, tile, by);
    } else {
        moit_adjoint_of_warp(&own, tile, by);
    }
}
