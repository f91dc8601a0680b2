/* Backwards through techniques whose weights know no order. What they compute:
 * techniques/weighted.c and kernels/weights.h. Where a weight is bounded its derivative is that of
 * the bound, 0. */
#include "core/elementary.h"
#include "core/techniques/table.h"

#include <float.h>
#include <math.h>

void moit_weighted_sum_pull_back(const moit_job *job, moit_tile *tile, const moit_adjoint *by) {
    bool exact = job->technique->normalize;
    for (int p = 0; p < tile->pixels; ++p) {
        int first = tile->offsets[p], n = tile->offsets[p + 1] - first;
        const double *alpha = (const double *)tile->alpha + first;
        double by_share = 0.0, *by_alpha = by->alpha + first;
        for (int i = 0; i < n; ++i) by_share += by->T[first + i];
        if (exact) {
            moit_adjoint_of_share(n, NULL, alpha, by_share, by_alpha, by->work[0]);
            moit_adjoint_of_products(n, NULL, alpha, NULL, by->total[p], by_alpha, by->work[0]);
        }
        for (int i = 0; !exact && i < n; ++i) by_alpha[i] -= by->total[p];
    }
}

double moit_averaged_slope(double sum, int n) {
    if (sum < 0x1p-60) return 1.0;
    double mean = sum / n;
    return mean < 1.0 ? moit_exp((n - 1) * moit_log1p(-mean)) : n == 1 ? 1.0 : 0.0;
}

/* The share is the series of c[k] sum^(k - 1) with c[k] = -(-1 / n)^k choose(n, k), k = 1 .. n. */
double moit_averaged_share_slope(double sum, int n) {
    if (sum > 0.5)
        return (moit_averaged_slope(sum, n) - moit_averaged_coverage(sum, n) / sum) / sum;
    double slope = 0.0, term = -(n - 1.0) / (2.0 * n); /* c[k] sum^(k - 2) */
    for (int k = 2; k <= n && fabs(term) * k > 0x1p-60 * fabs(slope); ++k) {
        slope += (k - 1) * term;
        term *= -sum * (n - k) / ((k + 1.0) * n);
    }
    return slope;
}

void moit_weighted_average_pull_back(const moit_job *job, moit_tile *tile, const moit_adjoint *by) {
    (void)job;
    for (int p = 0; p < tile->pixels; ++p) {
        int first = tile->offsets[p], end = tile->offsets[p + 1];
        double sum = 0.0, by_share = 0.0, by_sum = 0.0;
        for (int i = first; i < end; ++i) {
            sum += ((const double *)tile->alpha)[i];
            by_share += by->T[i];
        }
        if (sum > 0.0) by_sum = by_share * moit_averaged_share_slope(sum, end - first);
        by_sum -= by->total[p] * moit_averaged_slope(sum, end - first);
        for (int i = first; i < end; ++i) by->alpha[i] += by_sum;
    }
}

const char *moit_weighted_blended_refusal(const moit_technique *technique) {
    if (technique->weighted.weight == MOIT_WEIGHT_GIVEN)
        return "nobody knows those of a weight that is a function; name one of the weights";
    return NULL;
}

/* A number within bounds and, beyond them, a slope of 0. */
typedef struct {
    double value, slope;
} bounded;

static bounded within_bounds(double x, double slope, double least, double most) {
    if (x < least) return (bounded){least, 0.0};
    if (x > most) return (bounded){most, 0.0};
    return (bounded){x, slope};
}

/* How the weight of a fragment changes. */
typedef struct {
    double by_z, by_d, by_alpha, by_bright;
} slopes;

static double square(double x) { return x * x; }
static double cube(double x) { return x * x * x; }

