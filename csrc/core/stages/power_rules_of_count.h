/* What the double tables of power.h have of NODES nodes. */
#include "kernels/power_rules.h"
#include "kernels/power_bounds.h"

/* Rules of several vectors of pixels are made together: steps to a root wait for one another, and a
 * processor has other work meanwhile where each is taken for all before the next is. */
enum { NAMED(RULES_TOGETHER) = 8 };

/* As interlaced_roots, of k > 1 poles. So many steps are `usual`. */
FN void NAMED(roots_together)(int n, const int k, const int usual, const real *level,
                              NAMED(partial) *poles, const real *converged, NAMED(roots) *found) {
    NAMED(outer_end) end[2][NAMED(RULES_TOGETHER)];
    NAMED(sought_root) x[2][NAMED(RULES_TOGETHER)];
    const real most = K(FARTHEST), one = K(1.0);
    for (int b = 0; b < 2; ++b) {
        for (int v = 0; v < n; ++v)
            end[b][v] = NAMED(end_of_poles)(level[v], poles[v].g, poles[v].e, k, b);
        for (int v = 0; v < n; ++v)
            x[b][v] = NAMED(lowest_root_start)(one, end[b][v].level, end[b][v].e, end[b][v].gap, k,
                                               most, EVERYWHERE);
        for (int step = 0; step < usual; ++step)
            for (int v = 0; v < n; ++v)
                x[b][v] = NAMED(lowest_root_nearer)(x[b][v], converged[v], one, end[b][v].level,
                                                    end[b][v].e, end[b][v].gap, k, most);
        for (int v = 0; v < n; ++v)
            x[b][v].s = NAMED(lowest_root_found)(x[b][v], usual, converged[v], one, end[b][v].level,
                                                 end[b][v].e, end[b][v].gap, k, most);
    }
    for (int v = 0; v < n; ++v)
        found[v] = NAMED(roots_within)(level[v], poles[v].g, poles[v].e, k, end[0][v], x[0][v].s,
                                       end[1][v], x[1][v].s);
}

FN void NAMED(one_more_together)(int n, const int k, const NAMED(recurrence) *c,
                                 NAMED(partial) *all) {
    NAMED(roots) found[NAMED(RULES_TOGETHER)];
    real level[NAMED(RULES_TOGETHER)], converged[NAMED(RULES_TOGETHER)];
    for (int v = 0; v < n; ++v) {
        level[v] = c[v].a[k];
        converged[v] = c[v].converged;
    }
    NAMED(roots_together)(n, k, 1, level, all, converged, found);
    for (int v = 0; v < n; ++v) all[v] = NAMED(partial_of)(found[v], c[v], k);
}

/* Moments of some vectors of pixels, and their rules. */
typedef struct {
    int vectors;
    NAMED(moments) m[NAMED(RULES_TOGETHER)], safe;
    NAMED(rule) rule[NAMED(RULES_TOGETHER)];
} NAMED(some_rules);

FN void NAMED(find_rules)(const int floats, NAMED(some_rules) *of, double bias, double least) {
    NAMED(recurrence) c[NAMED(RULES_TOGETHER)];
    NAMED(partial) all[NAMED(RULES_TOGETHER)];
    int n = of->vectors;
    for (int v = 0; v < n; ++v) {
        c[v] = floats ? NAMED(plain_recurrence_of)(of->m[v], K(bias), of->safe, K(least))
                      : NAMED(recurrence_of)(of->m[v], K(bias), of->safe, K(least));
    }
    for (int v = 0; v < n; ++v) {
        all[v] = NAMED(first_node)(c[v]);
#if NODES > 1
        all[v] = NAMED(one_more_node)(all[v], c[v], 1);
#endif
    }
#if NODES > 2
    NAMED(one_more_together)(n, 2, c, all);
#endif
#if NODES > 3
    NAMED(one_more_together)(n, 3, c, all);
#endif
    for (int v = 0; v < n; ++v) of->rule[v] = NAMED(rule_from)(c[v], all[v]);
}

