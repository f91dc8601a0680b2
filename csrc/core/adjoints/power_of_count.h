/* Backwards through power moments of NODES nodes.
 *
 * The share of absorbance in front of z is the optimum of a linear program, so its derivatives by
 * moments are the coefficients of the polynomial that is optimal for its dual: of degree 2 NODES, 1
 * at the nodes in front of z and 0 at the others, touching both from one side but at z (envelope
 * theorem). No root is differentiated. dual_of_count.h has it in Lagrange polynomials l of the
 * nodes, with l_z^2 for the weight at z. Polynomials are kept as u(x)' S u(x), where u are the
 * product p of all distances from the Gauss rule's nodes and the products of all but one: these
 * are orthogonal, so l_x = w_x (u(x) / norms) . u has no more digits to lose than the rule, where
 * powers of depth would lose all on thin rays. Where the kernel counts what is behind, so does
 * this.
 *
 * One side is meant where z crosses a node of the rule or an atom of the ray: that of the kernel's
 * own comparisons. */
#include "kernels/power_moments.h"

#include "kernels/power_bounds.h"

/* Other nodes of the distribution through z than z, on the side that is counted. */
STRUCT(NAMED(counted)) {
    real from[2][NODES]; /* their distances from the rule's nodes */
    truth there[2];
    real sign[2];     /* 1: they are in front, -1: behind */
    truth complement; /* what is in front is all but z and these */
};

FN NAMED(counted) NAMED(counted_nodes)(NAMED(rule) r, const NAMED(place) *o) {
    NAMED(counted) c;
    const real *from = o->from;
    (void)r; /* of one node there are no others */
    for (int j = 0; j < 2; ++j) {
        c.there[j] = K(0.0) > 1.0;
        c.sign[j] = K(1.0);
        for (int i = 0; i < NODES; ++i) c.from[j][i] = K(1.0);
    }
    c.complement = from[NODES - 1] > 0.0;
#if NODES == 2
    real gap = (r.g[1] - r.g[0]) + (r.g_low[1] - r.g_low[0]);
    real s = NAMED(positive_root)(o->p, o->q - o->p * gap, r.e[0] * o->first * gap);
    c.from[0][0] = -min(s, K(FARTHEST));
    c.from[0][1] = c.from[0][0] - gap;
    c.there[0] = BOTH(BOTH(from[0] > 0.0, from[1] <= 0.0), s < K(FARTHEST));
#elif NODES > 2
    truth mirrored = from[NODES / 2] > 0.0;
    real e[NODES], gap[NODES];
    for (int i = 0; i < NODES; ++i) {
        int k = NODES - 1 - i;
        e[i] = select(mirrored, r.e[k], r.e[i]);
        gap[i] = select(mirrored, (r.g[NODES - 1] - r.g[k]) + (r.g_low[NODES - 1] - r.g_low[k]),
                        (r.g[i] - r.g[0]) + (r.g_low[i] - r.g_low[0]));
    }
    real ahead = select(mirrored, -from[NODES - 1], from[0]);
    real level = select(mirrored, -o->q, o->q) - o->p * ahead;
    truth inside = BOTH(from[0] > 0.0, from[NODES - 1] <= 0.0);
    real s = NAMED(lowest_root)(o->p, level, e, gap, NODES, K(FARTHEST), inside);
    for (int i = 0; i < NODES; ++i)
        c.from[0][i] = select(mirrored, s + gap[NODES - 1 - i], -(s + gap[i]));
    c.there[0] = BOTH(inside, s < K(FARTHEST));
    c.sign[0] = select(mirrored, K(-1.0), K(1.0));
    c.complement |= BOTH(inside, mirrored);
#if NODES == 4
    real offset[NODES];
    for (int i = 0; i < NODES; ++i) offset[i] = (r.g[i] - r.g[0]) + (r.g_low[i] - r.g_low[0]);
    truth middle = BOTH(from[1] > 0.0, from[2] <= 0.0);
    real v = o->p * from[0] - o->q;
    NAMED(between) x = NAMED(middle_guess)(o->p, v, r.e, offset, 0, NODES);
    x = NAMED(middle_root)(x, o->p, v, r.e, offset, 0, NODES, middle);
    c.from[1][0] = x.from_low;
    for (int i = 1; i < NODES; ++i) c.from[1][i] = -(x.to_high + (offset[i] - offset[1]));
    c.there[1] = middle;
#endif
#endif
    return c;
}

