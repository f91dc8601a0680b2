// Of n fragments whose alpha sums to `sum`, what n layers of their mean opacity cover (Bavoil and
// Myers 2008). DOUBLE is 1.

// 1 - exp(-x), to all digits for small x, too.
number absorbed(real x) {
    real series = x * (1.0 - x * (0.5 - x * (K(1.0 / 6.0) - x * (K(1.0 / 24.0) - x * K(1.0 / 120.0)))));
    real rest = 1.0 - exponential(-x);
    return x < K(0.0009765625) ? series : rest;
}

// The same of few whole layers: mean (1 + (1 - mean) (1 + ..)), as csrc/core/stages/blend.h has it.
number covered_by_few(real mean, real n) {
    real through = 1.0 - mean;
    real shares = K(0.0);
    for (int k = 0; k < 16; ++k) {
        real more = through * shares;
        if (n > K(k)) shares = 1.0 + more;
    }
    return mean * shares;
}

number covered_in_the_mean(real sum, real n) {
    real mean = n > 0.0 ? sum / n : K(0.0); // pictures joined have parts of a fragment
    real most = 1.0 - K(1.1102230246251565e-16); // the number below 1
    real absorbs = n * absorbance(min(mean, most));
    bool few = n <= K(16.0) && nearest_integer(n) == n;
    real covered = few ? covered_by_few(mean, n) : absorbed(absorbs);
    covered = mean < 1.0 ? covered : K(1.0);
    covered = n < 1.0 ? covered : min(covered, sum); // no more than each for itself
    // one layer is its own mean; below 2^-60 a mean might not be normal
    bool as_it_is = sum < K(8.673617379884035e-19) || (n == 1.0 && sum < 1.0);
    return as_it_is ? sum : covered;
}
