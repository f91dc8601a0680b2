/* What the double tables of trigonometric.h have of NODES nodes. */
#include "kernels/trigonometric_rules.h"

/* With the count's roots sought together, as in power_rules_of_count.h. */
FN void NAMED(one_more_circle_together)(int n, const int k, const NAMED(circle_recurrence) *c,
                                        NAMED(circle_nodes) *all) {
    NAMED(circle_step) step[NAMED(RULES_TOGETHER)];
    NAMED(partial) poles[NAMED(RULES_TOGETHER)];
    NAMED(roots) found[NAMED(RULES_TOGETHER)];
    real level[NAMED(RULES_TOGETHER)], converged[NAMED(RULES_TOGETHER)];
    for (int v = 0; v < n; ++v) {
        step[v] = NAMED(circle_step_of)(all[v], c[v], k);
        memcpy(poles[v].g, all[v].g, sizeof poles[v].g);
        memcpy(poles[v].e, step[v].e, sizeof poles[v].e);
        level[v] = step[v].level;
        converged[v] = CONVERGED;
    }
    NAMED(roots_together)(n, k, 2, level, poles, converged, found);
    for (int v = 0; v < n; ++v) all[v] = NAMED(circle_nodes_of)(step[v], found[v], k);
}

static void NAMED(circle_rules_of)(const moit_wrapping_zone *zone_, int pixels, const double *b,
                                   double bias, double least, double *rules) {
    const wrapping_zone zone = zone_of(zone_);
    NAMED(circle_recurrence) c[NAMED(RULES_TOGETHER)];
    NAMED(circle_nodes) all[NAMED(RULES_TOGETHER)];
    for (int first = 0; first < pixels; first += NAMED(RULES_TOGETHER) *LANES) {
        int n = 0;
        for (int p = first; p < pixels && n < NAMED(RULES_TOGETHER); p += LANES, ++n) {
            SCALAR own[2 * NODES][LANES];
            columns_of(2 * NODES, pixels - p, b + p * 2 * NODES, own);
            NAMED(circle_moments) m;
            for (int k = 0; k < NODES; ++k) {
                m.re[k] = load(own[2 * k]);
                m.im[k] = load(own[2 * k + 1]);
            }
            c[n] = NAMED(circle_recurrence_of)(NAMED(circle_biased)(m, zone, K(bias)), K(least));
        }
        for (int v = 0; v < n; ++v) all[v] = NAMED(first_circle_nodes)(c[v]);
#if NODES > 2
        NAMED(one_more_circle_together)(n, 2, c, all);
#endif
#if NODES > 3
        NAMED(one_more_circle_together)(n, 3, c, all);
#endif
        for (int v = 0, p = first; v < n; ++v, p += LANES) {
            NAMED(circle_rule) r = NAMED(circle_rule_from)(all[v], c[v].pivot[NODES], zone);
            for (int lane = 0; lane < LANES && p + lane < pixels; ++lane) {
                double *out = rules + (p + lane) * MOIT_CIRCLE_RULE_SIZE(NODES);
                for (int i = 0; i < NODES; ++i) {
                    out[i] = r.z[i][lane];
                    out[NODES + i] = r.g[i][lane];
                    out[2 * NODES + i] = r.e[i][lane];
                }
                out[3 * NODES] = r.d[lane];
                out[3 * NODES + 1] = r.f_front[lane];
                out[3 * NODES + 2] = r.f_back[lane];
            }
        }
    }
}

static void NAMED(circle_pivots_of)(const moit_wrapping_zone *zone, int pixels, const double *b,
                                    const double *bias, double *pivot) {
    for (int p = 0; p < pixels; p += LANES) {
        SCALAR own[2 * NODES + 1][LANES];
        for (int lane = 0; lane < LANES; ++lane) {
            int from = p + lane < pixels ? p + lane : p;
            for (int k = 0; k < 2 * NODES; ++k) own[k][lane] = b[from * 2 * NODES + k];
            own[2 * NODES][lane] = bias[from];
        }
        NAMED(circle_moments) m;
        for (int k = 0; k < NODES; ++k) {
            m.re[k] = load(own[2 * k]);
            m.im[k] = load(own[2 * k + 1]);
        }
        NAMED(circle_moments) mixed = NAMED(circle_biased)(m, zone_of(zone), load(own[2 * NODES]));
        NAMED(circle_recurrence) r = NAMED(circle_recurrence_of)(mixed, K(NO_PIVOT));
        for (int lane = 0; lane < LANES && p + lane < pixels; ++lane)
            pivot[p + lane] = r.lowest[lane];
    }
}
