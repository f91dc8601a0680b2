#version 450
// What the published passes of Fourier opacity maps cost (Jansen, Bavoil 2010), written plainly
// from the paper. A yardstick: moit draws nothing with it.
//
// HARMONICS : of the series, after the constant.

#include "published/fragments.glsl"

#define NUMBERS (2 * HARMONICS + 1)
#define TURN 6.2831853

layout(std430, binding = 1) buffer a_series { float series[]; };

#if PASS == 1
void main() {
    fragment at = this_fragment();
    uint to = gl_GlobalInvocationID.x * NUMBERS;
    float absorbance = -log(1.0 - at.alpha);
    float depth = 0.5 * at.z + 0.5;
    series[to] = 2.0 * absorbance;
    for (int k = 1; k <= HARMONICS; ++k) {
        float angle = TURN * float(k) * depth;
        series[to + 2 * k - 1] = 2.0 * absorbance * cos(angle);
        series[to + 2 * k] = 2.0 * absorbance * sin(angle);
    }
}
#else
void main() {
    fragment at = this_fragment();
    uint from = gl_GlobalInvocationID.x * NUMBERS;
    float depth = 0.5 * at.z + 0.5;
    float in_front = 0.5 * series[from] * depth;
    for (int k = 1; k <= HARMONICS; ++k) {
        float angle = TURN * float(k) * depth;
        float per = 1.0 / (TURN * float(k));
        in_front += per * series[from + 2 * k - 1] * sin(angle);
        in_front += per * series[from + 2 * k] * (1.0 - cos(angle));
    }
    give(exp(-in_front));
}
#endif
