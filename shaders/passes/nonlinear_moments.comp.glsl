#version 450
// What non-linearly quantised moments keep of rays' rules, and the rules that rules_buffer.glsl
// reads, one ray a thread.
//
//   DOUBLE   1: the work needs more digits than float has
//   NODES    2, for 4 moments
//   STORED   float or double: what a rule is stored in
#include "kernels/dialect.glsl"
#include "kernels/elementary.h"
#include "kernels/storage.h"
#include "kernels/power_moments.h"
#include "kernels/nonlinear_moments.h"
#include "rules_buffer.glsl"

layout(local_size_x = 64) in;
layout(std430, binding = 1) writeonly restrict buffer Words { uint words[]; };  // 4 a ray
layout(std430, binding = 2) writeonly restrict buffer Kept { STORED kept[]; }; // see rules_buffer

uniform uint count;
uniform number low, extent; // of the interval of depths

void main() {
    uint ray = gl_GlobalInvocationID.x;
    if (ray >= count) return;
    nonlinear w = nonlinear_words(nonlinear_of(rule_of(ray)), low, extent);
    words[4u * ray] = uint(w.node[0]);
    words[4u * ray + 1u] = uint(w.node[1]);
    words[4u * ray + 2u] = uint(w.weight);
    words[4u * ray + 3u] = uint(w.offset);
    rule r = rule_of_nonlinear(nonlinear_values(w, low, extent));
    uint at = (3u * NODES + 1u) * ray;
    for (int i = 0; i < NODES; ++i) {
        STORED g = STORED(r.g[i]);
        kept[at + i] = g;
        kept[at + NODES + i] = STORED(r.g[i] - double(g)); // what rounding took from g
        kept[at + 2u * NODES + i] = STORED(r.e[i]);
    }
    kept[at + 3u * NODES] = STORED(r.d);
}
