// Fourier opacity maps: Jansen and Bavoil, "Fourier Opacity Mapping", I3D 2010. Absorbances A at
// depths d in [0, 1] are a density along the ray; its series is cut off after 3 or 7 harmonics:
//     -ln T(d) = a_0 d + sum over k of a_k sin(2 pi k d) / (pi k) + b_k (1 - cos(2 pi k d)) / (pi k)
// with a_k, b_k the sums of A cos(2 pi k d), A sin(2 pi k d). No factors: pass 2 reads the sums.
#include "engine/common.glsl"

// Of absorbance alone there is 1: as if it were spread evenly.
#ifndef COEFFICIENTS
#define COEFFICIENTS 7
#endif

#if COEFFICIENTS == 15
// a_0, a_1, b_1, a_2; b_2 ..; .. ; a_7; b_7. As half floats.
struct sums { vec4 target0; vec4 target1; vec4 target2; vec2 target3; float target4; };
#elif COEFFICIENTS == 7
// a_0, a_1, b_1, a_2; b_2, a_3; b_3. As half floats.
struct sums { vec4 target0; vec2 target1; float target2; };
#else
// a_0
struct sums { float target0; };
#endif

// The next power: a turned by b.
vec2 turned(vec2 a, vec2 b) { return vec2(a.x * b.x - a.y * b.y, a.x * b.y + a.y * b.x); }

// 2 pi d, d being depth in [0, 1].
vec2 on_the_circle(float z) {
    float angle = 3.14159265 * (z + 1.0);
    return vec2(cos(angle), sin(angle));
}

sums accumulate(float z, float alpha) {
    float a = absorbance(alpha);
    sums o;
#if COEFFICIENTS == 1
    o.target0 = a;
#else
    vec2 p1 = on_the_circle(z);
    vec2 p2 = turned(p1, p1);
    vec2 p3 = turned(p2, p1);
    o.target0 = vec4(1.0, p1, p2.x) * a;
#if COEFFICIENTS == 7
    o.target1 = vec2(p2.y, p3.x) * a;
    o.target2 = p3.y * a;
#else
    vec2 p4 = turned(p2, p2);
    vec2 p5 = turned(p3, p2);
    vec2 p6 = turned(p3, p3);
    vec2 p7 = turned(p4, p3);
    o.target1 = vec4(p2.y, p3, p4.x) * a;
    o.target2 = vec4(p4.y, p5, p6.x) * a;
    o.target3 = vec2(p6.y, p7.x) * a;
    o.target4 = p7.y * a;
#endif
#endif
    return o;
}

// pi times what a harmonic of order k adds, times k.
float harmonic(vec2 ab, vec2 p) { return ab.x * p.y + ab.y * (1.0 - p.x); }

float total_of(sums t) {
#if COEFFICIENTS == 1
    return t.target0;
#else
    return t.target0.x;
#endif
}

float transmittance_of_sums(sums t, float z, float alpha) {
    float d = 0.5 * z + 0.5;
    float total = total_of(t);
    float in_front = total * d;
    float own_share = d;
#if COEFFICIENTS > 1
    vec2 p1 = on_the_circle(z);
    vec2 p2 = turned(p1, p1);
    vec2 p3 = turned(p2, p1);
    float waves = harmonic(t.target0.yz, p1);
    float own_waves = p1.y + 0.5 * p2.y + 0.33333333 * p3.y;
#if COEFFICIENTS == 7
    waves += 0.5 * harmonic(vec2(t.target0.w, t.target1.x), p2);
    waves += 0.33333333 * harmonic(vec2(t.target1.y, t.target2), p3);
#else
    vec2 p4 = turned(p2, p2);
    vec2 p5 = turned(p3, p2);
    vec2 p6 = turned(p3, p3);
    vec2 p7 = turned(p4, p3);
    waves += 0.5 * harmonic(vec2(t.target0.w, t.target1.x), p2);
    waves += 0.33333333 * harmonic(t.target1.yz, p3);
    waves += 0.25 * harmonic(vec2(t.target1.w, t.target2.x), p4);
    waves += 0.2 * harmonic(t.target2.yz, p5);
    waves += 0.16666667 * harmonic(vec2(t.target2.w, t.target3.x), p6);
    waves += 0.14285714 * harmonic(vec2(t.target3.y, t.target4), p7);
    own_waves += 0.25 * p4.y + 0.2 * p5.y + 0.16666667 * p6.y + 0.14285714 * p7.y;
#endif
    in_front += 0.31830989 * waves;
    own_share += 0.31830989 * own_waves;
#endif
    float own = EXCLUDE_SELF == 1 ? absorbance(alpha) : 0.0;
    in_front = clamp(in_front - own * own_share, 0.0, max(total - own, 0.0));
    return exp2(-1.44269504 * in_front);
}

vec4 resolve(vec4 shaded_sum, sums t) { return covered(shaded_sum, total_of(t)); }