FN NAMED(pulled) NAMED(pulled_at)(NAMED(rule) r, real b0, real z, real own, real beta, real by) {
    NAMED(pulled) result;
    NAMED(distances) away;
    for (int i = 0; i < NODES; ++i) {
        away.from[i] = (z - r.g[i]) - r.g_low[i];
        /* just in front of a node of the rule quotients have the values that they tend to */
        away.from[i] = select(real_abs(away.from[i]) < K(1e-40), K(-1e-40), away.from[i]);
    }
    NAMED(place) o = NAMED(place_among)(away, r.e, r.d);
    NAMED(counted) c = NAMED(counted_nodes)(r, &o);
    real inverse = 1.0 / r.d, weight[2], share = K(0.0);
    NAMED(lagrange) at_z = NAMED(lagrange_at)(away.from, r.e, inverse, o.at);
    for (int j = 0; j < 2; ++j) {
        weight[j] = select(c.there[j], NAMED(node_weight)(c.from[j], r.e, r.d), K(0.0));
        share = share + c.sign[j] * weight[j];
    }
    real in_front = clamp(select(c.complement, (1.0 - o.at) + share, share), K(0.0), 1.0 - o.at);
    NAMED(by_masses) m = NAMED(past_pulled)(in_front, o.at, b0, own, beta, by, &result);
    m.at = m.at - select(c.complement, m.share, K(0.0));
    result.z = m.at * (-2.0 * o.at * at_z.slope);
    NAMED(begin_with)(&result, &at_z, m.at);
    for (int j = 0; j < (NODES == 4 ? 2 : NODES > 1); ++j) {
        NAMED(node) x = {.weight = weight[j], .value = K(1.0), .half_rise = K(0.0)};
        x.there = c.there[j];
        for (int i = 0; i < NODES; ++i) x.from[i] = c.from[j][i];
        /* the difference of distances to a pole between the node and z */
        x.past = x.from[0] - away.from[0];
#if NODES > 2
        real mirrored = x.from[NODES - 1] - away.from[NODES - 1];
        x.past = select(c.sign[j] < 0.0, mirrored, x.past);
#endif
#if NODES == 4
        if (j == 1) x.past = x.from[1] - away.from[1];
#endif
        NAMED(add_node)(&result, &x, &at_z, o.at, r.e, inverse, c.sign[j] * m.share);
    }
    return result;
}

/* The rule of one pixel in all lanes. */
FN NAMED(rule) NAMED(rule_at)(const double *p) {
    NAMED(rule) r;
    for (int i = 0; i < NODES; ++i) {
        r.g[i] = K(p[i]);
        r.g_low[i] = K(0.0);
        r.e[i] = K(p[NODES + i]);
    }
    r.d = K(p[2 * NODES]);
    return r;
}

/* Of one pixel's n fragments: z, own (NULL: none) and `by`, by what is absorbed in front of each;
 * adds to by_z and by_own and gives what b0 changes by; S: of all. */
static double NAMED(sum_pulled)(int n, const double *rule, double b0, const double *z,
                                const double *own, double beta, const double *by, double *S,
                                double *by_z, double *by_own) {
    NAMED(rule) r = NAMED(rule_at)(rule);
    NAMED(sums) sums = {{{0.0}}};
    for (int i = 0; i < n; i += LANES) {
        truth there = among_first(n - i);
        real at = select(there, load(z + i), K(z[0]));
        NAMED(pulled) p =
            NAMED(pulled_at)(r, K(b0), at, own ? select(there, load(own + i), K(0.0)) : K(0.0),
                             K(beta), select(there, load(by + i), K(0.0)));
        NAMED(sum_up)(&sums, &p, i, there, by_z, own ? by_own : NULL);
    }
    return NAMED(give_sums)(&sums, S);
}

