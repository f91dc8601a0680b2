/* C's reading of the kernels as loops over arrays, one lane wide: what tests hold GLSL's reading
 * to. Compiled once per precision with -DSCALAR=float or double. Rules lie as shaders/ has
 * them: nodes, what rounding took from them, residues, the pivot. */
#define LANES 1
#define NAMED(name) JOIN(name, NODES)
#include "kernels/dialect.h"
#include "kernels/elementary.h"
#define WIDEST 32
#include "kernels/network.h"
#include "kernels/deep_fragments.h"
#include "kernels/pairs.h"
#include "kernels/storage.h"
#include "kernels/surface.h"
#include "kernels/upsampling.h"
#include "kernels/moment_transparency.h"
#include "kernels/weights.h"
#include "kernels/hashing.h"
#include "kernels/stochastic.h"

#define OF_ONE(function) \
    void function##s(int n, const SCALAR *x, SCALAR *y) { \
        for (int i = 0; i < n; ++i) y[i] = function(K(x[i]))[0]; \
    }
OF_ONE(exponential)
OF_ONE(logarithm)
OF_ONE(rounded_to_half)
OF_ONE(rounded_to_single)
OF_ONE(unorm16_word)
OF_ONE(unorm16_value)
OF_ONE(unorm8_byte)
OF_ONE(unorm8_value)
OF_ONE(absorbance)
OF_ONE(cosine_of_turns)
OF_ONE(sine_of_turns)
OF_ONE(covered_by)

void circle_points(int n, const SCALAR *x, SCALAR *found) {
    for (int i = 0; i < n; ++i) {
        circle_point p = sine_cosine_of_angle(K(x[i]));
        found[2 * i] = p.cosine[0];
        found[2 * i + 1] = p.sine[0];
    }
}

/* f: z, d, alpha and bright of each fragment */
void blend_weights(int kind, int n, const SCALAR *f, SCALAR *w) {
    for (int i = 0; i < n; ++i, f += 4)
        w[i] = blend_weight(kind, K(f[0]), K(f[1]), K(f[2]), K(f[3]))[0];
}

/* q: weights of the second and third corner, 1/z, an attribute and normals of all three, and the
 * direction along which the point is seen */
void surface_points(int n, const SCALAR *q, SCALAR *found) {
    for (int i = 0; i < n; ++i, q += 19, found += 3) {
        real inverse_z[3] = {K(q[2]), K(q[3]), K(q[4])}, normal[3];
        surface_point p = point_of_surface(K(q[0]), K(q[1]), inverse_z);
        for (int k = 0; k < 3; ++k)
            normal[k] = interpolated(p, K(q[8 + k]), K(q[11 + k]), K(q[14 + k]));
        found[0] = p.z[0];
        found[1] = interpolated(p, K(q[5]), K(q[6]), K(q[7]))[0];
        found[2] = lambert(normal, K(q[17]), K(q[18]))[0];
    }
}

/* q: where between four squares, and the depth of a surface and of the squares' four */
void upsampling_shares(int n, const SCALAR *q, SCALAR *found) {
    for (int i = 0; i < n; ++i, q += 7, found += 8) {
        four_shares s = bilinear_shares(K(q[0]), K(q[1])),
                    o = depth_aware_shares(s, K(q[2]), K(q[3]), K(q[4]), K(q[5]), K(q[6]));
        real all[8] = {s.upper_left, s.upper_right, s.lower_left, s.lower_right,
                       o.upper_left, o.upper_right, o.lower_left, o.lower_right};
        for (int k = 0; k < 8; ++k) found[k] = all[k][0];
    }
}

void mixed_words(int n, const uint32_t *h, uint32_t *out) {
    for (int i = 0; i < n; ++i) out[i] = mixed(U(h[i]))[0];
}

void random_shares(int n, const uint32_t *key, int each, SCALAR *out) {
    for (int i = 0; i < n * each; ++i) out[i] = random_share(U(key[i / each]), i % each)[0];
}

void fragment_keys(int n, int seed, const uint32_t *row, const uint32_t *column,
                   const SCALAR *depth, const SCALAR *alpha, uint32_t *key) {
    for (int i = 0; i < n; ++i)
        key[i] = fragment_key(U(seed), U(row[i]), U(column[i]), K(depth[i]), K(alpha[i]))[0];
}

