#version 450
// The light that reaches depths of rays, from trigonometric_rules.comp.glsl, one depth a thread.
//
//   DOUBLE   0 or 1: numbers are float or double, those of rules too
//   NODES    2, 3 or 4 moments
#include "kernels/dialect.glsl"
#include "kernels/elementary.h"
#include "kernels/power_moments.h"
#include "kernels/trigonometric_moments.h"

layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly restrict buffer Rules { number rules[]; };
layout(std430, binding = 1) readonly restrict buffer Rays { number b0[]; };
layout(std430, binding = 2) readonly restrict buffer Questions { uint ray_of[]; };
layout(std430, binding = 3) readonly restrict buffer Depths { number z[]; };
layout(std430, binding = 4) readonly restrict buffer Surfaces { number own[]; }; // absorbance or 0
layout(std430, binding = 5) writeonly restrict buffer Answers { number T[]; };

uniform uint count;
uniform number beta;
uniform number turns; // as wrapping_zone has them
uniform number edge;
uniform number scale;

circle_rule rule_of(uint ray) {
    uint at = (5u * NODES + 3u) * ray;
    circle_rule r;
    for (int k = 0; k < NODES; ++k) {
        r.z[k] = rules[at + k];
        r.z_low[k] = rules[at + NODES + k];
        r.g[k] = rules[at + 2u * NODES + k];
        r.g_low[k] = rules[at + 3u * NODES + k];
        r.e[k] = rules[at + 4u * NODES + k];
    }
    r.d = rules[at + 5u * NODES];
    r.f_front = rules[at + 5u * NODES + 1u];
    r.f_back = rules[at + 5u * NODES + 2u];
    return r;
}

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= count) return;
    T[i] = circle_transmittance(rule_of(ray_of[i]), wrapping_zone(turns, edge, scale), b0[ray_of[i]], z[i], own[i], beta);
}
