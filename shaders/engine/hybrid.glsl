// Hybrid transparency: Maule, Comba, Torchelsen and Bastos, I3D 2013. A pixel keeps its foremost
// fragments; all others are layers of their mean opacity in their mean colour.

// The tail, which adds up: colour times opacity, and opacity; how many there are.
struct sums { vec4 target0; float target1; };

sums into_the_tail(vec4 color, bool is_none) {
    sums o;
    o.target0 = is_none ? vec4(0.0, 0.0, 0.0, 0.0) : vec4(color.rgb * color.a, color.a);
    o.target1 = is_none ? 0.0 : 1.0;
    return o;
}

#include "engine/kept_layers.glsl"
#include "engine/mean_opacity.glsl"

// Premultiplied colour and coverage.
vec4 resolve_layers(state held, sums tail) {
    vec4 front = blended(held);
    float coverage = covered_in_the_mean(tail.target0.a, tail.target1);
    float share = tail.target0.a > 0.0 ? front.a * coverage / tail.target0.a : 0.0;
    return vec4(tail.target0.rgb * share + front.rgb, 1.0 - front.a * (1.0 - coverage));
}
