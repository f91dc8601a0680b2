/* Stages of Moment Transparency beside those of power moments. */

static void scaled_absorbance_stage(int n, const void *alpha_, double max_alpha, void *out_) {
    const SCALAR *alpha = alpha_;
    SCALAR *out = out_;
    const real shrink = K(1.0 - max_alpha);
    for (int i = 0; i < n; i += LANES)
        store(out + i, scaled_absorbance(load_at_most(alpha + i, n - i), shrink));
}

static void half_absorbance_stage(int n, const void *b0_, void *out_) {
    const SCALAR *b0 = b0_;
    SCALAR *out = out_;
    for (int i = 0; i < n; i += LANES)
        store_at_most(out + i, half_absorbance(load_at_most(b0 + i, n - i)), n - i);
}

static void occluded_stage(int n, const void *a_, const void *T_, void *out_) {
    const SCALAR *a = a_, *T = T_;
    SCALAR *out = out_;
    for (int i = 0; i < n; i += LANES) store(out + i, load(a + i) * load(T + i));
}

static void dimmest_stage(int n, void *T_) {
    SCALAR *T = T_;
    for (int i = 0; i < n; i += LANES) store(T + i, next_to_nothing(load(T + i)));
}

static void second_pass_stage(int pixels, const int32_t *offsets, const void *b0_,
                              const void *second_, void *T_) {
    const SCALAR *b0 = b0_, *second = second_;
    SCALAR *T = T_;
    for (int p = 0; p < pixels; ++p) {
        if (offsets[p] == offsets[p + 1]) continue;
        real ratio = covered_ratio(K(b0[p]), K(second[p]));
        for (int i = offsets[p]; i < offsets[p + 1]; i += LANES) {
            int left = offsets[p + 1] - i;
            store_at_most(T + i, two_pass_transmittance(load_at_most(T + i, left), ratio), left);
        }
    }
}

#ifdef RULES /* double tables only */
#define NODES 2
#include "kernels/nonlinear_moments.h"
#undef NODES

static void unorm16_moments_stage(bool symmetric, int pixels, double *b, double *words) {
    for (int p = 0; p < pixels; p += LANES) {
        four m;
        for (int k = 0; k < 4; ++k)
            for (int lane = 0; lane < LANES; ++lane)
                m.x[k][lane] = b[(p + lane < pixels ? p + lane : p) * 4 + k];
        four w = symmetric ? symmetric_words(m) : unit_words(m);
        m = symmetric ? symmetric_moments(w) : unit_moments(w);
        for (int lane = 0; lane < LANES && p + lane < pixels; ++lane)
            for (int k = 0; k < 4; ++k) {
                b[(p + lane) * 4 + k] = m.x[k][lane];
                if (words) words[(p + lane) * 4 + k] = w.x[k][lane];
            }
    }
}

static void nonlinear_moments_stage(double low, double extent, int pixels, double *rules,
                                    double *words) {
    for (int p = 0; p < pixels; p += LANES) {
        rule2 r;
        for (int lane = 0; lane < LANES; ++lane) {
            const double *rule = rules + (p + lane < pixels ? p + lane : p) * MOIT_RULE_SIZE(4);
            for (int i = 0; i < 2; ++i) {
                r.g[i][lane] = rule[i];
                r.e[i][lane] = rule[2 + i];
            }
            r.d[lane] = rule[4];
        }
        nonlinear2 w = nonlinear_words2(nonlinear_of2(r), K(low), K(extent));
        r = rule_of_nonlinear2(nonlinear_values2(w, K(low), K(extent)));
        for (int lane = 0; lane < LANES && p + lane < pixels; ++lane) {
            double *rule = rules + (p + lane) * MOIT_RULE_SIZE(4);
            for (int i = 0; i < 2; ++i) {
                rule[i] = r.g[i][lane];
                rule[2 + i] = r.e[i][lane];
                if (words) words[(p + lane) * 4 + i] = w.node[i][lane];
            }
            rule[4] = r.d[lane];
            if (words) {
                words[(p + lane) * 4 + 2] = w.weight[lane];
                words[(p + lane) * 4 + 3] = w.offset[lane];
            }
        }
    }
}
#define UNORM16_MOMENTS_STAGE unorm16_moments_stage
#define NONLINEAR_MOMENTS_STAGE nonlinear_moments_stage
#else
#define UNORM16_MOMENTS_STAGE NULL
#define NONLINEAR_MOMENTS_STAGE NULL
#endif
