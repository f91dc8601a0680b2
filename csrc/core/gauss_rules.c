/* Stieltjes' procedure gives the recurrence of the polynomials that are orthogonal for a measure,
 * and Golub and Welsch (Calculation of Gauss Quadrature Rules, 1969) the rule: its points are the
 * eigenvalues of that recurrence's matrix, and its weights the squares of what the eigenvectors
 * begin with. */
#include "core/gauss_rules.h"
#include "core/elementary.h"

#include <assert.h>
#include <float.h>
#include <math.h>

void moit_legendre_rule(int count, double *point, double *weight) {
    for (int k = 0; k < (count + 1) / 2; ++k) {
        double x = moit_cos(3.14159265358979324 * (k + 0.75) / (count + 0.5)), slope = 1.0;
        for (int step = 0; step < 4; ++step) {
            double before = 0.0, here = 1.0;
            for (int n = 0; n < count; ++n) {
                double next = ((2 * n + 1) * x * here - n * before) / (n + 1);
                before = here;
                here = next;
            }
            slope = count * (before - x * here) / (1.0 - x * x);
            x -= here / slope;
        }
        if (2 * k + 1 == count) x = 0.0;
        point[k] = -x;
        point[count - 1 - k] = x;
        weight[k] = weight[count - 1 - k] = 2.0 / ((1.0 - x * x) * slope * slope);
    }
}

/* Of the recurrence x p_k = root[k] p_{k-1} + middle[k] p_k + root[k+1] p_{k+1} the coefficients;
 * returns for how many k there are any. */
static int recurrence_of(int points, const double *at, const double *mass, int count,
                         double *middle, double *root) {
    double before[MOIT_MOST_MEASURE_POINTS] = {0.0}, here[MOIT_MOST_MEASURE_POINTS], total = 0.0;
    for (int j = 0; j < points; ++j) total += mass[j];
    if (!(total > 0.0 && isfinite(total))) return 0;
    for (int j = 0; j < points; ++j) here[j] = 1.0;
    root[0] = 0.0;
    for (int k = 0;; ++k) {
        double mean = 0.0, next = 0.0;
        for (int j = 0; j < points; ++j) mean += mass[j] / total * here[j] * here[j] * at[j];
        middle[k] = mean;
        if (k + 1 == count) return count;
        for (int j = 0; j < points; ++j) {
            double value = (at[j] - mean) * here[j] - root[k] * before[j];
            before[j] = here[j];
            here[j] = value;
            next += mass[j] / total * value * value;
        }
        root[k + 1] = sqrt(next);
        if (!(root[k + 1] > 64.0 * DBL_EPSILON)) return k + 1;
        for (int j = 0; j < points; ++j) here[j] /= root[k + 1];
    }
}

/* The root of a^2 + b^2, where these may leave what doubles hold. */
static double length_of(double a, double b) {
    double most = fmax(fabs(a), fabs(b)), least = fmin(fabs(a), fabs(b));
    if (most == 0.0) return 0.0;
    return most * sqrt(1.0 + (least / most) * (least / most));
}

/* The eigenvalues of the symmetric matrix with `middle` on its diagonal and root[1..] beside it,
 * in `middle`, and in `first` what their vectors begin with: QL with implicit shifts. */
static void diagonalise(int count, double *middle, double *root, double *first) {
    for (int k = 0; k < count; ++k) first[k] = k == 0;
    for (int k = 0; k + 1 < count; ++k) root[k] = root[k + 1];
    root[count - 1] = 0.0;
    for (int l = 0; l < count; ++l) {
        for (int turn = 0; turn < 60; ++turn) {
            int m = l;
            while (m + 1 < count
                   && fabs(root[m]) > DBL_EPSILON * (fabs(middle[m]) + fabs(middle[m + 1])))
                ++m;
            if (m == l) break;
            double g = (middle[l + 1] - middle[l]) / (2.0 * root[l]), r = length_of(g, 1.0);
            double s = 1.0, c = 1.0, p = 0.0;
            g = middle[m] - middle[l] + root[l] / (g + copysign(r, g));
            int i = m - 1;
            for (; i >= l; --i) {
                double f = s * root[i], b = c * root[i];
                root[i + 1] = r = length_of(f, g);
                if (r == 0.0) {
                    middle[i + 1] -= p;
                    root[m] = 0.0;
                    break;
                }
                s = f / r;
                c = g / r;
                g = middle[i + 1] - p;
                r = (middle[i] - g) * s + 2.0 * c * b;
                p = s * r;
                middle[i + 1] = g + p;
                g = c * r - b;
                double moved = first[i + 1];
                first[i + 1] = s * first[i] + c * moved;
                first[i] = c * first[i] - s * moved;
            }
            if (r == 0.0 && i >= l) continue;
            middle[l] -= p;
            root[l] = g;
            root[m] = 0.0;
        }
    }
}

int moit_gauss_rule(int points, const double *at, const double *mass, int count, double *point,
                    double *weight) {
    assert(points <= MOIT_MOST_MEASURE_POINTS && count <= MOIT_MOST_RULE_POINTS);
    double root[MOIT_MOST_RULE_POINTS + 1], first[MOIT_MOST_RULE_POINTS], total = 0.0;
    count = recurrence_of(points, at, mass, count, point, root);
    if (count == 0) return 0;
    diagonalise(count, point, root, first);
    for (int k = 0; k < count; ++k) total += first[k] * first[k];
    for (int k = 0; k < count; ++k) {
        double x = point[k], own = first[k] * first[k] / total;
        int to = k;
        for (; to > 0 && point[to - 1] > x; --to) {
            point[to] = point[to - 1];
            weight[to] = weight[to - 1];
        }
        point[to] = x;
        weight[to] = own;
    }
    return count;
}