FN void NAMED(rules_held_as)(const int floats, int pixels, const double *b, double bias,
                             const double *safe, double least, double *rules) {
    NAMED(some_rules) of;
    for (int k = 0; k < 2 * NODES; ++k) of.safe.b[k] = K(safe[k]);
    for (int first = 0; first < pixels; first += NAMED(RULES_TOGETHER) *LANES) {
        of.vectors = 0;
        for (int p = first; p < pixels && of.vectors < NAMED(RULES_TOGETHER); p += LANES) {
            SCALAR columns[2 * NODES][LANES];
            columns_of(2 * NODES, pixels - p, b + p * 2 * NODES, columns);
            for (int k = 0; k < 2 * NODES; ++k) of.m[of.vectors].b[k] = load(columns[k]);
            ++of.vectors;
        }
        NAMED(find_rules)(floats, &of, bias, least);
        for (int v = 0, p = first; v < of.vectors; ++v, p += LANES) {
            const NAMED(rule) *r = of.rule + v;
            for (int lane = 0; lane < LANES && p + lane < pixels; ++lane) {
                double *out = rules + (p + lane) * MOIT_RULE_SIZE(2 * NODES);
                for (int i = 0; i < NODES; ++i) {
                    out[i] = r->g[i][lane];
                    out[NODES + i] = r->e[i][lane];
                }
                out[2 * NODES] = r->d[lane];
            }
        }
    }
}

/* Moments of the pixels from `first` on, as many as are taken together. */
FN void NAMED(gather_floats)(int first, int pixels, const float *b, NAMED(some_rules) *of) {
    of->vectors = 0;
    for (int p = first; p < pixels && of->vectors < NAMED(RULES_TOGETHER); p += LANES)
        columns_of_floats(2 * NODES, pixels - p, b + p * 2 * NODES, of->m[of->vectors++].b);
}

FN void NAMED(put_rule)(NAMED(rule) r, int length, float *row) {
    for (int i = 0; i < NODES; ++i) {
        put_floats(row + i * length, r.g[i]);
        put_floats(row + (NODES + i) * length, r.g[i] - rounded_to_float(r.g[i]));
        put_floats(row + (2 * NODES + i) * length, r.e[i]);
    }
    put_floats(row + 3 * NODES * length, r.d);
}

/* With up to two nodes there is nothing to wait for together. */
static void NAMED(rule_rows_of)(int pixels, const float *b, double bias, const double *safe,
                                double least, float *rows) {
    NAMED(some_rules) of;
    for (int k = 0; k < 2 * NODES; ++k) of.safe.b[k] = K(safe[k]);
    for (int first = 0; first < pixels; first += NAMED(RULES_TOGETHER) *LANES) {
        NAMED(gather_floats)(first, pixels, b, &of);
        NAMED(find_rules)(1, &of, bias, least);
        for (int v = 0; v < of.vectors; ++v)
            NAMED(put_rule)(of.rule[v], MOIT_ROW(pixels), rows + first + v * LANES);
    }
}

static void NAMED(rules_of)(bool floats, int pixels, const double *b, double bias,
                            const double *safe, double least, double *rules) {
    if (floats) NAMED(rules_held_as)(1, pixels, b, bias, safe, least, rules);
    else NAMED(rules_held_as)(0, pixels, b, bias, safe, least, rules);
}

static void NAMED(pivots_of)(int pixels, const double *b, const double *bias, const double *safe_,
                             double *pivot) {
    NAMED(moments) safe;
    for (int k = 0; k < 2 * NODES; ++k) safe.b[k] = K(safe_[k]);
    for (int p = 0; p < pixels; p += LANES) {
        SCALAR own[2 * NODES + 1][LANES];
        for (int lane = 0; lane < LANES; ++lane) {
            int from = p + lane < pixels ? p + lane : p;
            for (int k = 0; k < 2 * NODES; ++k) own[k][lane] = b[from * 2 * NODES + k];
            own[2 * NODES][lane] = bias[from];
        }
        NAMED(moments) m;
        for (int k = 0; k < 2 * NODES; ++k) m.b[k] = load(own[k]);
        NAMED(recurrence) r = NAMED(recurrence_of)(m, load(own[2 * NODES]), safe, K(NO_PIVOT));
        for (int lane = 0; lane < LANES && p + lane < pixels; ++lane)
            pivot[p + lane] = r.lowest[lane];
    }
}

static void NAMED(bounds_of)(int pixels, const int32_t *offsets, const double *z, const double *b,
                             const double *rules, double blur, const double *slack,
                             double *at_least, double *at_most) {
    for (int p = 0; p < pixels; ++p) {
        if (offsets[p] == offsets[p + 1]) continue;
        NAMED(rule) r = NAMED(load_rule)(rules + p * MOIT_RULE_SIZE(2 * NODES));
        NAMED(moments) m;
        for (int k = 0; k < 2 * NODES; ++k) m.b[k] = K(b[p * 2 * NODES + k]);
        for (int i = offsets[p]; i < offsets[p + 1]; i += LANES) {
            NAMED(certain) c = NAMED(certain_at)(r, m, load(z + i), K(blur), K(slack[p]));
            store(at_least + i, c.at_least);
            store(at_most + i, c.at_most);
        }
    }
}
