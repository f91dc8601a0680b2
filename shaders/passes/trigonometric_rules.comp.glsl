#version 450
// Trigonometric moments of rays to rules, one ray a thread.
//
//   DOUBLE   1: the work needs more digits than float has
//   NODES    2, 3 or 4 moments
//   STORED   float or double: what a rule is stored in
#include "kernels/dialect.glsl"
#include "kernels/elementary.h"
#include "kernels/power_moments.h"
#include "kernels/pairs.h"
#include "kernels/power_rules.h"
#include "kernels/trigonometric_moments.h"
#include "kernels/trigonometric_rules.h"

layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly restrict buffer Moments { double b[]; }; // re, im in turn
layout(std430, binding = 1) writeonly restrict buffer Rules { STORED rules[]; }; // as circle_rule

uniform uint count;
uniform double bias;
uniform double least; // pivots below are rounding alone
uniform double turns; // of the wrapping zone, as its edge
uniform double edge;

void main() {
    uint ray = gl_GlobalInvocationID.x;
    if (ray >= count) return;
    circle_moments m;
    for (int k = 0; k < NODES; ++k) {
        m.re[k] = b[2u * (NODES * ray + k)];
        m.im[k] = b[2u * (NODES * ray + k) + 1u];
    }
    circle_rule r = circle_rule_of(m, wrapping_zone(turns, edge, 0.0), bias, least);
    uint at = (5u * NODES + 3u) * ray;
    for (int i = 0; i < NODES; ++i) {
        STORED z = STORED(r.z[i]);
        STORED g = STORED(r.g[i]);
        rules[at + i] = z;
        rules[at + NODES + i] = STORED(r.z[i] - double(z)); // what rounding took from z
        rules[at + 2u * NODES + i] = g;
        rules[at + 3u * NODES + i] = STORED(r.g[i] - double(g));
        rules[at + 4u * NODES + i] = STORED(r.e[i]);
    }
    rules[at + 5u * NODES] = STORED(r.d);
    rules[at + 5u * NODES + 1u] = STORED(r.f_front);
    rules[at + 5u * NODES + 2u] = STORED(r.f_back);
}
