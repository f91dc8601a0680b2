/* Rules of NODES nodes from the fragments themselves, with lanes over pixels: where bias does not
 * outweigh what the last digit of a double takes from moments, these say too little of where
 * fragments that are close lie, and the way back is as far off as they are. Sums, the recurrence of
 * the orthogonal polynomials and the nodes have twice the digits here; what is read through such a
 * rule loses nothing. Behind kernels/power_moments.h and kernels/pairs.h. */
#include "kernels/power_rules.h"

STRUCT(NAMED(exact_recurrence)) {
    pair a[NODES], square[NODES + 1]; /* as kernels/power_rules.h has them */
    truth fits;                       /* there are NODES nodes */
};

/* Moments 0 to 2 NODES, with bias. */
STRUCT(NAMED(exact_moments)) { pair b[2 * NODES + 1]; };

/* Below, pivots are what twice the digits of a double round off. */
#define LEAST_EXACT_PIVOT 1e-27

FN NAMED(exact_recurrence) NAMED(exact_recurrence_of)(const NAMED(exact_moments) *m) {
    NAMED(exact_recurrence) r;
    pair before[2 * NODES + 1], here[2 * NODES + 1], pivot = m->b[0], passed = pair_of(K(0.0));
    for (int i = 0; i <= 2 * NODES; ++i) before[i] = pair_of(K(0.0)), here[i] = m->b[i];
    r.square[0] = pair_of(K(0.0));
    r.fits = EVERYWHERE;
    for (int k = 0; k < NODES; ++k) {
        pair mean = pair_quotient(here[k + 1], pivot), previous = pivot;
        r.a[k] = pair_difference(mean, passed);
        passed = mean;
        for (int i = k + 1; i < 2 * NODES - k; ++i) {
            pair next = pair_difference(here[i + 1], pair_product(r.a[k], here[i]));
            next = pair_difference(next, pair_product(r.square[k], before[i]));
            before[i] = here[i];
            here[i] = next;
        }
        pivot = here[k + 1];
        r.fits = BOTH(r.fits, pivot.high > K(LEAST_EXACT_PIVOT));
        r.square[k + 1] = pair_quotient(pivot, previous);
    }
    return r;
}

/* The k-th orthogonal polynomial. */
FN pair NAMED(orthogonal_at)(const NAMED(exact_recurrence) *r, int k, pair x) {
    pair before = pair_of(K(0.0)), here = pair_of(K(1.0));
    for (int j = 0; j < k; ++j) {
        pair next = pair_product(pair_difference(x, r->a[j]), here);
        next = pair_difference(next, pair_product(r->square[j], before));
        before = here;
        here = next;
    }
    return here;
}

/* What the polynomial of all nodes rises by at the i-th. */
FN real NAMED(rise_at)(const pair *g, int i) {
    real rise = K(1.0);
    for (int j = 0; j < NODES; ++j)
        if (j != i) rise = rise * pair_difference(g[i], g[j]).high;
    return rise;
}

/* Doubles have found the nodes but for their last digits, and each step doubles the digits of all
 * (Weierstrass). */
FN NAMED(rule) NAMED(exact_rule)(NAMED(exact_recurrence) *c) {
    NAMED(recurrence) rounded = {.converged = CONVERGED};
    for (int k = 0; k < NODES; ++k) rounded.a[k] = clamp(c->a[k].high, K(-1.0), K(1.0));
    for (int k = 0; k <= NODES; ++k) rounded.square[k] = c->square[k].high;
    NAMED(rule) r = NAMED(rule_of)(rounded);
    pair g[NODES];
    for (int i = 0; i < NODES; ++i) g[i] = pair_of(r.g[i]);
    for (int step = 0; step < 2; ++step) {
        pair next[NODES];
        for (int i = 0; i < NODES; ++i) {
            real off = NAMED(orthogonal_at)(c, NODES, g[i]).high / NAMED(rise_at)(g, i);
            next[i] = pair_difference(g[i], pair_of(off));
        }
        for (int i = 0; i < NODES; ++i) g[i] = next[i];
    }
    for (int i = 0; i < NODES; ++i) {
        real below = NAMED(orthogonal_at)(c, NODES - 1, g[i]).high;
        r.g[i] = g[i].high;
        r.g_low[i] = g[i].low;
        r.e[i] = c->square[NODES].high * below / NAMED(rise_at)(g, i);
        c->fits = BOTH(c->fits, BOTH(r.e[i] > 0.0, r.e[i] <= 2.0));
        if (i > 0) c->fits = BOTH(c->fits, r.g[i] > r.g[i - 1]);
    }
    return r;
}

