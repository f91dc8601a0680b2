/* From polynomials as adjoints keep them, in products of distances from a rule's nodes, to
 * derivatives by the moments themselves. */
#include "core/elementary.h"
#include "core/adjoints/moments.h"

#include <math.h>

enum { MOST_NODES = 4 };

/* Coefficients of x .. x^(2 nodes) of u' S u, u the products of all x - g and of all but one: of
 * the last product as of the others. */
static void coefficients(int nodes, const double *rule, const double *S, double *by_b) {
    double u[MOST_NODES + 1][MOST_NODES + 1] = {{0.0}};
    for (int k = 0; k <= nodes; ++k) {
        u[k][0] = 1.0;
        for (int i = 0, degree = 0; i < nodes; ++i) {
            if (i == k - 1) continue;
            ++degree;
            for (int m = degree; m >= 0; --m)
                u[k][m] = (m > 0 ? u[k][m - 1] : 0.0) - rule[i] * u[k][m];
        }
    }
    for (int k = 0, t = 0; k <= nodes; ++k)
        for (int m = k; m <= nodes; ++m, ++t)
            for (int i = 0; i <= nodes; ++i)
                for (int j = 0; j <= nodes; ++j)
                    if (i + j > 0)
                        by_b[i + j - 1] += (m == k ? 1.0 : 2.0) * S[t] * u[k][i] * u[m][j];
}

double moit_moments_constant(int nodes, const double *rule, const double *S) {
    double sum = 0.0, at_zero[MOST_NODES + 1];
    for (int k = 0; k <= nodes; ++k) {
        at_zero[k] = 1.0;
        for (int i = 0; i < nodes; ++i)
            if (i != k - 1) at_zero[k] *= -rule[i];
    }
    for (int k = 0, t = 0; k <= nodes; ++k)
        for (int m = k; m <= nodes; ++m, ++t)
            sum += (m == k ? 1.0 : 2.0) * S[t] * at_zero[k] * at_zero[m];
    return sum;
}

/* The same of the trigonometric polynomial, by real and imaginary parts: from its values at 2 nodes
 * + 1 points all around the circle, but for the middle of the zone. */
static void harmonics(const moit_moment_adjoints *adjoints, const moit_wrapping_zone *zone,
                      int nodes, const double *rule, const double *S, double *by_b) {
    const double pi = 3.141592653589793238;
    int points = 2 * nodes + 1;
    enum { POINTS = 2 * MOST_NODES + 1 + MOIT_PADDING };
    double z[POINTS] = {0.0}, angle[POINTS], value[POINTS], slope[POINTS];
    for (int j = 0; j < points; ++j) {
        double from_middle = pi * ((2.0 * j + 1.0) / points - 1.0);
        z[j] = from_middle / (4.0 * pi * zone->turns);
        angle[j] = from_middle + 4.0 * pi * zone->turns; /* that of z = -1 is 0 */
    }
    adjoints->read_polynomial(nodes, zone, points, rule, S, z, value, slope);
    for (int k = 1; k <= nodes; ++k)
        for (int j = 0; j < points; ++j) {
            by_b[2 * k - 2] += 2.0 / points * value[j] * moit_cos(k * angle[j]);
            by_b[2 * k - 1] += 2.0 / points * value[j] * moit_sin(k * angle[j]);
        }
}

void moit_moments_of_terms(const moit_moment_adjoints *adjoints, int family,
                           const moit_wrapping_zone *zone, int nodes, const double *rule,
                           const double *S, double *by_b) {
    if (family == MOIT_TRIGONOMETRIC) harmonics(adjoints, zone, nodes, rule, S, by_b);
    else coefficients(nodes, rule, S, by_b);
}
