// Absorbance alone, as if it were spread evenly over depth: Fourier opacity of one coefficient.
#include "engine/common.glsl"

struct sums { float target0; };

sums accumulate(float z, float alpha) {
    sums o;
    o.target0 = absorbance(alpha);
    return o;
}

float transmittance_of_sums(sums t, float z, float alpha) {
    float d = 0.5 * z + 0.5, own = EXCLUDE_SELF == 1 ? absorbance(alpha) : 0.0;
    return exp2(-1.44269504 * d * max(t.target0 - own, 0.0));
}

vec4 resolve(vec4 shaded_sum, sums t) { return covered(shaded_sum, t.target0); }
