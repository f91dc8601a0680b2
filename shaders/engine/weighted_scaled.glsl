// Weighted sum with weights that are scaled to what is covered, 1 less the product of 1 - alpha:
// Meshkin, "Sort-independent alpha blending", GDC 2007. One pass; depth has no part in it.

// Sums of colour times opacity and of opacity. What is let through, which starts at 1 and is
// multiplied by 1 - target1.
struct sums { vec4 target0; float target1; };

sums accumulate_color(vec3 color, float alpha, float depth) {
    sums o;
    o.target0 = vec4(color * alpha, alpha);
    o.target1 = alpha;
    return o;
}

// Premultiplied colour and coverage.
vec4 resolve_color(sums t) {
    float covers = 1.0 - t.target1;
    return vec4(t.target0.rgb * (covers / max(t.target0.a, 1e-30)), covers);
}