static slopes slopes_of(moit_weight kind, double z, double d, double alpha, double bright) {
    slopes s = {0};
    if (kind == MOIT_WEIGHT_BLOG || kind == MOIT_WEIGHT_EQ9) {
        double far = square(square(z / 200.0)), under = 1e-5 + far;
        bounded fall =
            within_bounds(0.03 / under, -0.03 / (under * under) * 4.0 * far / z, 1e-2, 3e3);
        bool lit = kind == MOIT_WEIGHT_BLOG && fmin(1.0, bright) > alpha;
        s.by_z = (lit ? fmin(1.0, bright) : alpha) * fall.slope;
        s.by_alpha = lit ? 0.0 : fall.value;
        s.by_bright = lit && bright < 1.0 ? fall.value : 0.0;
    }
    if (kind == MOIT_WEIGHT_EQ7 || kind == MOIT_WEIGHT_EQ8) {
        double far = square(cube(z / 200.0)),
               near = kind == MOIT_WEIGHT_EQ7 ? z * z / 25.0 : cube(z / 10.0);
        double under = 1e-5 + near + far;
        double rise = ((kind == MOIT_WEIGHT_EQ7 ? 2.0 : 3.0) * near + 6.0 * far) / z;
        bounded fall = within_bounds(10.0 / under, -10.0 / (under * under) * rise, 1e-2, 3e3);
        s.by_z = alpha * fall.slope;
        s.by_alpha = fall.value;
    }
    if (kind == MOIT_WEIGHT_EQ10) {
        double front = 1.0 - d;
        bounded fall = within_bounds(3e3 * cube(front), -9e3 * front * front, 1e-2, HUGE_VAL);
        s.by_d = alpha * fall.slope;
        s.by_alpha = fall.value;
    }
    if (kind == MOIT_WEIGHT_PHENOMENOLOGICAL) {
        bounded thick = within_bounds(10.0 * alpha, 10.0, 0.0, 1.0);
        double opaque = thick.value + 0.01, front = 1.0 - 0.9 * d;
        double w = cube(opaque) * 1e8 * cube(front);
        if (w >= 1e-2 && w <= 3e3) {
            s.by_alpha = 3.0 * w / opaque * thick.slope;
            s.by_d = front > 0.0 ? 3.0 * w / front * -0.9 : 0.0;
        }
    }
    return s;
}

static void pull_weight(const moit_job *job, const moit_tile *tile, int i, double by_weight,
                        const moit_adjoint *by) {
    const moit_weighted_options *how = &job->technique->weighted;
    double near = job->fragments->near, far = job->fragments->far;
    double depth = ((const double *)tile->depth)[i], emission = ((const double *)tile->emission)[i];
    double scale = near < far ? far / (far - near) : 0.0;
    bounded d =
        within_bounds(scale * (depth - near) / depth, scale * (near / depth) / depth, 0.0, 1.0);
    const double *color = tile->color ? (const double *)tile->color + 3 * i : NULL;
    int most = 0;
    for (int c = 1; color && c < 3; ++c) most = color[c] > color[most] ? c : most;
    slopes s = slopes_of(how->weight, depth * how->depth_scale, d.value,
                         ((const double *)tile->alpha)[i], color ? color[most] * emission : 0.0);
    by->alpha[i] += by_weight * s.by_alpha;
    by->depth[i] += by_weight * (s.by_z * how->depth_scale + s.by_d * d.slope);
    if (!color) return;
    by->color[3 * i + most] += by_weight * s.by_bright * emission;
    by->emission[i] += by_weight * s.by_bright * color[most];
}

/* Of T = share weight of pixel p's fragments, as share_of of techniques/weighted.c has the share. */
static void pull_shares(const moit_job *job, const moit_tile *tile, int p, const moit_adjoint *by) {
    const double *weight = tile->z, *alpha = tile->alpha; /* as `weigh` leaves them */
    int first = tile->offsets[p], end = tile->offsets[p + 1];
    double covered = 1.0 - tile->total[p], sum = 0.0, by_share = 0.0;
    double *through = by->work[0], T = 1.0;
    if (!(covered > 0.0)) return; /* what covers nothing has T 1 */
    for (int i = first; i < end; ++i) {
        sum += alpha[i] * weight[i];
        by_share += weight[i] * by->T[i];
        through[i] = T;
        T *= 1.0 - alpha[i];
    }
    bool stays = !(sum > 0.0) || covered / sum > DBL_MAX;
    double share = stays ? 1.0 : covered / sum, behind = 1.0;
    for (int i = end; i-- > first;) {
        double by_weight = share * by->T[i];
        if (!stays) {
            /* before it is divided: each by itself may be infinite where the other is */
            by->alpha[i] += by_share * ((through[i] * behind - share * weight[i]) / sum);
            by_weight -= by_share * share * (alpha[i] / sum);
        }
        pull_weight(job, tile, i, by_weight, by);
        behind *= 1.0 - alpha[i];
    }
}

void moit_weighted_blended_pull_back(const moit_job *job, moit_tile *tile, const moit_adjoint *by) {
    for (int p = 0; p < tile->pixels; ++p) pull_shares(job, tile, p, by);
    moit_adjoint_of_totals(tile, by, by->total);
}
