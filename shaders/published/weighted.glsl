#version 450
// What the published pass of weighted, blended transparency costs (McGuire, Bavoil 2013, eq.
// 9). A yardstick: moit draws nothing with it.

#include "published/fragments.glsl"

layout(std430, binding = 1) buffer a_state { vec4 sums[]; };

void main() {
    fragment at = this_fragment();
    float share = at.z * (1.0 / 200.0), square = share * share;
    float weight = at.alpha * clamp(0.03 / (1e-5 + square * square), 1e-2, 3e3);
    sums[gl_GlobalInvocationID.x] = vec4(vec3(weight), weight * at.alpha);
    give(at.alpha);
}
