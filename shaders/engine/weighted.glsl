// Weighted blended order-independent transparency in floats alone: McGuire and Bavoil, "Weighted
// Blended Order-Independent Transparency", JCGT 2(2), 2013, equations 7 to 10 (each there already
// contains alpha); the default is that of McGuire's post on implementing it, 2015;
// "phenomenological" goes with McGuire and Mara, "Phenomenological Transparency", 2017.
//
// One pass over transparent geometry adds up colours by weights and multiplies what the pixel lets
// through by 1 - alpha; the resolve shares out what is covered.
#include "kernels/options.h"

// Of kernels/options.h: which weight.
#ifndef WEIGHT
#define WEIGHT WEIGHT_BLOG
#endif
// Weights are tuned for these units of distance from the eye, per unit of depth.
#ifndef DEPTH_SCALE
#define DEPTH_SCALE 1.0
#endif
// Of the buffer of depth, far / (far - near) and near: it holds SCALE (1 - near / depth).
#ifndef BUFFER_SCALE
#define BUFFER_SCALE 1.0
#endif
#ifndef BUFFER_NEAR
#define BUFFER_NEAR 0.1
#endif

// Added up: colour and opacity by weight; multiplied by 1 less this: opacity.
struct sums { vec4 target0; float target1; };

// How much a fragment counts beside its opacity. depth: the distance from the eye.
float weight(vec3 color, float alpha, float depth) {
    float z = depth * DEPTH_SCALE;
#if WEIGHT == WEIGHT_BLOG || WEIGHT == WEIGHT_EQ9
    float far = z * 0.005;
    far = far * far;
    float fall = clamp(0.03 / (1e-5 + far * far), 1e-2, 3e3);
#if WEIGHT == WEIGHT_BLOG
    float bright = max(max(color.x, color.y), color.z) * alpha;
    return max(min(1.0, bright), alpha) * fall;
#else
    return alpha * fall;
#endif
#elif WEIGHT == WEIGHT_EQ7 || WEIGHT == WEIGHT_EQ8
    float far = z * 0.005;
    far = far * far * far;
#if WEIGHT == WEIGHT_EQ7
    float near = z * z * 0.04;
#else
    float near = z * 0.1;
    near = near * near * near;
#endif
    return alpha * clamp(10.0 / (1e-5 + near + far * far), 1e-2, 3e3);
#else
    float stored = clamp(BUFFER_SCALE - BUFFER_SCALE * BUFFER_NEAR / depth, 0.0, 1.0);
#if WEIGHT == WEIGHT_EQ10
    float front = 1.0 - stored;
    return alpha * max(1e-2, 3e3 * front * front * front);
#else
    float solid = min(1.0, 10.0 * alpha) + 0.01;
    float front = 1.0 - 0.9 * stored;
    return clamp(solid * solid * solid * 1e8 * front * front * front, 1e-2, 3e3);
#endif
#endif
}

sums accumulate(vec3 color, float alpha, float depth) {
    float counted = alpha * weight(color, alpha, depth);
    sums o;
    o.target0 = vec4(color * counted, counted);
    o.target1 = alpha;
    return o;
}

// Premultiplied colour and coverage, to be blended over the background.
vec4 resolve(sums t) {
    float coverage = 1.0 - t.target1;
    return vec4(t.target0.rgb * (coverage / max(t.target0.a, 1e-30)), coverage);
}
