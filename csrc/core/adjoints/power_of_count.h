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

/* What has been sought of the distribution through z: the weight at z, and of up to two other nodes
 * the weights and how far they lie from nodes of the rule. */
STRUCT(NAMED(found)) { real at, weight[2], away, from_low, to_high; };

/* Other nodes of the distribution through z than z, on the side that is counted. */
STRUCT(NAMED(counted)) {
    real from[2][NODES]; /* their distances from the rule's nodes */
    truth there[2];
    real sign[2];     /* 1: they are in front, -1: behind */
    truth complement; /* what is in front is all but z and these */
};

/* From z's distances from the rule's nodes. */
FN NAMED(counted) NAMED(counted_nodes)(NAMED(rule) r, const real *from, const NAMED(found) *found) {
    NAMED(counted) c;
    (void)r, (void)found; /* of one node there are no others */
    for (int j = 0; j < 2; ++j) {
        c.there[j] = K(0.0) > 1.0;
        c.sign[j] = K(1.0);
        for (int i = 0; i < NODES; ++i) c.from[j][i] = K(1.0);
    }
    c.complement = from[NODES - 1] > 0.0;
#if NODES == 2
    real gap = (r.g[1] - r.g[0]) + (r.g_low[1] - r.g_low[0]), s = found->away;
    c.from[0][0] = -min(s, K(FARTHEST));
    c.from[0][1] = c.from[0][0] - gap;
    c.there[0] = BOTH(BOTH(from[0] > 0.0, from[1] <= 0.0), s < K(FARTHEST));
#elif NODES > 2
    truth mirrored = from[NODES / 2] > 0.0, inside = BOTH(from[0] > 0.0, from[NODES - 1] <= 0.0);
    real s = found->away, gap[NODES];
    for (int i = 0; i < NODES; ++i) {
        int k = NODES - 1 - i;
        gap[i] = select(mirrored, (r.g[NODES - 1] - r.g[k]) + (r.g_low[NODES - 1] - r.g_low[k]),
                        (r.g[i] - r.g[0]) + (r.g_low[i] - r.g_low[0]));
    }
    for (int i = 0; i < NODES; ++i)
        c.from[0][i] = select(mirrored, s + gap[NODES - 1 - i], -(s + gap[i]));
    c.there[0] = BOTH(inside, s < K(FARTHEST));
    c.sign[0] = select(mirrored, K(-1.0), K(1.0));
    c.complement |= BOTH(inside, mirrored);
#if NODES == 4
    c.from[1][0] = found->from_low;
    for (int i = 1; i < NODES; ++i) {
        real offset = (r.g[i] - r.g[0]) + (r.g_low[i] - r.g_low[0]);
        real first = (r.g[1] - r.g[0]) + (r.g_low[1] - r.g_low[0]);
        c.from[1][i] = -(found->to_high + (offset - first));
    }
    c.there[1] = BOTH(from[1] > 0.0, from[2] <= 0.0);
#endif
#endif
    return c;
}

FN NAMED(found) NAMED(sought)(NAMED(rule) r, const NAMED(place) *o) {
    NAMED(found) f;
    f.at = o->at;
    f.away = f.from_low = f.to_high = K(1.0);
#if NODES == 2
    real gap = (r.g[1] - r.g[0]) + (r.g_low[1] - r.g_low[0]);
    f.away = NAMED(positive_root)(o->p, o->q - o->p * gap, r.e[0] * o->first * gap);
#elif NODES > 2
    const real *from = o->from;
    truth mirrored = from[NODES / 2] > 0.0, inside = BOTH(from[0] > 0.0, from[NODES - 1] <= 0.0);
    real e[NODES], gap[NODES];
    for (int i = 0; i < NODES; ++i) {
        int k = NODES - 1 - i;
        e[i] = select(mirrored, r.e[k], r.e[i]);
        gap[i] = select(mirrored, (r.g[NODES - 1] - r.g[k]) + (r.g_low[NODES - 1] - r.g_low[k]),
                        (r.g[i] - r.g[0]) + (r.g_low[i] - r.g_low[0]));
    }
    real ahead = select(mirrored, -from[NODES - 1], from[0]);
    real level = select(mirrored, -o->q, o->q) - o->p * ahead;
    f.away = NAMED(lowest_root)(o->p, level, e, gap, NODES, K(FARTHEST), inside);
#if NODES == 4
    real offset[NODES];
    for (int i = 0; i < NODES; ++i) offset[i] = (r.g[i] - r.g[0]) + (r.g_low[i] - r.g_low[0]);
    truth middle = BOTH(from[1] > 0.0, from[2] <= 0.0);
    real v = o->p * from[0] - o->q;
    NAMED(between) x = NAMED(middle_guess)(o->p, v, r.e, offset, 0, NODES);
    x = NAMED(middle_root)(x, o->p, v, r.e, offset, 0, NODES, middle);
    f.from_low = x.from_low;
    f.to_high = x.to_high;
#endif
#endif
    NAMED(counted) c = NAMED(counted_nodes)(r, o->from, &f);
    for (int j = 0; j < 2; ++j)
        f.weight[j] = select(c.there[j], NAMED(node_weight)(c.from[j], r.e, r.d), K(0.0));
    return f;
}

