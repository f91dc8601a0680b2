// Weighted average: Bavoil and Myers, "Order Independent Transparency with Dual Depth Peeling",
// 2008. One pass; n layers of the mean opacity in the mean colour.

// Sums of colour times opacity and of opacity; how many there are.
struct sums { vec4 target0; float target1; };

sums accumulate_color(vec3 color, float alpha, float depth) {
    sums o;
    o.target0 = vec4(color * alpha, alpha);
    o.target1 = 1.0;
    return o;
}

#include "engine/mean_opacity.glsl"

// Premultiplied colour and coverage.
vec4 resolve_color(sums t) {
    float coverage = covered_in_the_mean(t.target0.a, t.target1);
    float share = t.target0.a > 0.0 ? coverage / t.target0.a : 0.0;
    return vec4(t.target0.rgb * share, coverage);
}
