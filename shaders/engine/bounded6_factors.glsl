// What the fragments of a pixel share of six moments: the rule of three nodes, and what of it the
// network of bounded6.glsl sees.

// Nodes, b0; residues, d; the first layer's sums; mean depth, what rounding took of it,
// 1 / deviation.
struct factors { vec4 factor0; vec4 factor1; vec4 factor2; vec4 factor3; vec4 factor4; };

// What output j of the first layer has of the inputs that a pixel's fragments share.
float begun(int j, vec4 seen, vec2 high) {
    int k = EACH * j + 4;
    return weighed(k, seen, NETWORK[k + 4] * high.x + (NETWORK[k + 5] * high.y + NETWORK[k + 6]));
}

// unit: how long z's unit is in the range of depth whose deviations the network knows.
factors factor_within(sums t, float unit) {
    recurrence3 r = recurrence_of_sums(t);
    rule3 q = rule3_of(r);
    // The moments of z less its mean in deviations are sums over the ways from the first polynomial
    // back to it, by recurrence coefficients in deviations. With the smallest they stay finite
    float variance = max(r.s.x, 1e-18), per = inversesqrt(variance);
    float u = r.u.x * per, v = r.u.y * per, s2 = r.s.y * per * per, s3 = r.s.z * per * per;
    float both = u + v, fourth = u * u + (s2 + 1.0), fifth = u * (u * u + 2.0) + s2 * (u + both);
    float sixth = u * u + (fourth * fourth + s2 * (both * both + s3));
    // logarithms of total and deviation, skewness, logarithm of kurtosis; and of the fifth, with
    // its sign, and the sixth
    float size = 0.69314718 * log2(min(abs(fifth), 22000.0) + 1.0);
    vec4 seen = vec4(clamp(0.69314718 * log2(max(t.target2, 1e-30)), -8.0, 8.0),
                     max(0.34657359 * log2(variance * (unit * unit)), -8.0), clamp(u, -6.0, 6.0),
                     0.69314718 * log2(clamp(fourth, 1.0, 403.428793)));
    vec2 high = vec2(fifth < 0.0 ? -size : size, 0.69314718 * log2(clamp(sixth, 1.0, 160000.0)));
    factors o;
    o.factor0 = vec4(q.g, t.target2);
    o.factor1 = vec4(q.e, q.d);
    o.factor2 = vec4(begun(0, seen, high), begun(1, seen, high), begun(2, seen, high),
                     begun(3, seen, high));
    o.factor3 = vec4(begun(4, seen, high), begun(5, seen, high), begun(6, seen, high),
                     begun(7, seen, high));
    o.factor4 = vec4(r.a0, r.low, per, 0.0);
    return o;
}
