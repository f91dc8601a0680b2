/* What sums of NODES nodes' powers bound, and its slopes, a ray to a lane: from rows of floats to
 * rows of floats, with nothing kept between. Rules are by single numbers of double, so that what
 * the bias leaves of pivots has to be far above what these round off: MOIT_ROWS_BIAS. Behind
 * exact_rules_of_count.h. */

static void NAMED(bound_rows)(const moit_rows *o, int64_t first, int n) {
    const float *mass = o->rows + first, *places = o->z + first;
    NAMED(moments) safe;
    for (int k = 0; k < 2 * NODES; ++k) safe.b[k] = K(o->safe[k]);
    for (int i = 0; i < n; i += LANES) {
        int left = n - i;
        real b0 = widened(mass + i, left), z = widened(places + i, left), own = K(0.0);
        truth there = b0 > 0.0;
        real inverse = select(there, 1.0 / b0, K(0.0));
        NAMED(moments) m;
        for (int k = 0; k < 2 * NODES; ++k)
            m.b[k] = widened(mass + (k + 1) * o->rays + i, left) * inverse;
        NAMED(rule) r = NAMED(gauss_rule)(1, m, K(o->bias), safe, K(o->least));
        NAMED(found) f = NAMED(found_at)(r, z);
        NAMED(distances) away = NAMED(away_from_rule)(r, z);
        NAMED(counted) c = NAMED(counted_nodes)(r, away.from, &f);
        NAMED(masses) at = {.at = f.at, .in_front = NAMED(in_front_of)(&c, &f)};
        narrow(o->bound + first + i, NAMED(absorbance_past)(at, b0, own, K(o->beta)), left);
        if (!o->slopes) continue;
        NAMED(pulled) p =
            NAMED(pulled_at)(r, &f, b0, z, own, K(o->beta), select(there, K(1.0), K(0.0)));
        real by_b[2 * NODES], by_mass = p.b0;
        NAMED(coefficients_of)(r.g, p.S, by_b);
        for (int k = 0; k < 2 * NODES; ++k) {
            real by_row = K(1.0 - o->bias) * by_b[k] * inverse;
            by_mass = by_mass - by_row * m.b[k];
            narrow(o->slopes + (k + 1) * o->rays + first + i, by_row, left);
        }
        narrow(o->slopes + first + i, select(there, by_mass, K(0.0)), left);
        narrow(o->by_z + first + i, select(there, p.z, K(0.0)), left);
    }
}
