// Moment Transparency beyond what power moments bring: its absorbance, the second pass of moments,
// and four moments in words of 16 bits.
//
// Sharpe, "Moment Transparency", HPG 2018, with its supplement. The words are those of Peters and
// Klein, "Moment Shadow Mapping", I3D 2015 for depths in [0, 1], and of Peters et al., "Improved
// Moment Shadow Maps", JCGT 6(1), 2017 for [-1, 1]: linear in the moments, chosen so that surfaces
// fill the range of a word.

// -ln(1 - (1 - shrink) alpha), the optical depth of a surface: supplement 1.1 scales every alpha
// so that none is opaque. What rounding takes from the scaled alpha is put back to first order.
FN number scaled_absorbance(real alpha, real shrink) {
    real low = alpha * shrink;
    real scaled = alpha - low;
    real lost = (alpha - scaled) - low;
    real more = lost / (1.0 - scaled);
    return absorbance(scaled) + more;
}

// 1 - exp(-b0), what a ray of total absorbance b0 covers, to the last digits where b0 is small,
// too: the rounding error of exp is divided out again.
FN number covered(real b0) {
    real through = exponential(-b0);
    real seen = max(through, K(0.25));
    real whole = 1.0 - through;
    real small = (1.0 - seen) * (b0 / max(-logarithm(seen), K(BY_PRECISION(1e-30, 1e-300))));
    return select(through > 0.5, select(through < 1.0, small, b0), whole);
}

// The transmittance in front of a depth after two passes of moments (supplement 1.2). The second
// moments are of what the first let through, and thus of less absorbance in all: what they make T
// cover is scaled by `ratio`, so that it ends at what the first total does.
FN number covered_ratio(real first, real second) {
    return covered(first) / max(covered(second), K(1e-4));
}

// Moments of blocks may hide all of a pixel's fragments behind its neighbours'. What is left of
// them is next to nothing, not nothing: scaled to what they cover, it still has their colours.
FN number next_to_nothing(real T) { return max(T, K(BY_PRECISION(1e-37, 1e-300))); }

FN number two_pass_transmittance(real T, real ratio) {
    real share = (1.0 - T) * ratio;
    return next_to_nothing(1.0 - share);
}

// What a half float keeps of a total absorbance, none of which is infinite.
FN number half_absorbance(real b0) { return min(rounded_to_half(b0), K(65504.0)); }

// Four numbers: moments, or words that hold them.
STRUCT(four) { number x[4]; };

FN number weighed(four m, real a, real b, real c, real d) {
    real sum = a * m.x[0] + b * m.x[1] + c * m.x[2] + d * m.x[3];
    return sum;
}

// Words of the means of z, z^2, z^3, z^4 for z in [0, 1], and what they decode to.
FN four unit_words(four m) {
    four w;
    w.x[0] = weighed(m, K(-2.07224649), K(32.23703778), K(-68.571074599), K(39.3703274134));
    w.x[1] = weighed(m, K(13.7948857237), K(-59.4683975703), K(82.0359750338), K(-35.364903257));
    w.x[2] = weighed(m, K(0.105877704), K(-1.9077466311), K(9.3496555107), K(-6.6543490743));
    w.x[3] = weighed(m, K(9.7924062118), K(-33.7652110555), K(47.9456096605), K(-23.9728048165));
    w.x[0] = w.x[0] + K(0.035955884801);
    for (int k = 0; k < 4; ++k) w.x[k] = unorm16_word(w.x[k]);
    return w;
}

FN four unit_moments(four w) {
    for (int k = 0; k < 4; ++k) w.x[k] = unorm16_value(w.x[k]);
    w.x[0] = w.x[0] - K(0.035955884801);
    four m;
    m.x[0] = weighed(w, K(0.222774414589751047), K(0.0771972860781272907), K(0.792698663656028505),
                     K(0.0319417554614097006));
    m.x[1] = weighed(w, K(0.154967926115836063), K(0.139462942653536152), K(0.796341583785875667),
                     K(-0.172282317301990378));
    m.x[2] = weighed(w, K(0.145198894564436832), K(0.212020215682526769), K(0.725869446385070819),
                     K(-0.275801481149157599));
    m.x[3] = weighed(w, K(0.163127442991377981), K(0.259143226644109652), K(0.653909249673695231),
                     K(-0.337613173405817432));
    return m;
}

// The same for z in [-1, 1].
FN four symmetric_words(four m) {
    const real none = K(0.0);
    four w;
    w.x[0] = weighed(m, K(1.5), none, K(-2.0), none) + 0.5;
    w.x[1] = weighed(m, none, K(4.0), none, K(-4.0));
    w.x[2] = weighed(m, K(0.866025403784438647), none, K(-0.384900179459750510), none) + 0.5;
    w.x[3] = weighed(m, none, K(0.5), none, K(0.5));
    for (int k = 0; k < 4; ++k) w.x[k] = unorm16_word(w.x[k]);
    return w;
}

FN four symmetric_moments(four w) {
    const real none = K(0.0);
    for (int k = 0; k < 4; ++k) w.x[k] = unorm16_value(w.x[k]);
    w.x[0] = w.x[0] - 0.5;
    w.x[2] = w.x[2] - 0.5;
    four m;
    m.x[0] = weighed(w, K(-0.333333333333333333), none, K(1.73205080756887729), none);
    m.x[1] = weighed(w, none, K(0.125), none, K(1.0));
    m.x[2] = weighed(w, K(-0.75), none, K(1.29903810567665797), none);
    m.x[3] = weighed(w, none, K(-0.125), none, K(1.0));
    return m;
}
