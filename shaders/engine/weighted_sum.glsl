// Weighted sum: Meshkin, "Sort-independent alpha blending", GDC 2007. One pass; what is of first
// order in opacity. Dark and even negative where opacities sum to more than 1.

// Sums of colour times opacity and of opacity.
struct sums { vec4 target0; };

sums accumulate_color(vec3 color, float alpha, float depth) {
    sums o;
    o.target0 = vec4(color * alpha, alpha);
    return o;
}

// Premultiplied colour and coverage, which may be above 1.
vec4 resolve_color(sums t) { return t.target0; }
