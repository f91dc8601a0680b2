/* What the double tables of trigonometric.h have of NODES nodes. */
#include "kernels/trigonometric_rules.h"

static void NAMED(circle_rules_of)(const moit_wrapping_zone *zone, int pixels, const double *b,
                                   double bias, double least, double *rules) {
    for (int p = 0; p < pixels; p += LANES) {
        SCALAR own[2 * NODES][LANES];
        columns_of(2 * NODES, pixels - p, b + p * 2 * NODES, own);
        NAMED(circle_moments) m;
        for (int k = 0; k < NODES; ++k) {
            m.re[k] = load(own[2 * k]);
            m.im[k] = load(own[2 * k + 1]);
        }
        NAMED(circle_rule) r = NAMED(circle_rule_of)(m, zone_of(zone), K(bias), K(least));
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
