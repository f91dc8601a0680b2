/* Polynomials that solve the dual of what moments of NODES nodes prove (power_of_count.h), for
 * texts that know the nodes of the distribution through z.
 *
 * What is absorbed in front of z is a sum over nodes x of their weights times a function of x: 1 in
 * front of z, 0 behind it. Its derivatives by the moments are those of the polynomial, of degree 2
 * NODES, that has the function's value at all nodes and its slope at all but z: with the Lagrange
 * polynomials l of the nodes the sum over x of
 *
 *     value l_x^2 + c_x l_x l_z,  c_x = (slope - 2 value l_x'(x)) / l_z'(x),
 *
 * as what a node gains by moving the function gains, too. With z it falls by the weight at z times
 * the polynomial's slope there. */
/* A polynomial's S, the upper half of its rows one after the other. */
#define TERMS ((NODES + 1) * (NODES + 2) / 2)

/* u of a point and its slope there. */
STRUCT(NAMED(products)) {
    real u[NODES + 1];
    real slope[NODES + 1];
};

FN NAMED(products) NAMED(products_of)(const real *from) {
    NAMED(products) o;
    o.u[0] = K(1.0);
    o.slope[0] = K(0.0);
    for (int i = 0; i < NODES; ++i) {
        o.slope[0] = o.slope[0] * from[i] + o.u[0];
        o.u[0] = o.u[0] * from[i];
        o.u[i + 1] = K(1.0);
        o.slope[i + 1] = K(0.0);
        for (int k = 0; k < NODES; ++k) {
            if (k == i) continue;
            o.slope[i + 1] = o.slope[i + 1] * from[k] + o.u[i + 1];
            o.u[i + 1] = o.u[i + 1] * from[k];
        }
    }
    return o;
}

/* A node's Lagrange polynomial as a factor of u, u's first at the node, and its slope there. */
STRUCT(NAMED(lagrange)) {
    real l[NODES + 1];
    real first, slope;
};

FN NAMED(lagrange) NAMED(lagrange_at)(const real *from, const real *e, real inverse, real weight) {
    NAMED(products) there = NAMED(products_of)(from);
    NAMED(lagrange) x;
    x.first = there.u[0];
    x.slope = K(0.0);
    for (int k = 0; k <= NODES; ++k) {
        real norm = inverse;
        if (k > 0) norm = norm * e[k - 1];
        x.l[k] = weight * norm * there.u[k];
        x.slope = x.slope + x.l[k] * there.slope[k];
    }
    return x;
}

/* Derivatives of what is absorbed in front of z, and of what that hangs on, times a factor. */
STRUCT(NAMED(pulled)) {
    real S[TERMS];
    real z, b0, own;
};

/* Another node than z, and what is counted there. */
STRUCT(NAMED(node)) {
    real from[NODES];      /* its distances from the rule's nodes */
    real weight, past;     /* past: how far behind z */
    real value, half_rise; /* of the function, and half its slope */
    truth there;
};

FN void NAMED(add_node)(NAMED(pulled) *to, const NAMED(node) *node, const NAMED(lagrange) *z,
                        real at, const real *e, real inverse, real by) {
    NAMED(lagrange) x = NAMED(lagrange_at)(node->from, e, inverse, node->weight);
    real ratio = node->weight * x.first / (at * z->first);
    real turn = node->half_rise - node->value * x.slope; /* half of c_x l_z'(x) */
    real mixed = turn * node->past * ratio;
    real moved = 2.0 * at * turn * ratio * ratio;
    to->z = to->z + select(node->there, by * moved, K(0.0));
    for (int k = 0, t = 0; k <= NODES; ++k)
        for (int m = k; m <= NODES; ++m, ++t) {
            real both =
                node->value * x.l[k] * x.l[m] + mixed * (x.l[k] * z->l[m] + z->l[k] * x.l[m]);
            to->S[t] = to->S[t] + select(node->there, by * both, K(0.0));
        }
}

/* From what is absorbed in front of z (absorbance_past of kernels/power_moments.h) to the share in
 * front of it and the weight at it. */
STRUCT(NAMED(by_masses)) { real share, at; };

FN NAMED(by_masses) NAMED(past_pulled)(real in_front, real at, real b0, real own, real beta,
                                       real by, NAMED(pulled) *to) {
    NAMED(by_masses) o;
    real at_z = b0 * at - own, most = max(b0 - own, K(0.0));
    truth shades = at_z > 0.0, bounded = b0 * in_front + beta * max(at_z, K(0.0)) > most;
    real of_most = select(b0 > own, by, K(0.0)), shaded = select(shades, by * beta, K(0.0));
    o.share = select(bounded, K(0.0), by * b0);
    o.at = select(BOTH(shades, ~bounded), by * beta * b0, K(0.0));
    to->b0 = select(bounded, of_most, by * in_front + shaded * at);
    to->own = -select(bounded, of_most, shaded);
    return o;
}

/* Begins with the weight at z: by_at times the square of its Lagrange polynomial. */
FN void NAMED(begin_with)(NAMED(pulled) *to, const NAMED(lagrange) *z, real by_at) {
    for (int k = 0, t = 0; k <= NODES; ++k)
        for (int m = k; m <= NODES; ++m, ++t) to->S[t] = by_at * z->l[k] * z->l[m];
}

/* A point's value of the polynomial of S and its slope there. */
STRUCT(NAMED(reading)) { real value, slope; };

FN NAMED(reading) NAMED(reading_at)(const real *S, const real *from) {
    NAMED(products) o = NAMED(products_of)(from);
    NAMED(reading) at = {K(0.0), K(0.0)};
    for (int k = 0, t = 0; k <= NODES; ++k)
        for (int m = k; m <= NODES; ++m, ++t) {
            real by = m == k ? S[t] : 2.0 * S[t];
            at.value = at.value + by * o.u[k] * o.u[m];
            at.slope = at.slope + by * (o.slope[k] * o.u[m] + o.u[k] * o.slope[m]);
        }
    return at;
}
