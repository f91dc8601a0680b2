#version 450
// Moments of rays to the Gauss rules that rules_buffer.glsl reads, one ray a thread.
//
//   DOUBLE   1: the work needs more digits than float has
//   NODES    2, 3 or 4, for 4, 6 or 8 moments
//   STORED   float or double: what a rule is stored in
#include "kernels/dialect.glsl"
#include "kernels/elementary.h"
#include "kernels/power_moments.h"
#include "kernels/pairs.h"
#include "kernels/power_rules.h"

layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly restrict buffer Moments { double b[]; }; // 2 NODES a ray
layout(std430, binding = 1) writeonly restrict buffer Rules { STORED rules[]; }; // see rules_buffer

uniform uint count;
uniform double bias;
uniform double safe[2 * NODES]; // the distribution that bias moves moments toward
uniform double least;           // pivots below are rounding alone

void main() {
    uint ray = gl_GlobalInvocationID.x;
    if (ray >= count) return;
    moments m;
    moments far_from_degenerate;
    for (int k = 0; k < 2 * NODES; ++k) {
        m.b[k] = b[2u * NODES * ray + k];
        far_from_degenerate.b[k] = safe[k];
    }
    rule r = gauss_rule(m, bias, far_from_degenerate, least);
    uint at = (3u * NODES + 1u) * ray;
    for (int i = 0; i < NODES; ++i) {
        STORED g = STORED(r.g[i]);
        rules[at + i] = g;
        rules[at + NODES + i] = STORED(r.g[i] - double(g)); // what rounding took from g
        rules[at + 2u * NODES + i] = STORED(r.e[i]);
    }
    rules[at + 3u * NODES] = STORED(r.d);
}
