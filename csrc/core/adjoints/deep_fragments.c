/* Backwards through deep fragments, kernels/deep_fragments.h: the two nearest, and what the network
 * and the sums make of the others. Sums and the farthest depth move as if half floats held them as
 * they are; which are the nearest stays. */
#include "core/elementary.h"
#include "core/adjoints/networks.h"
#include "core/techniques/table.h"

#include <math.h>

enum { FEATURES = 5 };

/* What fragments of a pixel share, and derivatives by it. */
typedef struct {
    double second_z, last_z, b0, near, tail, through, covered, share,
        passed; /* by the tail alone */
} shared;

typedef struct {
    int n, first, second; /* places of the two nearest */
    const double *alpha, *a, *z, *T;
    double *by_T, *by_alpha, *by_a, *by_z;
    shared of, by;
} pixel;

/* How much a fragment of alpha absorbs by its alpha, and how fast that grows. */
static void thickness(double alpha, double a, double slope, double *ratio, double *rise) {
    bool thin = alpha < 1e-4;
    *ratio = thin ? 1.0 + alpha * (0.5 + alpha / 3.0) : a / alpha;
    *rise = thin ? 0.5 + alpha * (2.0 / 3.0 + 0.75 * alpha) : (slope - *ratio) / alpha;
}

static bool is_near(const pixel *p, int i) { return i == p->first || i == p->second; }

/* Where z lies between the second and the last. */
static double between(const pixel *p, double z) {
    double extent = p->of.last_z - p->of.second_z;
    return extent > 0.0 ? fmin(fmax((z - p->of.second_z) / extent, 0.0), 1.0) : 0.0;
}

/* By the even transmittance at fragment i. */
static void pull_even(pixel *p, int i, double by_even) {
    double v = between(p, p->z[i]), even = moit_exp(-p->of.b0 * v);
    double extent = p->of.last_z - p->of.second_z;
    p->by.b0 -= by_even * even * v;
    if (!(v > 0.0 && p->z[i] <= p->of.last_z)) return;
    double by_share = -by_even * even * p->of.b0 / extent;
    p->by_z[i] += by_share;
    p->by.second_z -= by_share * (1.0 - v);
    p->by.last_z -= by_share * v;
}

/* By T of fragment i of the tail: what it counts by its alpha, by what it absorbs for that. */
static void pull_tail_T(const moit_job *job, pixel *p, int i) {
    const shared *of = &p->of;
    double alpha = p->alpha[i], by_T = p->by_T[i], ratio, rise;
    if (alpha < 0x1p-24 && p->T[i] >= 1.0) return;
    thickness(alpha, p->a[i], moit_absorbance_slope(job->technique, job->max_alpha, alpha), &ratio,
              &rise);
    double even = moit_exp(-of->b0 * between(p, p->z[i])), first = 0.0;
    if (of->near > 0.0) first = even / of->near;
    double mixed = of->share * first + (1.0 - of->share) / of->tail;
    p->by_alpha[i] += by_T * of->covered * mixed * rise;
    double by = by_T * ratio;
    p->by.covered += by * mixed;
    by *= of->covered;
    p->by.share += by * (first - 1.0 / of->tail);
    p->by.tail -= by * (1.0 - of->share) / (of->tail * of->tail);
    if (!(of->near > 0.0)) return;
    p->by.near -= by * of->share * first / of->near;
    pull_even(p, i, by * of->share / of->near);
}

/* By the share: to the sums and the depths that the network sees. */
static void pull_share(const moit_job *job, pixel *p, double *by_w) {
    const shared *of = &p->of;
    moit_network_shape network = {job->technique->neural.network, FEATURES, 32, 16};
    double seen[FEATURES] = {of->tail, fmin(of->near / of->tail, 1.0), of->passed,
                             of->second_z - p->z[p->first], fmax(of->last_z - of->second_z, 0.0)};
    double by[FEATURES] = {0.0};
    moit_network_activity a = moit_ask_network(&network, seen);
    moit_pull_network(&network, seen, &a, p->by.share, by, by_w);
    p->by.tail += by[0] - by[2] * of->passed;
    if (of->near < of->tail) {
        p->by.near += by[1] / of->tail;
        p->by.tail -= by[1] * seen[1] / of->tail;
    }
    p->by.second_z += by[3];
    p->by_z[p->first] -= by[3];
    if (of->last_z > of->second_z) {
        p->by.last_z += by[4];
        p->by.second_z -= by[4];
    }
}

