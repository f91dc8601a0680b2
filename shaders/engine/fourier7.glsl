// Fourier opacity maps of 7 coefficients, kept in half floats; see fourier.glsl.
#include "engine/common.glsl"
#include "engine/fourier.glsl"

// a_0, a_1, b_1, a_2; b_2, a_3; b_3.
struct sums { vec4 target0; vec2 target1; float target2; };

sums accumulate(float z, float alpha) {
    float a = absorbance(alpha);
    vec2 p1 = on_the_circle(z), p2 = turned(p1, p1), p3 = turned(p2, p1);
    sums o;
    o.target0 = vec4(1.0, p1, p2.x) * a;
    o.target1 = vec2(p2.y, p3.x) * a;
    o.target2 = p3.y * a;
    return o;
}

float transmittance_of_sums(sums t, float z, float alpha) {
    vec2 p1 = on_the_circle(z), p2 = turned(p1, p1), p3 = turned(p2, p1);
    float waves = harmonic(t.target0.yz, p1)
                  + (0.5 * harmonic(vec2(t.target0.w, t.target1.x), p2)
                     + 0.33333333 * harmonic(vec2(t.target1.y, t.target2), p3));
    float own_waves = p1.y + (0.5 * p2.y + 0.33333333 * p3.y);
    return transmittance_by(t.target0.x, waves, own_waves, 0.5 * z + 0.5, alpha);
}

#ifndef MEANS_OF_BLOCKS
vec4 resolve(vec4 shaded_sum, sums t) { return covered(shaded_sum, t.target0.x); }
#endif
