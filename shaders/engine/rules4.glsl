// Nine moments m0 .. m8 of a measure on a line, in pairs: the Gauss rule of four nodes.
// See rules3.glsl.

// a0 and what rounding took of it; u: a1, a2, a3 less a0; s1 to s4.
struct recurrence4 { float a0; float low; vec3 u; vec4 s; };

recurrence4 recurrence4_of(pair m0, pair m1, pair m2, pair m3,
                           pair m4, pair m5, pair m6, pair m7,
                           pair m8, float least, float most) {
    float r0 = 1.0 / HEAD(m0);
    pair k1 = ratio(m1, m0, r0), k2 = ratio(m2, m0, r0), k3 = ratio(m3, m0, r0);
    pair k4 = ratio(m4, m0, r0), c11 = pivot_of(reduced_even(m2, m1, k1), least);
    pair c21 = reduced(m3, m1, k2), c31 = reduced_even(m4, m1, k3), c41 = reduced(m5, m1, k4);
    pair c22 = reduced_even(m4, m2, k2), c32 = reduced(m5, m3, k2);
    pair c42 = reduced_even(m6, m2, k4), c33 = reduced_even(m6, m3, k3);
    pair c43 = reduced(m7, m3, k4), c44 = reduced_even(m8, m4, k4);
    float r1 = 1.0 / HEAD(c11);
    pair l2 = ratio(c21, c11, r1), l3 = ratio(c31, c11, r1), l4 = ratio(c41, c11, r1);
    pair d22 = pivot_of(reduced_even(c22, c21, l2), least), d32 = reduced(c32, c31, l2);
    pair d42 = reduced(c42, c41, l2), d33 = reduced_even(c33, c31, l3);
    pair d43 = reduced(c43, c41, l3), d44 = reduced_even(c44, c41, l4);
    float r2 = 1.0 / HEAD(d22);
    pair n3 = ratio(d32, d22, r2), n4 = ratio(d42, d22, r2);
    pair h33 = pivot_of(reduced_even(d33, d32, n3), least), h43 = reduced(d43, d42, n3);
    pair h44 = reduced_even(d44, d42, n4);
    float r3 = 1.0 / HEAD(h33);
    pair p4 = ratio(h43, h33, r3);
    AS_WRITTEN float u1 = less_twice(l2, k1);
    AS_WRITTEN float u2 = less_both(n3, l2, k1);
    AS_WRITTEN float u3 = less_both(p4, n3, k1);
    float s4 = max(low_of(h44, h43, p4, HEAD(h44)), least) * r3;
    bool one = !(HEAD(c11) > least), two = one || !(HEAD(d22) > least),
         three = two || !(HEAD(h33) > least);
    vec3 u = clamp(vec3(u1, u2, u3), vec3(-most - HEAD(k1)), vec3(most - HEAD(k1)));
    recurrence4 o;
    o.a0 = HEAD(k1);
    o.low = TAIL(k1);
    o.u = vec3(one ? -HEAD(k1) : u.x, two ? -HEAD(k1) : u.y, three ? -HEAD(k1) : u.z);
    o.s = vec4(HEAD(c11) * r0, one ? 0.25 : min(HEAD(d22) * r1, most),
               two ? 0.25 : min(HEAD(h33) * r2, most), three ? 0.25 : min(s4, most));
    return o;
}

struct rule4 { vec4 g; vec4 e; float d; };

// WIDE_RANGE  where nodes may lie much closer together than the farthest are apart.

