// Depth peeling: Everitt, "Interactive Order-Independent Transparency", NVIDIA 2001. Each round
// draws the nearest fragments behind those of the round before, and blends them under these.

// Premultiplied colour and opacity, blended ONE_MINUS_DST_ALPHA, ONE.
struct sums { vec4 target0; };

// Whether a fragment has not been drawn yet; both as a depth buffer has them, which the first round
// finds at 0, in front of everything.
bool is_behind(float depth, float before) { return depth > before; }

sums accumulate_color(vec3 color, float alpha, float depth) {
    sums o;
    o.target0 = vec4(color * alpha, alpha);
    return o;
}

// Premultiplied colour and coverage.
vec4 resolve_color(sums t) { return t.target0; }
