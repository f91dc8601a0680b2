/* Loops over power_of_count.h, in double. */

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
    real terms[TERMS];
    for (int t = 0; t < TERMS; ++t) terms[t] = K(S[t]);
    for (int i = 0; i < n; i += LANES) {
        real at = load(z + i), from[NODES];
        for (int k = 0; k < NODES; ++k) from[k] = at - r.g[k];
        NAMED(reading) found = NAMED(reading_at)(terms, from);
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
