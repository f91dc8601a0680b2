// Weighted blended order-independent transparency: McGuire and Bavoil, JCGT 2(2), 2013 (equations 7
// to 10), and McGuire's post on implementing it, 2015. One pass; a weight of a fragment's own
// depth, opacity and colour says how much of what the pixel covers is its colour's.

// The weight: 7 to 10, equations of the paper; 0, the post's; 1, the form in wide use (McGuire and
// Mara, "Phenomenological Transparency", 2017).
#ifndef WEIGHT
#define WEIGHT 0
#endif
// Scene units, which weights are tuned for, per unit of depth.
#ifndef DEPTH_SCALE
#define DEPTH_SCALE 1.0
#endif
// The camera's near plane, in units of depth (of weights by eq. 10 and phenomenological ones).
#ifndef DEPTH_NEAR
#define DEPTH_NEAR 0.1
#endif
// The camera's far plane, likewise.
#ifndef DEPTH_FAR
#define DEPTH_FAR 1000.0
#endif

// Sums of colour and opacity times weight, which add up; what is let through, which starts at 1 and
// is multiplied by 1 - target1.
struct sums { vec4 target0; float target1; };

// depth > 0: the distance from the eye along its axis.
float weight_of(vec3 color, float alpha, float depth) {
    float z = depth * DEPTH_SCALE, far_share = z * 0.005, square = far_share * far_share;
    float d = clamp(DEPTH_FAR / (DEPTH_FAR - DEPTH_NEAR) * (depth - DEPTH_NEAR) / depth, 0.0, 1.0);
#if WEIGHT == 0
    float bright = max(max(color.r, color.g), color.b) * alpha;
    return max(min(1.0, bright), alpha) * clamp(0.03 / (1e-5 + square * square), 1e-2, 3e3);
#elif WEIGHT == 7
    float part = z * z * 0.04;
    return alpha * clamp(10.0 / (1e-5 + part + square * square * square), 1e-2, 3e3);
#elif WEIGHT == 8
    float tenth = z * 0.1, part = tenth * tenth * tenth;
    return alpha * clamp(10.0 / (1e-5 + part + square * square * square), 1e-2, 3e3);
#elif WEIGHT == 9
    return alpha * clamp(0.03 / (1e-5 + square * square), 1e-2, 3e3);
#elif WEIGHT == 10
    float front = 1.0 - d;
    return alpha * max(1e-2, 3e3 * front * front * front);
#else
    float opaque = min(1.0, 10.0 * alpha) + 0.01, front = 1.0 - 0.9 * d;
    return clamp(opaque * opaque * opaque * 1e8 * front * front * front, 1e-2, 3e3);
#endif
}

sums accumulate_color(vec3 color, float alpha, float depth) {
    float weight = alpha * weight_of(color, alpha, depth);
    sums o;
    o.target0 = vec4(color * weight, weight);
    o.target1 = alpha;
    return o;
}

// Premultiplied colour and coverage. What weighs nothing is not seen.
vec4 resolve_color(sums t) {
    float coverage = 1.0 - t.target1, share = t.target0.a > 0.0 ? coverage / t.target0.a : 0.0;
    return vec4(t.target0.rgb * share, coverage);
}
