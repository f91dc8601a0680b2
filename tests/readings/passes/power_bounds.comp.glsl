#version 450
// What moments prove about the absorbance in front of depths, one depth a thread.
//
//   DOUBLE   1: the work needs more digits than float has
//   NODES    2, 3 or 4, for 4, 6 or 8 moments
#include "kernels/dialect.glsl"
#include "kernels/elementary.h"
#include "kernels/power_moments.h"
#include "kernels/pairs.h"
#include "kernels/power_rules.h"
#include "kernels/power_bounds.h"

layout(local_size_x = 64) in;
// Of a ray: nodes, what rounding took from them, residues and pivot.
layout(std430, binding = 0) readonly restrict buffer Rules { number rules[]; };
layout(std430, binding = 1) readonly restrict buffer Moments { number b[]; }; // 2 NODES a ray
layout(std430, binding = 2) readonly restrict buffer Questions { uint ray_of[]; };
layout(std430, binding = 3) readonly restrict buffer Depths { number z[]; };
layout(std430, binding = 4) writeonly restrict buffer Answers { number answers[]; }; // least, most

uniform uint count;
uniform number blur;  // z is known to within
uniform number slack; // moments are known to within

rule rule_of(uint ray) {
    uint at = (3u * NODES + 1u) * ray;
    rule r;
    for (int k = 0; k < NODES; ++k) {
        r.g[k] = rules[at + k];
        r.g_low[k] = rules[at + NODES + k];
        r.e[k] = rules[at + 2u * NODES + k];
    }
    r.d = rules[at + 3u * NODES];
    return r;
}

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    moments m;
    for (int k = 0; k < 2 * NODES; ++k) m.b[k] = b[2u * NODES * ray_of[i] + k];
    certain c = certain_at(rule_of(ray_of[i]), m, z[i], blur, slack);
    answers[2u * i] = c.at_least;
    answers[2u * i + 1u] = c.at_most;
}
