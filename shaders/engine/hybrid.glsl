// Hybrid transparency: Maule, Comba, Torchelsen and Bastos, I3D 2013. A pixel keeps its foremost
// fragments; all others are layers of their mean opacity in their mean colour.

// 1: what the tail covers is exact.
#ifndef NORMALIZE
#define NORMALIZE 0
#endif

// The tail, which adds up: colour times opacity, and opacity. How many there are; or what is let
// through, which starts at 1 and is multiplied by 1 - target1.
struct sums { vec4 target0; float target1; };

sums into_the_tail(vec4 color, bool is_none) {
    sums o;
    o.target0 = is_none ? vec4(0.0, 0.0, 0.0, 0.0) : vec4(color.rgb * color.a, color.a);
#if NORMALIZE
    o.target1 = is_none ? 0.0 : color.a;
#else
    o.target1 = is_none ? 0.0 : 1.0;
#endif
    return o;
}

#include "engine/kept_layers.glsl"
#include "engine/mean_opacity.glsl"

// Premultiplied colour and coverage.
vec4 resolve_layers(state held, sums tail) {
    vec4 front = blended(held);
#if NORMALIZE
    float coverage = min(1.0 - tail.target1, tail.target0.a);
#else
    float coverage = covered_in_the_mean(tail.target0.a, tail.target1);
#endif
    float share = tail.target0.a > 0.0 ? front.a * coverage / tail.target0.a : 0.0;
    return vec4(tail.target0.rgb * share + front.rgb, 1.0 - front.a * (1.0 - coverage));
}
