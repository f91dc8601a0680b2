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

// 1 - (1 - mean)^n, for faint ones by a series.
float covered_in_the_mean(float sum, float n) {
    float mean = min(sum / max(n, 1.0), 0.99999994), s = mean / (2.0 - mean), q = s * s;
    float faint = s * (q * (q * (q * 0.29 + 0.4) + 0.66666667) + 2.0);
    float x = n * (mean < 0.25 ? faint : log2(1.0 - mean) * -0.69314718);
    float small = x * (1.0 - x * (0.5 - x * (0.16666667 - x * 0.041666667)));
    return x < 0.05 ? small : 1.0 - exp2(-1.44269504 * x);
}

// Premultiplied colour and coverage.
vec4 resolve_color(sums t) {
    float coverage = covered_in_the_mean(t.target0.a, t.target1);
    float share = t.target0.a > 0.0 ? coverage / t.target0.a : 0.0;
    return vec4(t.target0.rgb * share, coverage);
}
