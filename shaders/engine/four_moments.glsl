// Four power moments of depth and what is made of them once a pixel, moved toward those of a safe
// distribution, V2 and V4 (MBOIT 4.1 and its supplement).
//
// PUBLISHED_BIAS  what outweighs rounding by itself
const float V2 = BY_WORDS(0.375, 0.628);
const float V4 = BY_WORDS(0.375, 0.628);

vec4 powers_of(float z) {
    float z2 = z * z;
    return vec4(z, z2, z2 * z, z2 * z2);
}

// Of sums of moments times absorbance, and of absorbance.
recurrence2 recurrence_of_sums(vec4 moments, float total) {
    float b0 = max(total, 1e-12), g = BIAS / (1.0 - BIAS) * b0;
    float least = max(ROUNDING * (1.0 - BIAS / PUBLISHED_BIAS), 1e-15) * BY_STORAGE(b0, (b0 + g));
    return recurrence2_of(
        pivot_of(PAIR(b0, g), 0.0), ALONE(SUM_WITHIN(moments.x, b0)),
        PAIR(SUM_WITHIN(moments.y, b0), g * V2), ALONE(SUM_WITHIN(moments.z, b0)),
        PAIR(SUM_WITHIN(moments.w, b0), g * V4), least, 1.0);
}

// As targets hold it.
vec4 held_of(recurrence2 r) { return vec4(r.a0, r.low, r.half_u, r.half_s2); }

recurrence2 recurrence_held(vec4 held, float s1, float h) {
    recurrence2 r;
    r.a0 = held.x;
    r.low = held.y;
    r.half_u = held.z;
    r.half_s2 = held.w;
    r.s1 = s1;
    r.h = h;
    return r;
}