/* Finds out what fragments share but for the share itself. */
static void begin_pixel(pixel *p, const double *ray, const int32_t *rank) {
    p->first = p->second = -1;
    for (int i = 0; i < p->n; ++i) {
        if (rank[i] == 0) p->first = i;
        if (rank[i] == 1) p->second = i;
    }
    p->by = (shared){0};
    p->of = (shared){.last_z = ray[MOIT_DEEP_LAST_Z],
                     .b0 = ray[MOIT_DEEP_B0],
                     .near = ray[MOIT_DEEP_NEAR],
                     .tail = ray[MOIT_DEEP_TAIL],
                     .share = ray[MOIT_DEEP_SHARE],
                     .covered = ray[MOIT_DEEP_COVERED]};
    p->of.second_z = p->z[p->second < 0 ? p->first : p->second];
    p->of.through = 1.0 - p->alpha[p->first];
    if (p->second >= 0) p->of.through *= 1.0 - p->alpha[p->second];
    p->of.passed = moit_exp(-p->of.tail);
}

static void pull_tail(const moit_job *job, pixel *p, double *by_w) {
    const shared *of = &p->of;
    for (int i = 0; i < p->n; ++i)
        if (!is_near(p, i)) pull_tail_T(job, p, i);
    if (of->near > 0.0) pull_share(job, p, by_w);
    for (int i = 0; i < p->n && of->near > 0.0; ++i) {
        if (is_near(p, i)) continue;
        p->by_a[i] += p->by.near * moit_exp(-of->b0 * between(p, p->z[i]));
        pull_even(p, i, p->by.near * p->a[i]);
    }
    p->by.through += p->by.covered * -moit_expm1(-of->tail);
    p->by.tail += p->by.covered * of->through * of->passed;
}

static void pull_pixel(const moit_job *job, pixel *p, double by_total, double *by_w) {
    const shared *of = &p->of;
    int last = 0;
    if (of->tail > 0.0) pull_tail(job, p, by_w);
    for (int i = 0; i < p->n; ++i) {
        if (!(of->tail > 0.0) && !is_near(p, i)) p->by.through += p->by_T[i];
        if (p->z[i] > p->z[last]) last = i;
    }
    p->by.through += by_total * of->passed;
    if (of->tail > 0.0) {
        p->by.tail -= by_total * of->through * of->passed;
        p->by.b0 += p->by.tail;
        p->by_a[p->first] -= p->by.tail;
        p->by_a[p->second] -= p->by.tail;
    }
    for (int i = 0; i < p->n; ++i) p->by_a[i] += p->by.b0;
    p->by_z[last] += p->by.last_z;
    p->by_alpha[p->first] -= p->by.through * (p->second < 0 ? 1.0 : 1.0 - p->alpha[p->second]);
    if (p->second < 0) return;
    p->by_z[p->second] += p->by.second_z;
    p->by_alpha[p->second] -= p->by.through * (1.0 - p->alpha[p->first]);
    p->by_alpha[p->first] -= p->by_T[p->second];
}

void moit_deep_pull_back(const moit_job *job, moit_tile *tile, const moit_adjoint *by) {
    const double *rays = (const double *)(const void *)moit_deep_rays(job, tile);
    moit_adjoint_begin(job, tile, by);
    for (int p = 0; p < tile->pixels; ++p) {
        int first = tile->offsets[p];
        pixel one = {.n = tile->offsets[p + 1] - first,
                     .alpha = (const double *)tile->alpha + first,
                     .a = (const double *)tile->absorbance + first,
                     .z = (const double *)tile->z + first,
                     .T = (const double *)tile->T + first,
                     .by_T = by->T + first,
                     .by_alpha = by->alpha + first,
                     .by_a = by->work[2] + first,
                     .by_z = by->work[1] + first};
        if (one.n == 0) continue;
        begin_pixel(&one, rays + p * MOIT_DEEP_RAY, tile->rank + first);
        pull_pixel(job, &one, by->total[p], by->network);
    }
    moit_adjoint_of_absorbance(job, tile, by);
    moit_adjoint_of_warp(job, tile, by);
}
