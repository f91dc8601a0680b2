/* Backwards through trigonometric moments of NODES nodes, kernels/trigonometric_moments.h.
 *
 * On the line y that the circle is seen as, trigonometric polynomials are polynomials in y of
 * degree 2 NODES over (1 + y^2)^NODES, and weights of nodes over that are those of a Gauss rule as
 * power moments have it. What counts of a node in the wrapping zone is a function that changes
 * there, so what is in front is no optimum; dual_of_count.h holds all the same. Only nodes in the
 * outermost two intervals may lie in the zone.
 *
 * Where the zone ends, and where z crosses a node, one side is meant, that of the kernel's own
 * comparisons. */

/* As counted_nodes has them; of counts by value and slope. */
STRUCT(NAMED(circle_counted)) {
    NAMED(node) node[3];
    real share; /* of all that count */
    truth complement;
};

/* wrapped_share and its slope by y, of a node in the zone; beyond it 1 at the near end and 0 at the
 * far one. */
STRUCT(NAMED(wrapped)) { real share, slope; };

FN NAMED(wrapped) NAMED(wrapped_at)(wrapping_zone zone, real inverse) {
    NAMED(wrapped) o;
    real near = zone.edge + inverse, far = (1.0 + zone.edge) + (1.0 - zone.edge) * inverse;
    real under = 1.0 / (1.0 + inverse * inverse), left = near * far * under;
    real rise = (far + near * (1.0 - zone.edge) - 2.0 * inverse * left) * under;
    real share = 1.0 - zone.scale * left;
    truth inside = BOTH(real_abs(inverse) < zone.edge, BOTH(share > 0.0, share < 1.0));
    o.share = clamp(share, K(0.0), K(1.0));
    o.slope = select(inside, zone.scale * rise * inverse * inverse, K(0.0));
    return o;
}

/* What counts of a node y, on the side that is counted, times (1 + y^2)^NODES. */
FN void NAMED(count_node)(NAMED(circle_counted) *c, int j, NAMED(circle_rule) r, real y,
                          NAMED(wrapped) w) {
    NAMED(node) *x = &c->node[j];
    real scale = NAMED(circle_scale)(y), square = 1.0 + y * y;
    real counts = select(c->complement, 1.0 - w.share, w.share);
    real slope = select(c->complement, -w.slope, w.slope);
    x->weight = select(x->there, NAMED(node_weight)(x->from, r.e, r.d), K(0.0));
    x->value = counts * scale;
    x->half_rise = scale * (0.5 * slope + counts * (NODES * y / square));
    c->share = c->share + select(x->there, x->weight * x->value, K(0.0));
}

FN NAMED(circle_counted)
    NAMED(circle_counted_nodes)(NAMED(circle_rule) r, wrapping_zone zone, real y, NAMED(place) o) {
    NAMED(circle_counted) c = {.share = K(0.0)};
    const real most = K(1e12);
    real end[NODES], gap[NODES], back[NODES], offset[NODES];
    c.complement = o.from[NODES / 2] > 0.0;
    real part = 1.0 / max(o.p + real_abs(o.q), K(1e-300));
    o.p = o.p * part;
    o.q = o.q * part;
    real level = o.p * y - o.q;
    for (int i = 0; i < NODES; ++i) {
        int k = NODES - 1 - i;
        offset[i] = gap[i] = (r.g[i] - r.g[0]) + (r.g_low[i] - r.g_low[0]);
        end[i] = r.e[k];
        back[i] = (r.g[NODES - 1] - r.g[k]) + (r.g_low[NODES - 1] - r.g_low[k]);
    }
    NAMED(node) *x = &c.node[0];
    x->there = select(c.complement, o.p * r.f_front - level, o.from[0]) > 0.0;
    real s = NAMED(lowest_root)(o.p, o.q - o.p * o.from[0], r.e, gap, NODES, most, x->there);
    for (int i = 0; i < NODES; ++i) x->from[i] = -(s + gap[i]);
    x->past = x->from[0] - o.from[0];
    real root = r.g[0] - s, inverse = 1.0 / min(root, K(-1.0));
    NAMED(wrapped) w =
        NAMED(wrapped_at)(zone, max(select(root < 0.0, inverse, -zone.edge), -zone.edge));
    NAMED(count_node)(&c, 0, r, root, w);

    x = &c.node[1];
    x->there = select(c.complement, -o.from[NODES - 1], level - o.p * r.f_back) >= 0.0;
    s = NAMED(lowest_root)(o.p, o.p * o.from[NODES - 1] - o.q, end, back, NODES, most, x->there);
    for (int i = 0; i < NODES; ++i) x->from[i] = s + back[NODES - 1 - i];
    x->past = x->from[NODES - 1] - o.from[NODES - 1];
    root = r.g[NODES - 1] + s;
    inverse = 1.0 / max(root, K(1.0));
    w = NAMED(wrapped_at)(zone, min(select(root > 0.0, inverse, zone.edge), zone.edge));
    NAMED(count_node)(&c, 1, r, root, w);
#if NODES == 4
    x = &c.node[2];
    x->there = BOTH(o.from[1] > 0.0, o.from[2] <= 0.0);
    NAMED(between) at = NAMED(middle_guess)(o.p, o.p * o.from[0] - o.q, r.e, offset, 0, NODES);
    at = NAMED(middle_root)(at, o.p, o.p * o.from[0] - o.q, r.e, offset, 0, NODES, x->there);
    x->from[0] = at.from_low;
    for (int i = 1; i < NODES; ++i) x->from[i] = -(at.to_high + (offset[i] - offset[1]));
    x->past = x->from[1] - o.from[1];
    w.share = K(1.0);
    w.slope = K(0.0);
    NAMED(count_node)(&c, 2, r, r.g[0] + at.from_low, w);
#else
    (void)offset;
#endif
    return c;
}