// Torn at a2, nodes are where x - u2 = sum of q_i / (x - pole_i); the poles: the two nodes of a0,
// u1 and s1, with residues that sum to s2, and u3 with residue s3. To begin with, outermost nodes
// are roots of a quartic (y^2 + S y + ..)(y^2 - S y + ..), S^2 being the largest root of the
// resolvent cubic.
rule4 rule4_of(recurrence4 j) {
    float half_u = 0.5 * j.u.x, big = abs(half_u) + sqrt(half_u * half_u + j.s.x);
    float small = j.s.x / big, share = j.s.y / (big * big + j.s.x);
    float of_big = share * (big * big), of_small = share * j.s.x;
    bool up = half_u >= 0.0;
    float pl = up ? -small : -big, ph = up ? big : small, rl = up ? of_small : of_big;
    float rh = up ? of_big : of_small;
    bool first = j.u.z < pl, before = j.u.z < ph;
    float p0 = min(pl, j.u.z), p2 = max(ph, j.u.z), p1 = min(max(pl, j.u.z), ph);
    float q0 = first ? j.s.z : rl, q1 = first ? rl : (before ? j.s.z : rh);
    float q2 = before ? rh : j.s.z;
    float l = max(p1 - p0, 1e-12), h = max(p2 - p1, 1e-12), g = l + h;
    // the outermost nodes nearly, as roots of y^4 + P y^2 + Q y + R
    float m = 0.25 * (j.u.x + j.u.y + j.u.z), d1 = j.u.x - m, d2 = j.u.y - m, d3 = j.u.z - m;
    float su = d1 - m, pu = -m * d1 - j.s.x, pv = d2 * d3 - j.s.z, P = pu + pv - (su * su + j.s.y);
    float Q = su * (pu - pv) + j.s.y * (d3 - m), R = pu * pv + j.s.y * m * d3;
    float third = (P * (P * P - 36.0 * R) + 13.5 * Q * Q) * 0.037037037;
    float z = max(cubic_high((P * P + 12.0 * R) * 0.11111111, third) - 0.66666667 * P, 1e-12);
    float per = inversesqrt(z), S = z * per, k = -2.0 * P - z, d = 2.0 * Q * per;
    float s = max(p0 - m + 0.5 * (S + sqrt(max(k + d, 0.0))), 1e-12);
    float t = max(m + 0.5 * (S + sqrt(max(k - d, 0.0))) - p2, 1e-12);
    float below = 0.5 * (j.u.y - p0), above = 0.5 * (p2 - j.u.y);
    s = outer_step2(s, below, q0, vec2(q1, q2), vec2(l, g));
    t = outer_step2(t, above, q2, vec2(q1, q0), vec2(h, g));
#ifdef WIDE_RANGE
    s = outer_step2(s, below, q0, vec2(q1, q2), vec2(l, g));
    t = outer_step2(t, above, q2, vec2(q1, q0), vec2(h, g));
#endif
    // those divided out: the sum of rho_i / (x - pole_i) = 0, rho summing to 1
    float sl = s + l, sg = s + g, th = t + h, tg = t + g, rho0 = q0 / (s * tg);
    float rho1 = q1 / (sl * th), rho2 = q2 / (sg * t), B = l * (rho1 + rho2) - h * (rho0 + rho1);
    float lh = rho1 * l * h, wide = 0.5 * (abs(B) + sqrt(B * B + 4.0 * lh)), narrow = lh / wide;
    // how far the middle nodes are below and above the middle pole, and from the poles beside it
    float y = B > 0.0 ? wide : narrow, x = B > 0.0 ? narrow : wide, yh = y + h, xl = x + l;
    float a = rho0 * l * g / xl, c = rho2 * h * g / yh;
    // distances of nodes from each pole: from that which is u3, and ratios to the others
    vec4 e0 = vec4(s, a, xl, tg), e1 = vec4(sl, y, x, th), e2 = vec4(sg, yh, c, t);
    vec4 own = first ? e0 : (before ? e1 : e2), to_low = own / (first ? e1 : e0);
    vec4 to_high = own / (before ? e2 : e1);
    rule4 o;
    o.g = vec4(p0 - s, p1 - y, p1 + x, p2 + t) + j.low + j.a0;
    o.e = j.s.w * j.s.z
          / (own * own + j.s.z + (to_low * to_low * rl + to_high * to_high * rh));
    o.d = j.s.w * j.s.z * j.s.x * j.s.y;
    return o;
}

// d / (p^2 f') by squared distances from the nodes.
float weight4(vec4 a, vec4 e, float d) {
    float ab = a.x * a.y, cd = a.z * a.w, x = e.x * a.y + e.y * a.x;
    float y = e.z * a.w + (e.w * a.z + cd);
    return d / (x * cd + y * ab);
}

// The outermost node of the distribution with a node at z is s before the first of the rule, where
// C / s + A / (s + a) = F(s) = 1 + sum of B / (s + gaps); the other nodes of the rule are at a and
// gaps from the first. A better s: F as a constant and a pole at -a that agree in value and slope.
float outermost4(float s, float a, vec2 gaps, float C, float A, vec2 B) {
    vec2 y = 1.0 / (s + gaps), t = B * y;
    float sa = s + a, K = dot(t, y) * sa, fall = t.x + t.y + 1.0 - K;
    return half_root(fall, 0.5 * (a * fall + (K * sa - (A + C))), C * a);
}

// To begin with, that pole as large as is right between 0 and far out.
float outermost4_nearly(float a, vec2 gaps, float C, float A, vec2 B) {
    vec2 t = B / gaps;
    float M = t.x + t.y, fall = 0.5 * (M - M * a / gaps.x) + 1.0;
    return half_root(fall, 0.5 * (a * (M + 1.0) - (A + C)), C * a);
}

// The second, y before the second of the rule, where one is in front. The outermost divided out,
// E1 / y = E0 / (a - y) + sum of E / (y + gaps), E01 being E0 + E1. A better y: the last two as one
// pole that agrees in value and slope at y.
float second4(float y, float a, vec2 gaps, float E01, float E1, vec2 E) {
    vec2 r = 1.0 / (y + gaps), t = E * r;
    float F = t.x + t.y, K = dot(t, r), M = F - y * K, E1a = E1 * a;
    return half_root(E01 * K - F * F, 0.5 * (F * F * a + E01 * M - E1a * K), E1a * M);
}