static void NAMED(find_nodes)(int n, const double *rule, const double *z, int stride, double *y,
                              double *ahead) {
    NAMED(rule) r = NAMED(rule_at)(rule);
    for (int i = 0; i < n; i += LANES) {
        NAMED(nodes) found = NAMED(nodes_through)(r, load_at_most(z + i, n - i));
        for (int k = 0; k < NODES; ++k) {
            store(y + k * stride + i, found.y[k]);
            store(ahead + k * stride + i, found.ahead[k]);
        }
    }
}

/* The polynomial of S and its slope at each z. */
static void NAMED(read_polynomial)(int n, const double *rule, const double *S, const double *z,
                                   double *value, double *slope) {
    NAMED(rule) r = NAMED(rule_at)(rule);
    for (int i = 0; i < n; i += LANES) {
        real at = load(z + i), from[NODES];
        for (int k = 0; k < NODES; ++k) from[k] = at - r.g[k];
        NAMED(reading) found = NAMED(reading_at)(S, from);
        store(value + i, found.value);
        store(slope + i, found.slope);
    }
}

/* Coefficients of x .. x^(2 NODES) of u' S u. */
FN void NAMED(coefficients_of)(const real *g, const real *S, real *out) {
    real u[NODES + 1][NODES + 1];
    for (int k = 0; k <= NODES; ++k) {
        for (int m = 0; m <= NODES; ++m) u[k][m] = K(m == 0 ? 1.0 : 0.0);
        for (int i = 0; i < NODES; ++i) {
            if (i == k - 1) continue;
            for (int m = NODES; m > 0; --m) u[k][m] = u[k][m - 1] - g[i] * u[k][m];
            u[k][0] = -(g[i] * u[k][0]);
        }
    }
    for (int i = 0; i < 2 * NODES; ++i) out[i] = K(0.0);
    for (int k = 0, t = 0; k <= NODES; ++k)
        for (int m = k; m <= NODES; ++m, ++t) {
            real by = m == k ? S[t] : 2.0 * S[t];
            for (int i = 0; i <= NODES; ++i) {
                if (k > 0 && i == NODES) continue; /* of lesser degree */
                real part = by * u[k][i];
                for (int j = 0; j <= NODES; ++j)
                    if (i + j > 0 && !(m > 0 && j == NODES))
                        out[i + j - 1] = out[i + j - 1] + part * u[m][j];
            }
        }
}

/* Of n rays with a place each, one to a lane: by_b0 and by_own are filled, by_b (n, 2 NODES). */
static void NAMED(pull_each)(int n, const double *rules, const double *b0, const double *z,
                             const double *own, double beta, const double *by, double *by_b0,
                             double *by_b, double *by_z, double *by_own) {
    enum { SIZE = 2 * NODES + 1 };
    for (int i = 0; i < n; i += LANES) {
        int left = n - i < LANES ? n - i : LANES;
        SCALAR column[SIZE][LANES];
        for (int lane = 0; lane < LANES; ++lane) {
            const double *rule = rules + (i + (lane < left ? lane : 0)) * SIZE;
            for (int k = 0; k < SIZE; ++k) column[k][lane] = rule[k];
        }
        NAMED(rule) r;
        for (int k = 0; k < NODES; ++k) {
            r.g[k] = load(column[k]);
            r.g_low[k] = K(0.0);
            r.e[k] = load(column[NODES + k]);
        }
        r.d = load(column[2 * NODES]);
        real total = load_at_most(b0 + i, left), given = load_at_most(by + i, left);
        NAMED(pulled) p = NAMED(pulled_at)(r, total, load_at_most(z + i, left),
                                           own ? load_at_most(own + i, left) : K(0.0), K(beta),
                                           select(total > 0.0, given, K(0.0)));
        real out[2 * NODES];
        NAMED(coefficients_of)(r.g, p.S, out);
        store_at_most(by_b0 + i, p.b0, left);
        store_at_most(by_z + i, p.z, left);
        store_at_most(by_own + i, p.own, left);
        for (int lane = 0; lane < left; ++lane)
            for (int k = 0; k < 2 * NODES; ++k) by_b[(i + lane) * 2 * NODES + k] = out[k][lane];
    }
}
