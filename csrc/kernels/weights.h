// Weights of weighted blended order-independent transparency: how much a fragment counts, from its
// own depth, opacity and colour alone.
//
// McGuire and Bavoil, "Weighted Blended Order-Independent Transparency", JCGT 2(2), 2013, equations
// 7 to 10 (each there already contains alpha); McGuire's post on implementing it, 2015 (`blog`);
// the `phenomenological` form goes with McGuire and Mara, "Phenomenological Transparency", 2017. It
// is the one in wide use, for one scene's range of depths as good as another; listing 1 of their
// paper of 2016 has clamp(1e3 alpha (1 - 0.99 d)^3, 1e-2, 30), and later versions other constants.
// Where there is coloured transmission their alpha is the net coverage, here too.

#include "kernels/options.h"

// z > 0 is the distance from the eye in the scene units the constants were tuned for, d in [0, 1]
// the value a depth buffer would hold, alpha the net coverage, bright the largest channel of what
// is emitted, colour times opacity.
FN number blend_weight(int kind, real z, real d, real alpha, real bright) {
    real w = alpha;
    if (kind == WEIGHT_BLOG || kind == WEIGHT_EQ9) {
        real far = z * K(1.0 / 200.0);
        far = far * far;
        real fall = clamp(K(0.03) / (K(1e-5) + far * far), K(1e-2), K(3e3));
        if (kind == WEIGHT_BLOG) w = max(min(K(1.0), bright), alpha);
        w = w * fall;
    }
    if (kind == WEIGHT_EQ7 || kind == WEIGHT_EQ8) {
        real far = z * K(1.0 / 200.0);
        far = far * far * far;
        real near = z * K(1.0 / 10.0);
        near = near * near * near;
        if (kind == WEIGHT_EQ7) near = z * z * K(1.0 / 25.0);
        w = w * clamp(K(10.0) / (K(1e-5) + near + far * far), K(1e-2), K(3e3));
    }
    if (kind == WEIGHT_EQ10) {
        real front = 1.0 - d;
        w = w * max(K(1e-2), K(3e3) * front * front * front);
    }
    if (kind == WEIGHT_PHENOMENOLOGICAL) {
        real opaque = min(K(1.0), 10.0 * alpha) + K(0.01);
        real front = 1.0 - K(0.9) * d;
        w = clamp(opaque * opaque * opaque * K(1e8) * front * front * front, K(1e-2), K(3e3));
    }
    return w;
}
