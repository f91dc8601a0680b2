// Roots that need no iteration: of cubics nearly, of what is torn into poles by one step.

// cos(acos(x) / 3) for x = 1 - t is 1 less this; good to two parts in 10^4 of it, which keeps near
// double roots apart.
float less_than_one(float t) {
    return t * (t * (t * (t * 0.00324341 + 0.00278974) + 0.01682396) + 0.11109179);
}

// The highest root of y^3 - 3 q y - 2 r, all of which are real; near three parts in 10^5.
float cubic_high(float q, float r) {
    float y = inversesqrt(max(q, 1e-30)), c = less_than_one(max(1.0 - abs(r) * y * (y * y), 0.0));
    float size = max(q, 0.0) * y, b = size - size * c;
    return r >= 0.0 ? 2.0 * b : size * sqrt(3.0 * c * (2.0 - c)) + b;
}

// The root s > 0 of fall s^2 + 2 k s = pole, in the form that does not cancel; rounding may have
// made fall or pole less than 0.
float half_root(float fall, float k, float pole) {
    float t = abs(k) + sqrt(max(k * k + fall * pole, 0.0));
    bool up = k > 0.0;
    return (up ? pole : t) / (up ? t : fall);
}

// A better s > 0 with s + 2 k = e0 / s + e / (s + gap): the other pole as a line that agrees with
// it in value and slope.
float outer_step1(float s, float k, float e0, float e, float gap) {
    float y = 1.0 / (s + gap), t = e * y, U = t * y;
    return half_root(U + 1.0, k - 0.5 * (U * s + t), e0);
}

// A better s > 0 with s + 2 k = e0 / s + sum of e / (s + gaps): the other poles as a line that
// agrees with them in value and slope.
float outer_step2(float s, float k, float e0, vec2 e, vec2 gaps) {
    vec2 y = 1.0 / (s + gaps), t = e * y;
    float U = dot(t, y);
    return half_root(U + 1.0, k - 0.5 * (U * s + (t.x + t.y)), e0);
}

// And with three.
float outer_step3(float s, float k, float e0, vec3 e, vec3 gaps) {
    vec3 y = 1.0 / (s + gaps), t = e * y;
    float U = dot(t, y);
    return half_root(U + 1.0, k - 0.5 * (U * s + (t.x + t.y + t.z)), e0);
}
