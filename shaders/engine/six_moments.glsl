// Six power moments of depth, what is made of them once a pixel, moved toward those of a safe
// distribution, V2, V4 and V6 (MBOIT 4.1, its supplement), and what they say of a depth.
//
// PUBLISHED_BIAS  what outweighs rounding by itself; `sums`: of the text that includes this
const vec3 SAFE = BY_WORDS(vec3(0.48, 0.451, 0.45), vec3(0.5566, 0.489, 0.47869382));
#define V2 SAFE.x
#define V4 SAFE.y
#define V6 SAFE.z

recurrence3 recurrence_of_sums(sums t) {
    float b0 = max(t.target2, 1e-12), g = BIAS / (1.0 - BIAS) * b0;
    float least = max(ROUNDING * (1.0 - BIAS / PUBLISHED_BIAS), 1e-15) * BY_STORAGE(b0, (b0 + g));
    return recurrence3_of(
        pivot_of(PAIR(b0, g), 0.0), ALONE(SUM_WITHIN(t.target0.x, b0)),
        PAIR(SUM_WITHIN(t.target0.y, b0), g * V2), ALONE(SUM_WITHIN(t.target0.z, b0)),
        PAIR(SUM_WITHIN(t.target0.w, b0), g * V4), ALONE(SUM_WITHIN(t.target1.x, b0)),
        PAIR(SUM_WITHIN(t.target1.y, b0), g * V6), least, 1.0);
}

// What is at z and in front of it, by nodes, residues and d of the rule. Of the distribution with a
// node at z, the other three nodes lie one in each interval that z is not in; only the outermost on
// the side where there is one is computed.
vec2 mass3_at(vec3 nodes, vec3 e, float d, float z) {
    precise float u0 = nodes.x - z; // so that 0 has the right sign below
    precise float u1 = nodes.y - z, u2 = nodes.z - z;
    float w = weight3(vec3(u0 * u0, u1 * u1, u2 * u2), e, d);
    // Where two nodes lie in front of z, the ray is seen from its end. v: distances from z
    bool mirrored = u1 < 0.0;
    float v0 = mirrored ? u2 : -u0, v1 = max(abs(u1), 1e-15), v2 = mirrored ? -u0 : u2;
    float e0 = mirrored ? e.z : e.x, e2 = mirrored ? e.x : e.z;
    // The outermost node, s beyond the first of the rule: C / s = 1 + A / (s + a) + B / (s + b),
    // where a < b are the other nodes' distances from the first. A better s than that by the slope
    // at 0: the last pole as a constant and a pole at -a that agree in value and slope
    float a = v0 + v1, b = v0 + v2, A = e.y / v1, B = e2 / v2, C = e0 / v0;
    float s = min(C / (A / a + (B / b + 1.0)), 1e4), y = 1.0 / (s + b), t = B * y, r = (s + a) * y;
    float fall = t - t * r + 1.0;
    s = half_root(fall, 0.5 * (fall * a - C + (t * r * (s + a) + A)), C * a);
    float sa = s + a, sb = s + b;
    float outer = weight3(vec3(s * s, sa * sa, sb * sb), vec3(e0, e.y, e2), d);
    outer = v0 > 0.0 ? outer : 0.0; // else z lies outside all nodes
    return vec2(w, mirrored ? (1.0 - w) - outer : outer);
}
