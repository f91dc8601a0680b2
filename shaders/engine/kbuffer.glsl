// The k-buffer: Bavoil, Callahan, Lefohn, Comba and Silva, I3D 2007. A pixel keeps its nearest
// fragments, in front of all others in the order in which they had to go.

// The tail: premultiplied colour and opacity, blended ONE, ONE_MINUS_SRC_ALPHA.
struct sums { vec4 target0; };

sums into_the_tail(vec4 color, bool is_none) {
    sums o;
    o.target0 = is_none ? vec4(0.0, 0.0, 0.0, 0.0) : vec4(color.rgb * color.a, color.a);
    return o;
}

#include "engine/kept_layers.glsl"

// Premultiplied colour and coverage.
vec4 resolve_layers(state held, sums tail) {
    vec4 front = blended(held);
    return vec4(tail.target0.rgb * front.a + front.rgb, 1.0 - front.a * (1.0 - tail.target0.a));
}
