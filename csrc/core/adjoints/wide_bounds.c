/* Backwards through bounds of moments where these are not those that moments by themselves have:
 * a node that lies beyond [-2, 2] is kept within (kernels/power_bounds.h), and a surface may be
 * said to absorb more than may lie at its place.
 *
 * The bound is the mean of a polynomial then whose other nodes are not the best ones, so it hangs
 * on them, too. How a node y of the distribution through z moves with moments says a polynomial
 * that is 0 at all nodes, with a slope at y alone: l_y l_z / l_z'(y) over the weight at y, l the
 * Lagrange polynomials. That is one of powers of depth here, as the bound itself. */
#include "core/adjoints/wide_bounds.h"

#include <math.h>

enum { MOST_NODES = 4, SIZE = 2 * MOST_NODES + 1 };

/* Coefficients of 1, x, x^2 .. */
typedef struct {
    double factor[SIZE];
} polynomial;

static polynomial constant(double x) { return (polynomial){{x}}; }

static polynomial times_distance(polynomial p, double from) {
    for (int k = SIZE - 1; k >= 0; --k)
        p.factor[k] = (k > 0 ? p.factor[k - 1] : 0.0) - from * p.factor[k];
    return p;
}

static polynomial product(const polynomial *p, const polynomial *q) {
    polynomial of = {{0.0}};
    for (int i = 0; i < SIZE; ++i)
        for (int k = 0; i + k < SIZE; ++k) of.factor[i + k] += p->factor[i] * q->factor[k];
    return of;
}

static void add(polynomial *to, double times, const polynomial *p) {
    for (int k = 0; k < SIZE; ++k) to->factor[k] += times * p->factor[k];
}

static polynomial slope_of(const polynomial *p) {
    polynomial of = {{0.0}};
    for (int k = 1; k < SIZE; ++k) of.factor[k - 1] = k * p->factor[k];
    return of;
}

static double value_at(const polynomial *p, double x) {
    double sum = 0.0;
    for (int k = SIZE; k-- > 0;) sum = sum * x + p->factor[k];
    return sum;
}

static double mean_of(const polynomial *p, int nodes, const double *b) {
    double sum = p->factor[0];
    for (int k = 1; k <= 2 * nodes; ++k) sum += p->factor[k] * b[k - 1];
    return sum;
}

/* The kernel of the rule at y: 1 / its value there is the weight of a node at y, and the product of
 * both the node's Lagrange polynomial. */
static polynomial kernel_at(int nodes, const double *rule, double y) {
    polynomial sum = {{0.0}};
    for (int k = 0; k <= nodes; ++k) {
        polynomial u = constant(1.0);
        for (int i = 0; i < nodes; ++i)
            if (i != k - 1) u = times_distance(u, rule[i]);
        double norm = (k > 0 ? rule[nodes + k - 1] : 1.0) / rule[2 * nodes];
        add(&sum, norm * value_at(&u, y), &u);
    }
    return sum;
}

double moit_weight_at(int nodes, const double *rule, double z) {
    polynomial kernel = kernel_at(nodes, rule, z);
    return 1.0 / value_at(&kernel, z);
}

/* The polynomial that is 0 at z and has these values at the nodes, and no slope there. */
static polynomial touching(int nodes, const double *y, const double *value, double z) {
    double t[SIZE] = {z}, c[SIZE] = {0.0};
    for (int i = 0; i < nodes; ++i) {
        t[2 * i + 1] = t[2 * i + 2] = y[i];
        c[2 * i + 1] = c[2 * i + 2] = value[i];
    }
    for (int order = 1; order <= 2 * nodes; ++order)
        for (int i = 2 * nodes; i >= order; --i)
            c[i] = order == 1 && i % 2 == 0 ? 0.0 : (c[i] - c[i - 1]) / (t[i] - t[i - order]);
    polynomial p = {{0.0}};
    for (int i = 2 * nodes; i >= 0; --i) {
        p = times_distance(p, t[i]);
        p.factor[0] += c[i];
    }
    return p;
}

/* The product of squared distances from all nodes but y[without]. */
static polynomial squares(int nodes, const double *y, int without) {
    polynomial p = constant(1.0);
    for (int i = 0; i < nodes; ++i)
        if (i != without) p = times_distance(times_distance(p, y[i]), y[i]);
    return p;
}

double moit_touching_mean(const moit_touched *given, const double *value, moit_mean_slopes *by) {
    int nodes = given->nodes;
    const double *y = given->y;
    double z = given->z;
    *by = (moit_mean_slopes){0};
    polynomial p = touching(nodes, y, value, z), all = squares(nodes, y, -1);
    double mean = mean_of(&p, nodes, given->b);
    if (!(mean > 0.0)) return 0.0;
    if (mean >= 1.0) return 1.0;
    polynomial slope = slope_of(&p), bend = slope_of(&slope), sum = p;
    by->z = -value_at(&slope, z) * mean_of(&all, nodes, given->b) / value_at(&all, z);
    polynomial at_z = kernel_at(nodes, given->rule, z);
    for (int i = 0; i < nodes; ++i) {
        if (!(fabs(y[i]) < MOIT_FARTHEST_NODE)) continue;
        polynomial others = squares(nodes, y, i);
        polynomial moved = times_distance(times_distance(others, y[i]), z);
        double by_node = -value_at(&bend, y[i]) * mean_of(&moved, nodes, given->b)
                         / ((y[i] - z) * value_at(&others, y[i]));
        polynomial at_node = kernel_at(nodes, given->rule, y[i]), both = product(&at_node, &at_z);
        polynomial turn = slope_of(&at_z), own_turn = slope_of(&at_node);
        double times = by_node / value_at(&turn, y[i]);
        add(&sum, times * given->keeps, &both);
        by->z -= times * value_at(&own_turn, z);
    }
    for (int k = 0; k < 2 * nodes; ++k) by->b[k] = sum.factor[k + 1];
    return mean;
}
