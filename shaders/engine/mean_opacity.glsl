// n layers of the mean opacity: Bavoil and Myers, 2008.

// 1 - (1 - mean)^n, for faint ones by a series.
float covered_in_the_mean(float sum, float n) {
    float mean = min(sum / max(n, 1.0), 0.99999994), s = mean / (2.0 - mean), q = s * s;
    float faint = s * (q * (q * (q * 0.29 + 0.4) + 0.66666667) + 2.0);
    float x = n * (mean < 0.25 ? faint : log2(1.0 - mean) * -0.69314718);
    float small = x * (1.0 - x * (0.5 - x * (0.16666667 - x * 0.041666667)));
    return x < 0.05 ? small : 1.0 - exp2(-1.44269504 * x);
}
