// Deep fragments: the two nearest surfaces of a pixel as they are, and behind them a colour that a
// network makes of what all others leave in sums.
//
// After DFA (Tsopouridis, Vasilakis and Fudos, "Deep and Fast Approximate Order Independent
// Transparency", 2024), as far as "Neural Moment Transparency" by the same authors tells of it.
// What the sums are and what the network decides is ours: two guesses of the colour, each within
// the range of the surfaces' colours and hence right for any brightness, are mixed by the share
// that it says. The first weights surfaces by what would reach them if absorbance were spread
// evenly, the second by absorbance alone.

#define DEEP_FEATURES 5
#define DEEP_FIRST 32
#define DEEP_SECOND 16
// Where the weights of the second and the last layer begin.
#define DEEP_FIRST_END (DEEP_FIRST * (DEEP_FEATURES + 1))
#define DEEP_SECOND_END (DEEP_FIRST_END + DEEP_SECOND * (DEEP_FIRST + 1))

// What reaches z of a surface behind the second of its pixel, if the absorbance b0 were spread
// evenly from that to the last, which is known in less digits.
FN number even_transmittance(real b0, real second, real last, real z) {
    real extent = last - second;
    real behind = clamp((z - second) / extent, K(0.0), K(1.0));
    real v = select(extent > 0.0, behind, K(0.0));
    real absorbs = b0 * v;
    return exponential(-absorbs);
}

// What is left of a pixel's absorbance without its two nearest surfaces'. So little that its
// inverse might be infinite is nothing.
FN number tail_absorbance(real b0, real first, real second) {
    real left = (b0 - first) - second;
    return select(left > K(BY_PRECISION(1e-30, 1e-290)), left, K(0.0));
}

// 1 - exp(-tail), to all digits.
FN number covered_by(real tail) {
    real thick = 1.0 - exponential(-tail);
    real thin = tail * (1.0 - tail * (0.5 - tail * K(1.0 / 6.0)));
    return select(tail < K(BY_PRECISION(1e-2, 1e-5)), thin, thick);
}

// What the network sees: the absorbance behind the second surface, how much of it stays when
// weighted by even transmittance, what it lets through, and how far surfaces are apart.
FN values deep_features(real tail, real near, real first, real second, real last) {
    values f;
    real share = min(near / tail, K(1.0));
    f.x[0] = tail;
    f.x[1] = select(tail > 0.0, share, K(1.0));
    f.x[2] = exponential(-tail);
    f.x[3] = second - first;
    f.x[4] = max(last - second, K(0.0));
    return f;
}

// The share of the first guess; none where its sum is too little for half floats.
FN number deep_share(address weights, values seen, real near) {
    values first = rectified(layer_outputs(weights, seen, DEEP_FEATURES, DEEP_FIRST), DEEP_FIRST);
    values second = rectified(
        layer_outputs(weights + DEEP_FIRST_END, first, DEEP_FIRST, DEEP_SECOND), DEEP_SECOND);
    values last = layer_outputs(weights + DEEP_SECOND_END, second, DEEP_SECOND, 1);
    return select(near > 0.0, sigmoid(last.x[0]), K(0.0));
}

// Of a sum over surfaces, what it comes to in the image: `covered` is what the tail covers of it.
FN number deep_color(real covered, real share, real near_sum, real near, real sum, real tail) {
    real first = select(near > 0.0, near_sum / near, K(0.0));
    real second = select(tail > 0.0, sum / tail, K(0.0));
    real mixed = covered * (share * first + (1.0 - share) * second);
    return mixed;
}

// What a surface of absorbance a and even transmittance w counts in the image, by its alpha, where
// `through` passes the two nearest. It is more than 1 where little else is in the sums. What is too
// little for half floats is not in them: it counts as in front of all others at most.
FN number deep_transmittance(real through, real covered, real share, real near, real tail, real a,
                             real w, real alpha) {
    real weighted = a * w;
    real counts = deep_color(covered, share, weighted, near, a, tail);
    real thin = deep_color(covered, share, w, near, K(1.0), tail); // a / alpha goes to 1
    real T = select(alpha > 0.0, counts / alpha, thin);
    T = select(alpha < K(5.9604644775390625e-8), min(T, K(1.0)), T); // 2^-24
    return select(tail > 0.0, T, through);
}
