// Seven moments m0 .. m6 of a measure on a line, in pairs: the Gauss rule of three nodes, and what
// the distribution with a node at z has there and in front of it.

// Of orthogonal polynomials: a0, what rounding took of it, u1 = a1 - a0, u2 = a2 - a0, s1, s2, s3.
struct recurrence3 { float a0; float low; vec2 u; vec3 s; };

// L D L^T of the matrix of central moments. A pivot not above `least` is rounding alone: there are
// as many nodes as pivots above it, and the recurrence goes on as that of an even spread. Depths
// are at most `most` from 0, and so are a and s, whatever rounding makes of them.
recurrence3 recurrence3_of(pair m0, pair m1, pair m2, pair m3,
                           pair m4, pair m5, pair m6, float least, float most) {
    float r0 = 1.0 / HEAD(m0);
    pair k1 = ratio(m1, m0, r0), k2 = ratio(m2, m0, r0), k3 = ratio(m3, m0, r0);
    pair c11 = pivot_of(reduced_even(m2, m1, k1), least), c21 = reduced(m3, m1, k2);
    pair c31 = reduced_even(m4, m1, k3), c22 = reduced_even(m4, m2, k2);
    pair c32 = reduced(m5, m3, k2), c33 = reduced_even(m6, m3, k3);
    bool one = !(HEAD(c11) > least);
    float r1 = 1.0 / HEAD(c11);
    pair l2 = ratio(c21, c11, r1), l3 = ratio(c31, c11, r1);
    pair d22 = pivot_of(reduced_even(c22, c21, l2), least), d32 = reduced(c32, c31, l2);
    pair d33 = reduced_even(c33, c31, l3);
    bool two = one || !(HEAD(d22) > least);
    float r2 = 1.0 / HEAD(d22);
    pair l32 = ratio(d32, d22, r2);
    float h3 = low_of(d33, d32, l32, HEAD(d33));
    AS_WRITTEN float u1 = less_twice(l2, k1);
    AS_WRITTEN float u2 = less_both(l32, l2, k1);
    recurrence3 o;
    o.a0 = HEAD(k1);
    o.low = TAIL(k1);
    vec2 u = clamp(vec2(u1, u2), vec2(-most - HEAD(k1)), vec2(most - HEAD(k1)));
    o.u = vec2(one ? -HEAD(k1) : u.x, two ? -HEAD(k1) : u.y);
    o.s = vec3(HEAD(c11) * r0, one ? 0.25 : min(HEAD(d22) * r1, most),
               two ? 0.25 : min(max(h3, least) * r2, most));
    return o;
}

// The rule: nodes g in rising order, residues e, d: for p(z) = product of z - g_i the weight of a
// node z is d / (p(z)^2 f'(z)) with f'(z) = 1 + sum of e_i / (z - g_i)^2.
struct rule3 { vec3 g; vec3 e; float d; };

// Torn at the middle of the Jacobi matrix, nodes are where x - u1 = s1 / x + s2 / (x - u2): one
// beyond each pole, one between them. Residues are s3 times eigenvectors' last components squared:
// e = s3 s2 / (d^2 + s2 + s1 (d / other)^2) by distances d from u2 and from the other pole.
rule3 rule3_of(recurrence3 j) {
    float m = (j.u.x + j.u.y) * 0.33333333, d1 = j.u.x - m, d2 = j.u.y - m;
    // the outermost nodes nearly, as roots of the cubic y^3 - 3 q y - 2 r
    float q = max((m * m + (d1 * d1 + (d2 * d2 + 2.0 * (j.s.x + j.s.y)))) * 0.16666667, 1e-30);
    float r = 0.5 * (m * (j.s.y - d1 * d2) - d2 * j.s.x), y = inversesqrt(q);
    float c = less_than_one(max(1.0 - abs(r) * y * (y * y), 0.0)), size = q * y;
    float cosine = size - size * c, side = size * sqrt(3.0 * c * (2.0 - c));
    bool up = r >= 0.0;
    float lowest = up ? -cosine - side : -2.0 * cosine, highest = up ? 2.0 * cosine : side + cosine;
    bool swapped = j.u.y < 0.0;
    float low = min(j.u.y, 0.0), gap = max(abs(j.u.y), 1e-12), high = low + gap;
    float e0 = swapped ? j.s.y : j.s.x, e1 = swapped ? j.s.x : j.s.y, middle = j.u.x - low;
    float s = max(low - m - lowest, 1e-12);
    s = outer_step1(s, 0.5 * middle, e0, e1, gap);
    float t = max(highest + m - high, 1e-12);
    t = outer_step1(t, 0.5 * (gap - middle), e1, e0, gap);
    // those divided out, what is left is rho0 / (x - low) + rho1 / (x - high) = 0
    float sg = s + gap, tg = t + gap, rho0 = e0 * (sg * t), rho1 = e1 * (s * tg);
    float part = gap / (rho0 + rho1), after = rho0 * part, before = rho1 * part;
    // distances of nodes from the pole that is u2, and from the other
    vec3 d = swapped ? vec3(s, after, tg) : vec3(sg, before, t);
    vec3 to_other = d / (swapped ? vec3(sg, before, t) : vec3(s, after, tg));
    rule3 o;
    o.g = vec3(low - s, low + after, high + t) + j.low + j.a0;
    o.e = j.s.z * j.s.y / (d * d + j.s.y + to_other * to_other * j.s.x);
    o.d = j.s.z * j.s.y * j.s.x;
    return o;
}

// d / (p^2 f') by squared distances from the nodes.
float weight3(vec3 a, vec3 e, float d) {
    float ab = a.x * a.y, t = e.x * a.y + (e.y * a.x + ab);
    return d / (t * a.z + e.z * ab);
}