/* Of LANES pixels, of which some may not be there. */
FN NAMED(exact_moments) NAMED(exact_moments_of)(const moit_exact_rays *o, const pixel_columns *c) {
    NAMED(exact_moments) m;
    for (int k = 0; k <= 2 * NODES; ++k) m.b[k] = pair_of(K(0.0));
    for (int from = 0; from < c->most; from += LANES) {
        real a[LANES], z[LANES];
        number_columns(c, o->a, from, a);
        number_columns(c, o->z, from, z);
        for (int i = 0; i < LANES && from + i < c->most; ++i) {
            truth there = c->counts > (truth){0} + (bits)(from + i);
            pair power = pair_of(select(there, a[i], K(0.0)));
            real at = select(there, z[i], K(0.0));
            m.b[0] = pair_sum(m.b[0], power);
            for (int k = 1; k <= 2 * NODES; ++k) {
                power = pair_product(power, pair_of(at));
                m.b[k] = pair_sum(m.b[k], power);
            }
        }
    }
    truth some = m.b[0].high > K(LEAST_EXACT_MASS);
    pair all = pair_select(some, m.b[0], pair_of(K(1.0)));
    m.b[0] = pair_of(K(1.0));
    for (int k = 1; k <= 2 * NODES; ++k) {
        pair mean = pair_quotient(m.b[k], all);
        pair apart = pair_difference(pair_of(K(o->safe[k - 1])), mean);
        m.b[k] = pair_sum(mean, pair_product(pair_of(K(o->bias)), apart));
        m.b[k] = pair_select(some, m.b[k], pair_of(K(0.0))); /* which have no nodes */
    }
    return m;
}

/* Where they fit; of nothing some rule. Whether that is all there is. */
FN bool NAMED(put_rules)(const moit_exact_rays *o, const pixel_columns *c, int n,
                         const NAMED(exact_recurrence) *e, const NAMED(rule) *r) {
    bool all = true;
    real d = e->square[1].high;
    for (int k = 2; k <= NODES; ++k) d = d * e->square[k].high;
    for (int lane = 0; lane < LANES && lane < n; ++lane) {
        double *rule = o->rules + c->pixel[lane] * MOIT_RULE_SIZE(2 * NODES);
        double *low = o->low + c->pixel[lane] * (NODES + 1);
        bool fits = e->fits[lane], nothing = o->b0[c->pixel[lane]] == 0.0;
        low[NODES] = fits ? 1.0 : 0.0;
        all = all && (fits || nothing);
        for (int i = 0; i < NODES; ++i) {
            low[i] = fits ? r->g_low[i][lane] : 0.0;
            if (!fits && !nothing) continue;
            rule[i] = fits ? r->g[i][lane] : i;
            rule[NODES + i] = fits ? r->e[i][lane] : 1.0;
        }
        if (fits || nothing) rule[2 * NODES] = fits ? d[lane] : 1.0;
    }
    return all;
}

static bool NAMED(exact_rules)(const moit_exact_rays *o) {
    bool all = true;
    int order[COLUMN_PIXELS + LANES];
    for (int first = 0; first < o->pixels; first += COLUMN_PIXELS) {
        int n = pixels_by_count(first, o->pixels, o->offsets, order);
        for (int k = 0; k < n; k += LANES) {
            pixel_columns c = columns_from(n - k, order + k, o->offsets);
            NAMED(exact_moments) m = NAMED(exact_moments_of)(o, &c);
            NAMED(exact_recurrence) e = NAMED(exact_recurrence_of)(&m);
            NAMED(rule) r = NAMED(exact_rule)(&e);
            all = NAMED(put_rules)(o, &c, n - k, &e, &r) && all;
        }
    }
    return all;
}
