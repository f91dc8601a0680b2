#ifndef KEEPS_FIRST
// a0, what rounding took of it, half of u and s2; s1, h, -b0 log2(e), b0.
struct factors { vec4 factor0; vec4 factor1; };
#else
// a0, what rounding took of it, half of u and s2; s1, h, -b0 log2(e), b0. Then the first set's.
struct factors { vec4 factor0; vec4 factor1; vec4 factor2; vec4 factor3; };
#endif

factors factor(sums t) {
    recurrence2 r = recurrence_of_sums(t.target0, t.target1);
    factors o;
    o.factor0 = held_of(r);
    o.factor1 = vec4(r.s1, r.h, -1.44269504 * t.target1, t.target1);
#ifdef KEEPS_FIRST
    o.factor2 = o.factor0;
    o.factor3 = o.factor1;
#endif
    return o;
}

// What reaches z of depth as moments have it; beta: the share of what is there that counts.
float transmittance_at(factors f, float z, float beta, float alpha) {
    vec2 m = mass2_at(recurrence_held(f.factor0, f.factor1.x, f.factor1.y), z);
    return transmittance_through(m.x, m.y, f.factor1.z, beta, alpha);
}
