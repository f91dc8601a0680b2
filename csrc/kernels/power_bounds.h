// What power moments prove about the absorbance in front of a depth.
//
// Any polynomial p of degree 2n with p <= 1 in front of z and p <= 0 from z on proves that at least
// its mean lies in front of z; its mean needs only the moments. With nodes y_1 .. y_n, double
// contact with the step at each and single contact at z, p is such a polynomial wherever the nodes
// lie (Chebyshev, Markov, Stieltjes), and the best one where they are those of the distribution
// through z. So nodes come from biased moments, which keeps p tame, the mean from the moments as
// they are, and what rounding may have done to moments or to p's coefficients is subtracted: the
// bound needs no luck to hold.
//
// Needs more digits than float32 has; C compiles it in double only.

STRUCT(NAMED(certain)) {
    number at_least; // share of absorbance in front of z, z not included
    number at_most;  // z included
};

// All nodes but z of the distribution through z, in rising order, kept within [-2, 2]; whether each
// lies in front of z follows from its place among the g.
STRUCT(NAMED(nodes)) {
    number y[NODES];
    number ahead[NODES]; // 1 in front of z, 0 behind
};

FN NAMED(nodes) NAMED(nodes_through)(NAMED(rule) r, real z) {
    NAMED(place) o = NAMED(place_of)(r, z);
    real x[NODES + 1]; // one in each interval
    real gap[NODES];
    real turned[NODES];
    for (int i = 0; i < NODES; ++i) gap[i] = r.g[i] - r.g[0];
    x[0] =
        r.g[0]
        - NAMED(lowest_root)(o.p, o.q - o.p * o.from[0], r.e, gap, NODES, K(FARTHEST), EVERYWHERE);
    for (int i = 0; i < NODES; ++i) {
        gap[i] = r.g[NODES - 1] - r.g[NODES - 1 - i];
        turned[i] = r.e[NODES - 1 - i];
    }
    x[NODES] = r.g[NODES - 1]
               + NAMED(lowest_root)(o.p, o.p * o.from[NODES - 1] - o.q, turned, gap, NODES,
                                    K(FARTHEST), EVERYWHERE);
    for (int k = 1; k < NODES; ++k) {
        for (int i = 0; i < NODES; ++i) gap[i] = r.g[i] - r.g[k - 1];
        real v = o.p * o.from[k - 1] - o.q;
        PRECISE NAMED(between) found = NAMED(middle_guess)(o.p, v, r.e, gap, k - 1, NODES);
        found = NAMED(middle_root)(found, o.p, v, r.e, gap, k - 1, NODES, EVERYWHERE);
        x[k] = r.g[k - 1] + found.from_low;
    }
    PRECISE NAMED(nodes) n;
    for (int i = 0; i < NODES; ++i) {
        truth ahead = o.from[i] > 0.0;
        n.y[i] = clamp(select(ahead, x[i], x[i + 1]), K(-2.0), K(2.0));
        n.ahead[i] = select(ahead, K(1.0), K(0.0));
    }
    return n;
}

// A lower bound of the mean of the polynomial that has `at` at z, touches `n.ahead` at the n.y, and
// is meant for moments within `slack` of m. `slack` also stands for a count of roundings in double.
FN number NAMED(mean_at_least)(NAMED(moments) m, NAMED(nodes) n, real z, real at, real slack) {
    real t[2 * NODES + 1];
    real c[2 * NODES + 1];    // divided differences
    real size[2 * NODES + 1]; // the same from absolute values: what rounding may act on
    t[0] = z;
    c[0] = at;
    for (int i = 0; i < NODES; ++i) {
        t[2 * i + 1] = n.y[i];
        t[2 * i + 2] = n.y[i];
        c[2 * i + 1] = n.ahead[i];
        c[2 * i + 2] = n.ahead[i];
    }
    for (int i = 0; i <= 2 * NODES; ++i) size[i] = c[i];
    for (int order = 1; order <= 2 * NODES; ++order) {
        for (int i = 2 * NODES; i >= order; --i) {
            if (order == 1 && i % 2 == 0) { // the slope at a node of double contact
                c[i] = K(0.0);
                size[i] = K(0.0);
            } else {
                real inverse = 1.0 / (t[i] - t[i - order]);
                c[i] = (c[i] - c[i - 1]) * inverse;
                size[i] = (size[i] + size[i - 1]) * abs(inverse);
            }
        }
    }
    // powers of x from Newton's form, by Horner's rule
    real power[2 * NODES + 1];
    real weight[2 * NODES + 1];
    for (int k = 0; k <= 2 * NODES; ++k) {
        power[k] = K(0.0);
        weight[k] = K(0.0);
    }
    for (int i = 2 * NODES; i >= 0; --i) {
        for (int k = 2 * NODES; k >= 1; --k) {
            power[k] = power[k - 1] - t[i] * power[k];
            weight[k] = weight[k - 1] + abs(t[i]) * weight[k];
        }
        power[0] = c[i] - t[i] * power[0];
        weight[0] = size[i] + abs(t[i]) * weight[0];
    }
    real mean = power[0];
    real doubt = weight[0] * K(1e-14);
    for (int k = 1; k <= 2 * NODES; ++k) {
        mean = mean + power[k] * m.b[k - 1];
        doubt = doubt + abs(power[k]) * slack + weight[k] * K(1e-14);
    }
    real proven = mean - doubt;
    return select(proven > 0.0, min(proven, K(1.0)), K(0.0)); // 0 for NaN, too
}

// `rule` is that of biased moments, m are the moments as stored, z is known to within `blur`.
FN NAMED(certain)
    NAMED(certain_at)(NAMED(rule) rule, NAMED(moments) m, real z, real blur, real slack) {
    NAMED(nodes) n = NAMED(nodes_through)(rule, z);
    PRECISE NAMED(nodes) opposite = n;
    truth apart_low = EVERYWHERE;
    truth apart_high = apart_low;
    for (int i = 0; i < NODES; ++i) {
        truth ahead = n.ahead[i] > 0.5;
        apart_low = BOTH(apart_low, select(ahead, n.y[i] - (z - blur), K(-1.0)) < 0.0);
        apart_low = BOTH(apart_low, select(ahead, K(1.0), n.y[i] - (z - blur)) > 0.0);
        apart_high = BOTH(apart_high, select(ahead, n.y[i] - (z + blur), K(-1.0)) < 0.0);
        apart_high = BOTH(apart_high, select(ahead, K(1.0), n.y[i] - (z + blur)) > 0.0);
        opposite.ahead[i] = 1.0 - n.ahead[i];
    }
    PRECISE NAMED(certain) c;
    c.at_least = NAMED(mean_at_least)(m, n, z - blur, K(0.0), slack);
    c.at_least = select(apart_low, c.at_least, K(0.0));
    // behind z lies at least the mean of the polynomial for the step turned round
    c.at_most = 1.0 - NAMED(mean_at_least)(m, opposite, z + blur, K(0.0), slack);
    c.at_most = select(apart_high, c.at_most, K(1.0));
    return c;
}
