// What makes means of sums, as C's inverse_of_sum: of no absorbance 0.

double inverse_of_sum(double total) {
    precise double inverse = 1.0lf / max(total, 2.2250738585072014e-308lf);
    return inverse;
}

// The same of what a target holds.
number inverse_held(real total) {
    real inverse = K(1.0) / max(total, K(BY_PRECISION(1.17549435e-38, 2.2250738585072014e-308)));
    return inverse;
}
