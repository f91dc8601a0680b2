// The warp of depth, absorbance, what pass 2 adds, the resolve.

// Depth, from near to far, becomes z in [-1, 1] by two constants, WARP_SCALE x + WARP_OFFSET.
//
// 1: x = log2(depth); 0: x = depth.
#ifndef WARP_LOG
#define WARP_LOG 1
#endif
// 2 / log2(far / near); without WARP_LOG 2 / (far - near).
#ifndef WARP_SCALE
#define WARP_SCALE 0.2
#endif
// -1 - WARP_SCALE log2(near); without WARP_LOG -1 - WARP_SCALE near.
#ifndef WARP_OFFSET
#define WARP_OFFSET -1.0
#endif
// Greater opacities count as this one: opaque has no absorbance (Sharpe 2018).
#ifndef MAX_ALPHA
#define MAX_ALPHA 0.998046875
#endif
// 1: a fragment's own absorbance, which it knows, does not occlude it.
#ifndef EXCLUDE_SELF
#define EXCLUDE_SELF 0
#endif
// 1: weights are made to sum to what is covered (MBOIT eq. 2); 0: they count as they are.
#ifndef NORMALIZE
#define NORMALIZE 1
#endif

float warped(float depth) {
    float x = WARP_LOG == 1 ? log2(depth) : depth;
    return clamp(x * WARP_SCALE + WARP_OFFSET, -1.0, 1.0);
}

// -ln(1 - alpha); of small opacities by 2 artanh(alpha / (2 - alpha)), as log2 near 1 loses digits.
float absorbance(float alpha) {
    float a = min(alpha, MAX_ALPHA), s = a / (2.0 - a), q = s * s;
    float faint = s * (q * (q * (q * 0.29 + 0.4) + 0.66666667) + 2.0);
    float dense = log2(1.0 - a) * -0.69314718;
    return a < 0.25 ? faint : dense;
}

// What pass 2 adds to the target of colours.
vec4 shaded(vec3 color, float alpha, float through) {
#ifdef LEAST_SHADED
    float weight = alpha * max(through, LEAST_SHADED);
#else
    float weight = alpha * through;
#endif
    return vec4(color * weight, weight);
}

// Premultiplied colour and coverage, to be blended over the background.
vec4 covered(vec4 shaded_sum, float total) {
    float coverage = 1.0 - exp2(total * -1.44269504);
#if NORMALIZE
    return vec4(shaded_sum.rgb * (coverage / max(shaded_sum.a, 1e-30)), coverage);
#else
    return vec4(shaded_sum.rgb, coverage);
#endif
}

// What reaches a fragment that has so much of a distribution at it and in front of it. Of 1; scale:
// -b0 log2(e), beta: the share of what is at it that counts as in front of it, alpha: its opacity.
float transmittance_through(float at, float in_front, float scale, float beta, float alpha) {
#if EXCLUDE_SELF
    float own = min(log2(1.0 - min(alpha, MAX_ALPHA)) / min(scale, -1e-12), 1.0);
    float share = clamp(beta * max(at - own, 0.0) + in_front, 0.0, 1.0 - own);
#else
    float share = clamp(beta * at + in_front, 0.0, 1.0);
#endif
    return exp2(scale * share);
}
