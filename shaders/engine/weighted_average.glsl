// n layers of the mean opacity in the mean colour by opacity: Bavoil and Myers, "Order Independent
// Transparency with Dual Depth Peeling", 2008. In floats alone.
//
// One pass over transparent geometry adds up; the resolve takes means.

// Added up: colour times opacity, and opacity; how many fragments there are.
struct sums { vec4 target0; float target1; };

sums accumulate(vec3 color, float alpha, float depth) {
    sums o;
    o.target0 = vec4(color * alpha, alpha);
    o.target1 = 1.0;
    return o;
}

// Premultiplied colour and coverage, to be blended over the background.
vec4 resolve(sums t) {
    float mean = t.target0.a / max(t.target1, 1.0);
    // faint layers by their series, as log2 near 1 loses digits
    float faint = mean * (mean * (mean * 0.33333333 + 0.5) + 1.0) * -1.44269504;
    float layer = mean < 0.01 ? faint : log2(max(1.0 - mean, 1e-30));
    float coverage = 1.0 - exp2(layer * t.target1);
    return vec4(t.target0.rgb * (coverage / max(t.target0.a, 1e-30)), coverage);
}
