// Moments of absorbance in half floats, to which blending adds each fragment's terms.
//
// A pixel holds sums of absorbance a and of a times functions of depth z in [-1, 1]: powers z^k, or
// Chebyshev polynomials T_k(z). A target of half floats rounds after each addition, so sums hang
// on the order of arrival in their last digits; no fragment reads what it changes, and no access
// has to be ordered. Where a pixel's fragments fill [-1, 1], as they do in their own extent
// (own_extent.h), what is rounded off T_k moves moments less than what is rounded off z^k; where
// they fill a small part of the image's range, powers are smaller, and keep more digits.
//
// Included once for each count of nodes, with NODES defined as 1, 2, 3 or 4, after power_moments.h.

// b0, and the sums of the 2 NODES functions.
STRUCT(NAMED(half_sums)) {
    number b0;
    number sum[2 * NODES];
};

FN NAMED(half_sums) NAMED(nothing_in_halves)() {
    NAMED(half_sums) s;
    s.b0 = K(0.0);
    for (int k = 0; k < 2 * NODES; ++k) s.sum[k] = K(0.0);
    return s;
}

// What a fragment of absorbance `a` at z adds.
FN NAMED(half_sums) NAMED(half_terms)(int chebyshev, real a, real z) {
    PRECISE NAMED(half_sums) t;
    t.b0 = a;
    real here = a;
    real before = a * z; // T_-1 = T_1
    if (chebyshev == 0) before = K(0.0);
    for (int k = 0; k < 2 * NODES; ++k) {
        real next = here * z;
        if (chebyshev != 0) next = 2.0 * next - before;
        t.sum[k] = next;
        before = here;
        here = next;
    }
    return t;
}

FN NAMED(half_sums) NAMED(added_in_halves)(NAMED(half_sums) s, NAMED(half_sums) t) {
    NAMED(half_sums) o;
    o.b0 = half_sum(s.b0, t.b0);
    for (int k = 0; k < 2 * NODES; ++k) o.sum[k] = half_sum(s.sum[k], t.sum[k]);
    return o;
}

// Mean powers of depth from what a pixel holds; 0 where b0 is. Rounding leaves means in [-1, 1],
// as it may sums not.
FN NAMED(moments) NAMED(moments_of_halves)(int chebyshev, NAMED(half_sums) s) {
    PRECISE NAMED(moments) m;
    real mean[8];
    real total = select(s.b0 > 0.0, s.b0, K(1.0));
    for (int k = 0; k < 8; ++k) mean[k] = K(0.0);
    for (int k = 0; k < 2 * NODES; ++k) mean[k] = clamp(s.sum[k] / total, K(-1.0), K(1.0));
    if (chebyshev != 0) {
        // x^k as a mean of T_k, T_k-2, ..: of terms of one sign but for the means' own
        real t1 = mean[0];
        real t2 = mean[1];
        real t3 = mean[2];
        real t4 = mean[3];
        real t5 = mean[4];
        real t6 = mean[5];
        real t7 = mean[6];
        real t8 = mean[7];
        mean[1] = 0.5 * (t2 + 1.0);
        mean[2] = 0.25 * (t3 + 3.0 * t1);
        mean[3] = 0.125 * (t4 + 4.0 * t2 + 3.0);
        mean[4] = 0.0625 * (t5 + 5.0 * t3 + 10.0 * t1);
        mean[5] = 0.03125 * (t6 + 6.0 * t4 + 15.0 * t2 + 10.0);
        mean[6] = 0.015625 * (t7 + 7.0 * t5 + 21.0 * t3 + 35.0 * t1);
        mean[7] = 0.0078125 * (t8 + 8.0 * t6 + 28.0 * t4 + 56.0 * t2 + 35.0);
    }
    for (int k = 0; k < 2 * NODES; ++k) m.b[k] = select(s.b0 > 0.0, mean[k], K(0.0));
    return m;
}
