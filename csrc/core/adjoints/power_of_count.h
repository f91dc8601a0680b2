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
        away.from[i] = select(real_abs(away.from[i]) < K(1e-40), K(-1e-40), away.from[i]);
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
    result.z = m.at * (-2.0 * f->at * at_z.slope);
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
FN void NAMED(keep)(double *kept, int64_t apart, const NAMED(found) *f) {
    store(kept, f->at);
    if (NODES > 1) store(kept + apart, f->away);
    if (NODES > 1) store(kept + 2 * apart, f->weight[0]);
    if (NODES < 4) return;
    store(kept + 3 * apart, f->weight[1]);
    store(kept + 4 * apart, f->from_low);
    store(kept + 5 * apart, f->to_high);
}

/* Places `i` on, of which those that are not there repeat the first. */
FN NAMED(found) NAMED(found_again)(const double *kept, int64_t apart, int i, truth there) {
    NAMED(found) f;
    real *numbers[] = {&f.at, &f.away, &f.weight[0], &f.weight[1], &f.from_low, &f.to_high};
    for (int k = 0; k < MOIT_KEPT; ++k) {
        bool has = k < (NODES == 1 ? 1 : NODES == 4 ? MOIT_KEPT : 3);
        const double *column = kept + k * apart;
        *numbers[k] = has ? select(there, load(column + i), K(column[0])) : K(0.0);
    }
    return f;
}

/* As the stage of the same name, which this keeps the searches of. */
static void NAMED(find_transmittance)(int pixels, const int32_t *offsets, const double *z,
                                      const double *own, const double *rules, const double *b0,
                                      double beta, bool absorbed, double *T, double *kept,
                                      int64_t apart) {
    enum { SIZE = 2 * NODES + 1 };
    ray_block block;
    double row[SIZE + 1][BLOCK_ROW] = {{0}};
    for (int p = 0; p < pixels;) {
        p = next_block(&block, p, pixels, offsets);
        for (int ray = 0; ray < block.rays; ++ray) {
            for (int k = 0; k < SIZE; ++k) row[k][ray] = rules[block.pixel[ray] * SIZE + k];
            row[SIZE][ray] = b0[block.pixel[ray]];
        }
        for (int i = block.first; i < block.end; i += LANES) {
            truth lane;
            int ray = first_ray(&block, i, &lane);
            NAMED(rule) r;
            for (int k = 0; k < NODES; ++k) {
                r.g[k] = lanes_of_row(row[k] + ray, lane);
                r.g_low[k] = K(0.0);
                r.e[k] = lanes_of_row(row[NODES + k] + ray, lane);
            }
            r.d = lanes_of_row(row[2 * NODES] + ray, lane);
            real at = load(z + i), total = lanes_of_row(row[SIZE] + ray, lane);
            NAMED(found) f = NAMED(found_at)(r, at);
            NAMED(distances) away = NAMED(away_from_rule)(r, at);
            NAMED(counted) c = NAMED(counted_nodes)(r, away.from, &f);
            NAMED(masses) mass = {.at = f.at, .in_front = NAMED(in_front_of)(&c, &f)};
            NAMED(keep)(kept + i, apart, &f);
            store(T + i,
                  NAMED(absorbance_past)(mass, total, own ? load(own + i) : K(0.0), K(beta)));
        }
        if (!absorbed) decay_of_block(&block, T);
    }
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

/* Of one pixel's places, by what is absorbed in front of each; adds to by_z and by_own and gives
 * what b0 changes by; S: of all. */
FN double NAMED(sum_of)(const bool kept, const moit_readings *at, const double *rule, double b0,
                        double beta, double *S) {
    NAMED(rule) r = NAMED(rule_at)(rule);
    NAMED(sums) sums = {{{0.0}}};
    for (int i = 0; i < at->n; i += LANES) {
        truth there = among_first(at->n - i);
        real z = select(there, load(at->z + i), K(at->z[0]));
        real own = at->own ? select(there, load(at->own + i), K(0.0)) : K(0.0);
        NAMED(found) f =
            kept ? NAMED(found_again)(at->kept, at->apart, i, there) : NAMED(found_at)(r, z);
        NAMED(pulled) p = NAMED(pulled_at)(r, &f, K(b0), z, own, K(beta),
                                           select(there, load(at->by + i), K(0.0)));
        NAMED(sum_up)(&sums, &p, i, there, at->by_z, at->own ? at->by_own : NULL);
    }
    return NAMED(give_sums)(&sums, S);
}

static double NAMED(sum_pulled)(const moit_readings *at, const double *rule, double b0, double beta,
                                double *S) {
    return at->kept ? NAMED(sum_of)(true, at, rule, b0, beta, S)
                    : NAMED(sum_of)(false, at, rule, b0, beta, S);
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
        real at = load_at_most(z + i, left);
        NAMED(found) f = NAMED(found_at)(r, at);
        NAMED(pulled) p =
            NAMED(pulled_at)(r, &f, total, at, own ? load_at_most(own + i, left) : K(0.0), K(beta),
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