void coverages(int n, const uint32_t *key, const uint32_t *twin, const SCALAR *alpha, int samples,
               int stratified, uint32_t *words) {
    for (int i = 0; i < n; ++i) {
        coverage c = coverage_of(U(key[i]), U(twin[i]), K(alpha[i]), samples, stratified);
        words[2 * i] = c.low[0];
        words[2 * i + 1] = c.high[0];
    }
}

/* kept: four words, and the moments that they decode to */
void quantised_moments(int n, const SCALAR *b, int symmetric, SCALAR *kept) {
    for (int i = 0; i < n; ++i, b += 4, kept += 8) {
        four m = {{K(b[0]), K(b[1]), K(b[2]), K(b[3])}};
        four w = symmetric ? symmetric_words(m) : unit_words(m);
        m = symmetric ? symmetric_moments(w) : unit_moments(w);
        for (int k = 0; k < 4; ++k) {
            kept[k] = w.x[k][0];
            kept[4 + k] = m.x[k][0];
        }
    }
}

#define NODES 2
#include "kernels/power_moments.h"
#include "kernels/power_rules.h"
#include "kernels/power_bounds.h"
#undef NODES
#define NODES 3
#include "kernels/power_moments.h"
#include "kernels/power_rules.h"
#include "kernels/power_bounds.h"
#undef NODES
#define NODES 4
#include "kernels/power_moments.h"
#include "kernels/power_rules.h"
#include "kernels/power_bounds.h"
#undef NODES

#define FOR_NODES(n) \
    static moments##n moments_at##n(const SCALAR *b) { \
        moments##n m; \
        for (int k = 0; k < 2 * n; ++k) m.b[k] = K(b[k]); \
        return m; \
    } \
    void power_rules##n(int floats, int rays, const SCALAR *b, SCALAR bias, const SCALAR *safe, \
                        SCALAR least, SCALAR *rules) { \
        for (int i = 0; i < rays; ++i, b += 2 * n, rules += 3 * n + 1) { \
            rule##n r = \
                gauss_rule##n(floats, moments_at##n(b), K(bias), moments_at##n(safe), K(least)); \
            for (int k = 0; k < n; ++k) { \
                rules[k] = r.g[k][0]; \
                rules[n + k] = r.g_low[k][0]; \
                rules[2 * n + k] = r.e[k][0]; \
            } \
            rules[3 * n] = r.d[0]; \
        } \
    } \
    void power_bounds##n(int count, const SCALAR *rules, const SCALAR *b, const int *ray_of, \
                         const SCALAR *z, SCALAR blur, SCALAR slack, SCALAR *shares) { \
        for (int i = 0; i < count; ++i) { \
            const SCALAR *p = rules + ray_of[i] * (3 * n + 1); \
            rule##n r; \
            for (int k = 0; k < n; ++k) { \
                r.g[k] = K(p[k]); \
                r.g_low[k] = K(p[n + k]); \
                r.e[k] = K(p[2 * n + k]); \
            } \
            r.d = K(p[3 * n]); \
            certain##n c = certain_at##n(r, moments_at##n(b + ray_of[i] * 2 * n), K(z[i]), \
                                         K(blur), K(slack)); \
            shares[2 * i] = c.at_least[0]; \
            shares[2 * i + 1] = c.at_most[0]; \
        } \
    }
FOR_NODES(2)
FOR_NODES(3)
FOR_NODES(4)

#define NODES 2
#include "kernels/nonlinear_moments.h"
#undef NODES

void nonlinear_share(int count, const SCALAR *support, const SCALAR *weight, const SCALAR *offset,
                     const SCALAR *z, const SCALAR *beta, SCALAR *share) {
    for (int i = 0; i < count; ++i) {
        nonlinear2 n = {{K(support[2 * i]), K(support[2 * i + 1])}, K(weight[i]), K(offset[i])};
        masses2 mass = masses_at2(rule_of_nonlinear2(n), K(z[i]));
        share[i] = mass.in_front[0] + beta[i] * mass.at[0];
    }
}
