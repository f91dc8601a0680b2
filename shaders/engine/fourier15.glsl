// Fourier opacity maps of 15 coefficients, kept in half floats; see fourier.glsl.
#include "engine/common.glsl"
#include "engine/fourier.glsl"

// a_0, a_1, b_1, a_2; b_2, a_3, b_3, a_4; b_4, a_5, b_5, a_6; b_6, a_7; b_7.
struct sums { vec4 target0; vec4 target1; vec4 target2; vec2 target3; float target4; };

sums accumulate(float z, float alpha) {
    float a = absorbance(alpha);
    vec2 p1 = on_the_circle(z), p2 = turned(p1, p1), p3 = turned(p2, p1), p4 = turned(p2, p2);
    vec2 p5 = turned(p3, p2), p6 = turned(p3, p3), p7 = turned(p4, p3);
    sums o;
    o.target0 = vec4(1.0, p1, p2.x) * a;
    o.target1 = vec4(p2.y, p3, p4.x) * a;
    o.target2 = vec4(p4.y, p5, p6.x) * a;
    o.target3 = vec2(p6.y, p7.x) * a;
    o.target4 = p7.y * a;
    return o;
}

float transmittance_of_sums(sums t, float z, float alpha) {
    vec2 p1 = on_the_circle(z), p2 = turned(p1, p1), p3 = turned(p2, p1), p4 = turned(p2, p2);
    vec2 p5 = turned(p3, p2), p6 = turned(p3, p3), p7 = turned(p4, p3);
    float waves = harmonic(t.target0.yz, p1)
                  + (0.5 * harmonic(vec2(t.target0.w, t.target1.x), p2)
                     + 0.33333333 * harmonic(t.target1.yz, p3))
                  + (0.25 * harmonic(vec2(t.target1.w, t.target2.x), p4)
                     + 0.2 * harmonic(t.target2.yz, p5))
                  + (0.16666667 * harmonic(vec2(t.target2.w, t.target3.x), p6)
                     + 0.14285714 * harmonic(vec2(t.target3.y, t.target4), p7));
    float own_waves = p1.y + (0.5 * p2.y + 0.33333333 * p3.y) + (0.25 * p4.y + 0.2 * p5.y)
                      + (0.16666667 * p6.y + 0.14285714 * p7.y);
    return transmittance_by(t.target0.x, waves, own_waves, 0.5 * z + 0.5, alpha);
}

#ifndef MEANS_OF_BLOCKS
vec4 resolve(vec4 shaded_sum, sums t) { return covered(shaded_sum, t.target0.x); }
#endif
