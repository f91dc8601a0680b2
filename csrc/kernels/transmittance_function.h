// Transmittance function maps: the transmittance itself as a series of cosines of depth.
//
// Delalandre, Gautron, Marvie and Francois, "Transmittance Function Mapping", I3D 2011, who march
// along rays and sum up what they meet. Between surfaces at depths d in [0, 1] transmittance is
// constant, so its projection is known in closed form. It drops at a surface of opacity alpha by
// w = alpha T(d), T in front of it, which in the orthonormal basis 1, sqrt(2) cos(pi k d) makes
//     c_0 = total + sum of w d,   c_k = sqrt(2) / (pi k) sum of w sin(pi k d)
// and back, the nearest function that n cosines can give in the mean square,
//     T(d) = c_0 + sum over k = 1 .. n - 1 of c_k sqrt(2) cos(pi k d).
// As the drops and the total sum to 1, c_0 is also 1 - sum of w (1 - d). Where surfaces lie at the
// near end only that would be a difference of rounding, and their weights, relative to their sum,
// would hang on the order of what is added; here all digits are kept.

#ifndef MOIT_TRANSMITTANCE_FUNCTION_H
#define MOIT_TRANSMITTANCE_FUNCTION_H

#define MOST_COSINES 32

STRUCT(cosine_series) { number c[MOST_COSINES]; };

// What a drop of the transmittance by w at d adds to the two kinds of sums above.
FN cosine_series series_of_drop(int cosines, real w, real d) {
    PRECISE cosine_series s;
    circle_point once = sine_cosine(0.5 * d);
    circle_point p = once;
    s.c[0] = w * d;
    for (int k = 1; k < cosines; ++k) {
        s.c[k] = w * p.sine;
        p = turned(p, once);
    }
    return s;
}

// The coefficients c_k from these sums, and the transmittance of all.
FN cosine_series projected(int cosines, cosine_series sums, real total) {
    PRECISE cosine_series s;
    s.c[0] = total + sums.c[0];
    for (int k = 1; k < cosines; ++k) s.c[k] = sums.c[k] * (K(0.45015815807855303478) / K(k));
    return s;
}

// The transmittance in front of d, within [total, 1] as far as is known. `own` is the opacity of
// the surface that asks: of the drop at its own depth, own T, the series shows a share of about a
// half, which is undone; 0 as published. An empty ray (1, 0, 0, ..) gives 1.
FN number function_transmittance(int cosines, cosine_series s, real total, real d, real own) {
    circle_point once = sine_cosine(0.5 * d);
    circle_point p = once;
    real T = s.c[0];
    real own_share = 1.0 - d;
    for (int k = 1; k < cosines; ++k) {
        T = T + s.c[k] * (K(1.4142135623730950488) * p.cosine);
        own_share = own_share - (K(0.63661977236758134308) / K(k)) * (p.sine * p.cosine);
        p = turned(p, once);
    }
    real left = 1.0 - own; // above 0, and no share is above 1
    T = T / max(1.0 - own * own_share, left);
    return clamp(T, min(total / left, K(1.0)), K(1.0));
}

#endif
