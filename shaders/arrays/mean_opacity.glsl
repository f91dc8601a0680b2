// Of n fragments whose alpha sums to `sum`, what n layers of their mean opacity cover (Bavoil and
// Myers 2008). DOUBLE is 1.

// 1 - exp(-x), to all digits for small x, too.
number absorbed(real x) {
    real series = x * (1.0 - x * (0.5 - x * (K(1.0 / 6.0) - x * (K(1.0 / 24.0) - x * K(1.0 / 120.0)))));
    real rest = 1.0 - exponential(-x);
    return x < K(0.0009765625) ? series : rest;
}

number covered_in_the_mean(real sum, real n) {
    real mean = n > 0.0 ? sum / n : K(0.0); // pictures joined have parts of a fragment
    real most = 1.0 - K(1.1102230246251565e-16); // the number below 1
    real absorbs = n * absorbance(min(mean, most));
    real covered = mean < 1.0 ? absorbed(absorbs) : K(1.0);
    covered = n < 1.0 ? covered : min(covered, sum); // no more than each for itself
    // one layer is its own mean; below 2^-60 a mean might not be normal
    bool as_it_is = sum < K(8.673617379884035e-19) || (n == 1.0 && sum < 1.0);
    return as_it_is ? sum : covered;
}
