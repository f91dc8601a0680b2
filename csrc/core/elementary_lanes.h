/* Exponentials and logarithms of doubles, right to about half a unit in the last place: what is
 * large of a series is summed in pairs. In lanes, of which elementary.c has one number. Included
 * after kernels/pairs.h, where a number is a double; reductions are those of the kernels. */

/* r^3 (1/3! + r/4! + r^2/5! + ...): two chains, of even and of odd powers, do not wait for each
 * other. */
FN real terms_from_third(real r, real square) {
    enum { PAIRS = 7 };
    static const double even[PAIRS] = {1.0 / 6.0,         1.0 / 120.0,      1.0 / 5040.0,
                                       1.0 / 362880.0,    1.0 / 39916800.0, 1.0 / 6227020800.0,
                                       1.0 / 1307674368e3},
                        odd[PAIRS] = {1.0 / 24.0,         1.0 / 720.0,       1.0 / 40320.0,
                                      1.0 / 3628800.0,    1.0 / 479001600.0, 1.0 / 87178291200.0,
                                      1.0 / 20922789888e3};
    real of_even = K(even[PAIRS - 1]), of_odd = K(odd[PAIRS - 1]);
    for (int k = PAIRS - 2; k >= 0; --k) {
        of_even = even[k] + square * of_even;
        of_odd = odd[k] + square * of_odd;
    }
    return square * r * (of_even + r * of_odd);
}

/* first + r + half + rest, each part smaller than the one before unless `first` is 0. */
FN pair sum_of_parts(real first, real r, real half, real rest) {
    pair o;
    real sum = first + r, both = sum + half;
    o.high = both;
    o.low = (r - (sum - first)) + ((half - (both - sum)) + rest);
    return o;
}

/* exp(x) = 2^n (1 + rest) by its n, and first + rest; |rest| is below 0.42. */
FN pair power_of(real x, double first, real *n) {
    const double ln2_high = 0.69314718036912381649, ln2_low = 1.90821492927058770e-10;
    *n = nearest_integer(x * 1.4426950408889634);
    real most = x - *n * ln2_high, away = *n * ln2_low;
    real r = most - away, r_low = (most - r) - away;
    pair square = exact_product(r, r);
    real rest = r_low + r * r_low + 0.5 * square.low + terms_from_third(r, square.high);
    return sum_of_parts(K(first), r, 0.5 * square.high, rest);
}

/* exp(x) - 1 for |x| from 2^-54 on to 700. */
FN real power_less_one(real x) {
    real n;
    pair rest = power_of(x, 0.0, &n);
    real scale = times_power_of_two(K(1.0), n);
    rest.high = scale * rest.high;
    rest.low = scale * rest.low;
    return pair_sum(exact_sum(scale, K(-1.0)), rest).high;
}

/* ln(x + low) + away ln 2, for positive normal x and a low that is little beside it: with
 * 2^n (1 + f) and s = f / (2 + f) it is n ln 2 + 2 s + 2 s^3 / 3 + 2 s^5 / 5 + ... */
FN real logarithm_of(real x, real low, real away) {
    enum { TERMS = 12 };
    const double ln2_high = 0.69314718036912381649, ln2_low = 1.90821492927058770e-10;
    real n = exponent_of(x);
    real fraction = times_power_of_two(x, -n);
    pair f = exact_sum(fraction - 1.0, low * times_power_of_two(K(1.0), -n));
    pair s = pair_quotient(f, pair_sum(pair_of(K(2.0)), f)), twice;
    twice.high = s.high + s.high;
    twice.low = s.low + s.low;
    real square = s.high * s.high, series = K(0.0);
    for (int k = TERMS; k > 0; --k) series = square * (K(1.0 / (2 * k + 1)) + series);
    n = n + away;
    pair of_two = pair_sum(pair_of(n * ln2_high), exact_product(n, K(ln2_low)));
    pair of_fraction = pair_sum(twice, pair_of(twice.high * series));
    return pair_sum(of_two, of_fraction).high;
}
