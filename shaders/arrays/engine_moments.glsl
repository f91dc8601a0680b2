// The factor pass and what reads it, of moments by a text for engines: 4, 6 or 8 numbers and b0 in
// `state`; in `factors` those of the text, then b0. The text is included before; its `factor` takes
// sums, and what its reading multiplies by their absorbance is one number of them.
//
//   NODES     2, 3 or 4
//   BOUNDED   whether the text is engine/bounded.glsl, which has no number to multiply
//   NUMBERS   how many a pixel keeps, besides b0

#if NODES == 2
#define SCALE factor1.z
#elif NODES == 3
#define SCALE factor0.w
#else
#define SCALE factor2.y
#endif

#if PASS == FACTOR
void factor(uint p) {
    uint at = STATE_SIZE * p;
    uint to = FACTORS_SIZE * p;
    float b0 = state[at + NUMBERS];
    factors[to + FACTORS_SIZE - 1u] = b0;
    if (b0 == 0.0) { // as most pixels of many pictures; nothing asks for more
        set_total(p, 1.0);
        return;
    }
    // State is of means: they are sums of an absorbance of 1, and lose no digit so.
    sums s;
    s.target0 = vec4(state[at], state[at + 1u], state[at + 2u], state[at + 3u]);
#if NODES == 2
    s.target1 = 1.0;
#elif NODES == 3
    s.target1 = vec2(state[at + 4u], state[at + 5u]);
    s.target2 = 1.0;
#else
    s.target1 = vec4(state[at + 4u], state[at + 5u], state[at + 6u], state[at + 7u]);
    s.target2 = 1.0;
#endif
#if BOUNDED
    engine_factors f = factor_of(s, b0, 1.0);
    for (uint k = 0u; k < 4u; ++k) {
        factors[to + 8u + k] = f.factor2[k];
        factors[to + 12u + k] = f.factor3[k];
    }
#else
    engine_factors f = factor(s);
    f.SCALE *= b0;
#endif
    for (uint k = 0u; k < 4u; ++k) {
        factors[to + k] = f.factor0[k];
        factors[to + 4u + k] = f.factor1[k];
    }
#if NODES == 4
    factors[to + 8u] = f.factor2.x;
    factors[to + 9u] = f.factor2.y;
#endif
    set_total(p, exp2(-1.44269504 * b0));
}
#elif READS
engine_factors ray;
float ray_b0;

void load_ray(uint p) {
    uint at = FACTORS_SIZE * p;
    for (uint k = 0u; k < 4u; ++k) {
        ray.factor0[k] = factors[at + k];
        ray.factor1[k] = factors[at + 4u + k];
    }
#if BOUNDED
    for (uint k = 0u; k < 4u; ++k) {
        ray.factor2[k] = factors[at + 8u + k];
        ray.factor3[k] = factors[at + 12u + k];
    }
#elif NODES == 4
    ray.factor2 = vec2(factors[at + 8u], factors[at + 9u]);
#endif
    ray_b0 = factors[at + FACTORS_SIZE - 1u];
}

number in_front(uint p, surface s) {
    return ray_b0 == 0.0 ? 1.0 : transmittance(ray, warped(s.depth), s.alpha);
}
#endif
