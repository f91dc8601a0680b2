#version 450
// What the published passes of Moment Transparency cost (Sharpe 2018), written plainly: the lower
// bound by three depths that have the moments (Peters, Klein 2015, algorithm 3), one of which is
// the fragment's. A yardstick: moit draws nothing with it.
//
// BIAS : how far moments move toward (0, .375, 0, .375).

#include "published/fragments.glsl"

layout(std430, binding = 1) buffer the_moments { vec4 moments[]; };
layout(std430, binding = 3) buffer the_totals { vec2 totals[]; }; // of absorbance; what gets past

#if PASS == 1
void main() {
    fragment at = this_fragment();
    uint here = gl_GlobalInvocationID.x;
    float alpha = at.alpha * (1.0 - 0.5 / 256.0);
    float absorbance = -log(1.0 - alpha);
    float square = at.z * at.z;
    moments[here] = absorbance * vec4(at.z, square, square * at.z, square * square);
    totals[here] = vec2(absorbance, alpha);
}
#else
void main() {
    fragment at = this_fragment();
    uint here = gl_GlobalInvocationID.x;
    float total = totals[here].x;
    vec4 b = mix(moments[here] / total, vec4(0.0, 0.375, 0.0, 0.375), BIAS);
    // Hankel = L D L^T, and q with Hankel q = (1, z, z^2)
    float d1 = b.y - b.x * b.x;
    float l21 = (b.z - b.x * b.y) / d1;
    float d2 = b.w - b.y * b.y - l21 * l21 * d1;
    float y1 = at.z - b.x;
    float q2 = (at.z * at.z - b.y - l21 * y1) / d2;
    float q1 = y1 / d1 - l21 * q2;
    float q0 = 1.0 - b.x * q1 - b.y * q2;
    float p = 0.5 * q1 / q2;
    float size = sqrt(max(p * p - q0 / q2, 0.0));
    float x1 = -p - size, x2 = -p + size;
    // Of the first, or of both that lie in front: all but that of the fragment's depth
    bool both = x2 < at.z;
    float node = both ? at.z : x1, other = both ? x1 : at.z;
    float weight = (other * x2 - b.x * (other + x2) + b.y) / ((node - other) * (node - x2));
    float share = both ? 1.0 - weight : weight;
    give(exp(-total * (x1 < at.z ? clamp(share, 0.0, 1.0) : 0.0)));
}
#endif
