// First-order terms of the composite, the sum of alpha c, and 1 - sum of alpha of what is behind:
// Meshkin, "Sort-independent alpha blending", GDC 2007. In floats alone. Dark and even negative
// where opacities sum to more than 1.

// Added up: colour times opacity, and opacity.
struct sums { vec4 target0; };

sums accumulate(vec3 color, float alpha, float depth) {
    sums o;
    o.target0 = vec4(color * alpha, alpha);
    return o;
}

// Premultiplied colour and coverage, to be blended over the background with 1 - coverage, which
// may be negative.
vec4 resolve(sums t) { return t.target0; }