/* The share of absorbance in front of z. */
FN real NAMED(in_front_of)(const NAMED(counted) *c, const NAMED(found) *f) {
    real share = K(0.0);
    for (int j = 0; j < 2; ++j) share = share + c->sign[j] * f->weight[j];
    return clamp(select(c->complement, (1.0 - f->at) + share, share), K(0.0), 1.0 - f->at);
}

FN NAMED(distances) NAMED(away_from_rule)(NAMED(rule) r, real z) {
    NAMED(distances) away;
    for (int i = 0; i < NODES; ++i) {
        away.from[i] = (z - r.g[i]) - r.g_low[i];
        /* just in front of a node of the rule quotients have the values that they tend to */
        const real least = K(BY_PRECISION(1e-12, 1e-40));
        away.from[i] = select(real_abs(away.from[i]) < least, -least, away.from[i]);
    }
    return away;
}

FN NAMED(found) NAMED(found_at)(NAMED(rule) r, real z) {
    NAMED(place) o = NAMED(place_among)(NAMED(away_from_rule)(r, z), r.e, r.d);
    return NAMED(sought)(r, &o);
}

FN NAMED(pulled) NAMED(pulled_at)(NAMED(rule) r, const NAMED(found) *f, real b0, real z, real own,
                                  real beta, real by) {
    NAMED(pulled) result;
    NAMED(distances) away = NAMED(away_from_rule)(r, z);
    NAMED(counted) c = NAMED(counted_nodes)(r, away.from, f);
    real inverse = 1.0 / r.d, in_front = NAMED(in_front_of)(&c, f);
    NAMED(lagrange) at_z = NAMED(lagrange_at)(away.from, r.e, inverse, f->at);
    NAMED(by_masses) m = NAMED(past_pulled)(in_front, f->at, b0, own, beta, by, &result);
    m.at = m.at - select(c.complement, m.share, K(0.0));
    result.z = m.at * (K(-2.0) * f->at * at_z.slope);
    NAMED(begin_with)(&result, &at_z, m.at);
    for (int j = 0; j < (NODES == 4 ? 2 : NODES > 1); ++j) {
        NAMED(node) x = {.weight = f->weight[j], .value = K(1.0), .half_rise = K(0.0)};
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
        NAMED(add_node)(&result, &x, &at_z, f->at, r.e, inverse, c.sign[j] * m.share);
    }
    return result;
}

/* What is found at a fragment is kept in columns, `apart` numbers from one to the next. */
FN void NAMED(keep)(SCALAR *kept, int64_t apart, const NAMED(found) *f) {
    store(kept, f->at);
    if (NODES > 1) store(kept + apart, f->away);
    if (NODES > 1) store(kept + 2 * apart, f->weight[0]);
    if (NODES < 4) return;
    store(kept + 3 * apart, f->weight[1]);
    store(kept + 4 * apart, f->from_low);
    store(kept + 5 * apart, f->to_high);
}

/* Places `i` on, of which those that are not there repeat the first. */
FN NAMED(found) NAMED(found_again)(const SCALAR *kept, int64_t apart, int i, truth there) {
    NAMED(found) f;
    real *numbers[] = {&f.at, &f.away, &f.weight[0], &f.weight[1], &f.from_low, &f.to_high};
    for (int k = 0; k < MOIT_KEPT; ++k) {
        bool has = k < (NODES == 1 ? 1 : NODES == 4 ? MOIT_KEPT : 3);
        const SCALAR *column = kept + k * apart;
        *numbers[k] = has ? select(there, load(column + i), K(column[0])) : K(0.0);
    }
    return f;
}
