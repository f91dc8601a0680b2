// Stochastic transparency: which of a pixel's samples a fragment covers, and what is seen of it.
//
// Enderton, Sintorn, Shirley and Luebke, "Stochastic Transparency", TVCG 17(8), 2011: every
// fragment covers each sample with probability alpha, each sample keeps the depth of the nearest
// fragment that covers it, and the share of samples that are not nearer than a fragment is an
// unbiased estimate of the transmittance in front of it. With one sample and fragments that are
// opaque where they cover, this is the hashed alpha test of Wyman and McGuire, "Hashed Alpha
// Testing", I3D 2017.

// A key that hangs on a number, too: on the same bits for a float and for the double it becomes.
// What is beyond floats has no rest beside an infinite one, and hangs on its own bits.
FN uint joined_number(uint key, real x) {
    real rest = x - rounded_to_float(x);
    real known = select(abs(rest) <= abs(x), rest, x);
    return joined(joined(joined(key, float_bits(x)), low_bits(known)), high_bits(known));
}

// What a fragment's random numbers hang on: the seed, its pixel's place in the display, its depth
// and alpha. Not on when it arrived.
FN uint fragment_key(uint seed, uint row, uint column, real depth, real alpha) {
    uint pixel = joined(joined(key_of_seed(seed), row), column);
    return joined_number(joined_number(pixel, depth), alpha);
}

// A bit for each sample: sample s is bit s of low, or s - 32 of high.
STRUCT(coverage) { uint low, high; };

// The samples that a fragment covers: each with probability alpha, to the resolution of share_of.
// `twin`: how many fragments with the same key its pixel had before; without it twins would cover
// the same samples and hide no more than one of them. Stratified: R of S samples at random, where R
// is one of the two integers next to alpha S, that on the mean over xi (paper, section 3.2). A set
// of R is drawn one sample after the other, each with the chance that is left.
FN coverage coverage_of(uint fragment, uint twin, real alpha, int samples, int stratified) {
    uint key = joined(fragment, twin);
    real wanted = alpha * K(samples);
    real near = nearest_integer(wanted);
    real whole = near - select(near > wanted, K(1.0), K(0.0));
    real rest = wanted - whole;
    real xi = random_share(key, 0);
    real left = whole + select(xi < rest, K(1.0), K(0.0));
    coverage c;
    c.low = U(0u);
    c.high = U(0u);
    for (int s = 0; s < samples; ++s) {
        real chance = random_share(key, s + 1);
        truth taken = chance < alpha;
        if (stratified > 0) taken = chance * K(samples - s) < left;
        left = left - select(taken, K(1.0), K(0.0));
        if (s < 32) c.low = c.low | (one_where(taken) << s);
        if (s > 31) c.high = c.high | (one_where(taken) << (s - 32));
    }
    return c;
}

// What a sample has of a fragment that lies no nearer than what it holds: 1 or nothing.
FN number seen_by(real nearest, real depth) { return select(nearest < depth, K(0.0), K(1.0)); }
