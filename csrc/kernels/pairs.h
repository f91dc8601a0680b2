// Numbers of twice the digits: unevaluated sums high + low, low within half a unit in the last
// place of high. For differences that cancel; each operation is good to a few units of twice the
// digits.
//
// Dekker, "A floating-point technique for extending the available precision", 1971; Knuth, The Art
// of Computer Programming 2, 4.2.2. No result may overflow when multiplied by 2^27 (2^12 for
// float).

STRUCT(pair) { number high, low; };

FN pair pair_of(real x) {
    PRECISE pair o;
    o.high = x;
    o.low = K(0.0);
    return o;
}

// a + b where |a| >= |b|, or a is 0.
FN pair ordered_sum(real a, real b) {
    PRECISE pair o;
    real sum = a + b;
    real kept = sum - a;
    o.high = sum;
    o.low = b - kept;
    return o;
}

FN pair exact_sum(real a, real b) {
    PRECISE pair o;
    real sum = a + b;
    real of_b = sum - a;
    real of_a = sum - of_b;
    real lost_b = b - of_b;
    real lost_a = a - of_a;
    o.high = sum;
    o.low = lost_a + lost_b;
    return o;
}

// x with the last half of its digits rounded off.
FN number first_half(real x) {
    real much = x * K(BY_PRECISION(4097.0, 134217729.0)); // 2^12 + 1, 2^27 + 1
    real rest = much - x;
    return much - rest;
}

// Where C's target has an instruction that rounds a b - c once, it gives the same in one step
// (unless that is below the least normal number, which is below what any sum here keeps).
FN pair exact_product(real a, real b) {
    PRECISE pair o;
#ifdef FUSED_DIFFERENCE
    o.high = a * b;
    o.low = FUSED_DIFFERENCE(a, b, o.high);
#else
    real a1 = first_half(a);
    real a2 = a - a1;
    real b1 = first_half(b);
    real b2 = b - b1;
    real product = a * b;
    real lost = a1 * b1 - product;
    lost = lost + a1 * b2;
    lost = lost + a2 * b1;
    lost = lost + a2 * b2;
    o.high = product;
    o.low = lost;
#endif
    return o;
}

// Good to twice the digits of the larger of the two, which is what they are known to themselves.
FN pair pair_sum(pair a, pair b) {
    PRECISE pair high;
    high = exact_sum(a.high, b.high);
    real low = a.low + b.low;
    low = high.low + low;
    return ordered_sum(high.high, low);
}

FN pair pair_difference(pair a, pair b) {
    PRECISE pair minus;
    minus.high = -b.high;
    minus.low = -b.low;
    return pair_sum(a, minus);
}

FN pair pair_product(pair a, pair b) {
    PRECISE pair high;
    high = exact_product(a.high, b.high);
    real rest = a.high * b.low + a.low * b.high;
    rest = high.low + rest;
    return ordered_sum(high.high, rest);
}

FN pair pair_quotient(pair a, pair b) {
    real first = a.high / b.high;
    PRECISE pair left;
    left = pair_difference(a, pair_product(b, pair_of(first)));
    real second = left.high / b.high;
    return ordered_sum(first, second);
}

FN pair pair_select(truth t, pair a, pair b) {
    PRECISE pair o;
    o.high = select(t, a.high, b.high);
    o.low = select(t, a.low, b.low);
    return o;
}
