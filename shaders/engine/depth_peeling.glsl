// Depth peeling: Everitt, "Interactive Order-Independent Transparency", NVIDIA 2001. Each round
// draws the nearest fragments behind those of the round before, and blends them under these.

// 1: the layers drawn are scaled to cover what all fragments do.
#ifndef NORMALIZE
#define NORMALIZE 0
#endif

#if NORMALIZE
// What all fragments let through, which starts at 1 and is multiplied by 1 - target0.
struct sums { float target0; };
#else
// Premultiplied colour and opacity, blended ONE_MINUS_DST_ALPHA, ONE.
struct sums { vec4 target0; };
#endif

// Whether a fragment has not been drawn yet; both as a depth buffer has them, which the first round
// finds at 0, in front of everything.
bool is_behind(float depth, float before) { return depth > before; }

#if NORMALIZE
sums accumulate(float depth, float alpha) {
    sums o;
    o.target0 = alpha;
    return o;
}

// Premultiplied colour and opacity, blended ONE_MINUS_DST_ALPHA, ONE: a layer, as all of it is let
// through.
vec4 shaded(vec3 color, float alpha, float through) {
    return vec4(color * alpha, alpha) * through;
}

// Premultiplied colour and coverage.
vec4 resolve(vec4 shaded_sum, sums t) {
    float coverage = 1.0 - t.target0, drawn = shaded_sum.a;
    return drawn > 0.0 ? vec4(shaded_sum.rgb * (coverage / drawn), coverage) : shaded_sum;
}
#else
sums accumulate_color(vec3 color, float alpha, float depth) {
    sums o;
    o.target0 = vec4(color * alpha, alpha);
    return o;
}

// Premultiplied colour and coverage.
vec4 resolve_color(sums t) { return t.target0; }
#endif
