/* What the double tables of power.h have of NODES nodes. */
#include "kernels/power_rules.h"
#include "kernels/power_bounds.h"

FN void NAMED(rules_held_as)(const int floats, int pixels, const double *b, double bias,
                             const double *safe_, double least, double *rules) {
    NAMED(moments) safe;
    for (int k = 0; k < 2 * NODES; ++k) safe.b[k] = K(safe_[k]);
    for (int p = 0; p < pixels; p += LANES) {
        SCALAR columns[2 * NODES][LANES];
        columns_of(2 * NODES, pixels - p, b + p * 2 * NODES, columns);
        NAMED(moments) m;
        for (int k = 0; k < 2 * NODES; ++k) m.b[k] = load(columns[k]);
        NAMED(rule) r = NAMED(gauss_rule)(floats, m, K(bias), safe, K(least));
        for (int lane = 0; lane < LANES && p + lane < pixels; ++lane) {
            double *out = rules + (p + lane) * MOIT_RULE_SIZE(2 * NODES);
            for (int i = 0; i < NODES; ++i) {
                out[i] = r.g[i][lane];
                out[NODES + i] = r.e[i][lane];
            }
            out[2 * NODES] = r.d[lane];
        }
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
                             const double *rules, double blur, double slack, double *at_least,
                             double *at_most) {
    for (int p = 0; p < pixels; ++p) {
        if (offsets[p] == offsets[p + 1]) continue;
        NAMED(rule) r = NAMED(load_rule)(rules + p * MOIT_RULE_SIZE(2 * NODES));
        NAMED(moments) m;
        for (int k = 0; k < 2 * NODES; ++k) m.b[k] = K(b[p * 2 * NODES + k]);
        for (int i = offsets[p]; i < offsets[p + 1]; i += LANES) {
            NAMED(certain) c = NAMED(certain_at)(r, m, load(z + i), K(blur), K(slack));
            store(at_least + i, c.at_least);
            store(at_most + i, c.at_most);
        }
    }
}
