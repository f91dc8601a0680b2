// Five moments m0 .. m4 of a measure on a line, in pairs: the recurrence coefficients of their
// orthogonal polynomials, and what the distribution with a node at z has there and in front of it.

// a0 and what rounding took of it, half of u = a1 - a0, s1, half of s2, h = s1 s2.
struct recurrence2 { float a0; float low; float half_u; float s1; float half_s2; float h; };

// L D L^T of the matrix of central moments. A pivot not above `least` is rounding alone: there are
// as many nodes as pivots above it, and the recurrence goes on as that of an even spread. Depths
// are at most `most` from 0, and so are a1 and s2, whatever rounding makes of them.
recurrence2 recurrence2_of(pair m0, pair m1, pair m2, pair m3,
                           pair m4, float least, float most) {
    float r0 = 1.0 / HEAD(m0);
    pair k1 = ratio(m1, m0, r0), k2 = ratio(m2, m0, r0);
    pair c11 = pivot_of(reduced_even(m2, m1, k1), least), c21 = reduced(m3, m1, k2);
    pair c22 = reduced_even(m4, m2, k2);
    bool one = !(HEAD(c11) > least);
    float r1 = 1.0 / HEAD(c11);
    pair l2 = ratio(c21, c11, r1);
    float rest = low_of(c22, c21, l2, HEAD(c22));
    AS_WRITTEN float u = less_twice(l2, k1);
    recurrence2 o;
    o.a0 = HEAD(k1);
    o.low = TAIL(k1);
    o.half_u = 0.5 * (one ? -HEAD(k1) : clamp(u, -most - HEAD(k1), most - HEAD(k1)));
    o.s1 = HEAD(c11) * r0;
    float s2 = one ? 0.25 : min(max(rest, least) * r1, most);
    o.half_s2 = 0.5 * s2;
    o.h = o.s1 * s2;
    return o;
}

// What is at z and in front of it. With d = z - a0 and p = s1 - d (d - u) = -p2(z), the weight at
// z is w = h / (h + s2 d^2 + p^2) (Christoffel). Where p > 0, one node lies on each side of z, at
// (B -+ R) / p from a0 with B = (u p + s2 d) / 2, R^2 = B^2 + p (p s1 + h). As weights sum to 1 and
// their mean is a0, in front of z are ((1 - w) + ((1 - w) B + w p d) / R) / 2: no root is taken.
// Elsewhere p counts as 0 there, which gives 0 or 1 - w.
vec2 mass2_at(recurrence2 r, float z) {
    precise float d = (z - r.a0) - r.low;
    float p = (2.0 * r.half_u - d) * d + r.s1, e = r.half_s2 * d;
    float w = r.h / (p * p + (e * (2.0 * d) + r.h)), q = max(p, 0.0), B = r.half_u * q + e;
    float per = inversesqrt(B * B + q * (q * r.s1 + r.h));
    float sides = (w * (q * d - B) + B) * per; // of 1 - w: in front less behind
    return vec2(w, 0.5 * sides + (0.5 - 0.5 * w));
}
