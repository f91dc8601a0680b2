// Over, each fragment in front of those that were drawn before it: Porter and Duff, 1984. One pass,
// right where fragments come from back to front.

// Premultiplied colour and opacity, blended ONE, ONE_MINUS_SRC_ALPHA.
struct sums { vec4 target0; };

sums accumulate_color(vec3 color, float alpha, float depth) {
    sums o;
    o.target0 = vec4(color * alpha, alpha);
    return o;
}

// Premultiplied colour and coverage.
vec4 resolve_color(sums t) { return t.target0; }