FN NAMED(distances) NAMED(circle_away)(NAMED(circle_rule) r, wrapping_zone zone, real z, real y) {
    NAMED(distances) away = NAMED(circle_distances)(r, zone, z, y);
    for (int i = 0; i < NODES; ++i) /* as in pulled_at */
        away.from[i] = select(real_abs(away.from[i]) < K(1e-40), K(-1e-40), away.from[i]);
    return away;
}

FN NAMED(pulled) NAMED(circle_pulled_at)(NAMED(circle_rule) r, wrapping_zone zone, real b0, real z,
                                         real own, real beta, real by) {
    NAMED(pulled) result;
    real y = on_the_line(zone, z), square = 1.0 + y * y, scale = NAMED(circle_scale)(y);
    NAMED(distances) away = NAMED(circle_away)(r, zone, z, y);
    NAMED(place) o = NAMED(place_among)(away, r.e, r.d * scale);
    NAMED(circle_counted) c = NAMED(circle_counted_nodes)(r, zone, y, o);
    real inverse = 1.0 / r.d, at = o.at / scale;
    NAMED(lagrange) at_z = NAMED(lagrange_at)(away.from, r.e, inverse, at);
    real in_front = select(c.complement, (1.0 - o.at) - c.share, c.share);
    in_front = clamp(in_front, K(0.0), 1.0 - o.at);
    NAMED(by_masses) m = NAMED(past_pulled)(in_front, o.at, b0, own, beta, by, &result);
    m.at = m.at - select(c.complement, m.share, K(0.0));
    result.z = m.at * (-2.0 * o.at * (at_z.slope - NODES * y / square));
    NAMED(begin_with)(&result, &at_z, m.at * scale);
    real by_node = select(c.complement, -m.share, m.share);
    for (int j = 0; j < (NODES == 4 ? 3 : 2); ++j)
        NAMED(add_node)(&result, &c.node[j], &at_z, at, r.e, inverse, by_node);
    result.z = result.z * (square * zone.turns * K(6.283185307179586477));
    return result;
}

FN NAMED(circle_rule) NAMED(circle_rule_at)(const double *p) {
    NAMED(circle_rule) r;
    for (int i = 0; i < NODES; ++i) {
        r.z[i] = K(p[i]);
        r.g[i] = K(p[NODES + i]);
        r.e[i] = K(p[2 * NODES + i]);
        r.z_low[i] = r.g_low[i] = K(0.0);
    }
    r.d = K(p[3 * NODES]);
    r.f_front = K(p[3 * NODES + 1]);
    r.f_back = K(p[3 * NODES + 2]);
    return r;
}

/* As those of power moments. */
static double NAMED(circle_sum_pulled)(wrapping_zone zone, const moit_readings *at,
                                       const double *rule, double b0, double beta, double *S) {
    NAMED(circle_rule) r = NAMED(circle_rule_at)(rule);
    NAMED(sums) sums = {{{0.0}}};
    for (int i = 0; i < at->n; i += LANES) {
        truth there = among_first(at->n - i);
        real z = select(there, load(at->z + i), K(at->z[0]));
        real own = at->own ? select(there, load(at->own + i), K(0.0)) : K(0.0);
        NAMED(pulled) p = NAMED(circle_pulled_at)(r, zone, K(b0), z, own, K(beta),
                                                  select(there, load(at->by + i), K(0.0)));
        NAMED(sum_up)(&sums, &p, i, there, at->by_z, at->own ? at->by_own : NULL);
    }
    return NAMED(give_sums)(&sums, S);
}

static void NAMED(read_circle)(wrapping_zone zone, int n, const double *rule, const double *S,
                               const double *z, double *value, double *slope) {
    NAMED(circle_rule) r = NAMED(circle_rule_at)(rule);
    real terms[TERMS];
    for (int t = 0; t < TERMS; ++t) terms[t] = K(S[t]);
    for (int i = 0; i < n; i += LANES) {
        real at = load(z + i), y = on_the_line(zone, at), square = 1.0 + y * y;
        NAMED(distances) away = NAMED(circle_distances)(r, zone, at, y);
        NAMED(reading) found = NAMED(reading_at)(terms, away.from);
        real part = 1.0 / NAMED(circle_scale)(y);
        real rise = found.slope * square - 2.0 * NODES * y * found.value;
        rise = rise * part * (zone.turns * K(6.283185307179586477));
        store(value + i, found.value * part);
        store(slope + i, rise);
    }
}
