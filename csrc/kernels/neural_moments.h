// Neural moment transparency: a network reads the transmittance in front of a fragment off four
// power moments of its pixel's absorbance, their number of fragments and their extent in depth.
//
// Tsopouridis, Vasilakis and Fudos, "Neural Moment Transparency", Eurographics Short Papers 2024:
// seven features (3.1), layers of 32, 16 and 1 (figure 3). The first feature is the fragment's own,
// the others are its pixel's.

#define NEURAL_FEATURES 7
#define NEURAL_FIRST 32
#define NEURAL_SECOND 16
// Where the weights of the second and the last layer begin, and how many there are.
#define NEURAL_FIRST_END (NEURAL_FIRST * (NEURAL_FEATURES + 1))
#define NEURAL_SECOND_END (NEURAL_FIRST_END + NEURAL_SECOND * (NEURAL_FIRST + 1))
#define NEURAL_WEIGHTS (NEURAL_SECOND_END + NEURAL_SECOND + 1)

// Where a pixel's fragments begin and end, as render targets of 16 bits hold it: in half floats, as
// published, or in words. `blur` is at least what rounding to these moves them by.
STRUCT(neural_extent) { number nearest, farthest, blur; };

FN number extent_blur(int words) {
    real blur = K(0.00048828125); // of half floats of [-1, 1] at most half of that
    if (words > 0) blur = K(0.000030517578125);
    return blur;
}

FN neural_extent held_extent(int words, real nearest, real farthest) {
    neural_extent e;
    e.blur = extent_blur(words);
    real begins = rounded_to_half(nearest);
    real ends = rounded_to_half(farthest);
    if (words > 0) {
        real low = 0.5 + 0.5 * nearest;
        real high = 0.5 + 0.5 * farthest;
        begins = 2.0 * unorm16_value(unorm16_word(low)) - 1.0;
        ends = 2.0 * unorm16_value(unorm16_word(high)) - 1.0;
    }
    e.nearest = begins;
    e.farthest = ends;
    return e;
}

// Depth as moments are taken of it: as it is (5), or, with words, in a range of the pixel's own,
// from -1 at its nearest fragment to 1 at its farthest; 0 where these are one.
FN number neural_depth(int words, neural_extent e, real z) {
    own_extent ends;
    ends.nearest = e.nearest;
    ends.farthest = e.farthest;
    real own = depth_within(ends, z);
    if (words == 0) own = z;
    return own;
}

// (exp(z) - exp(nearest)) / (exp(farthest) - exp(nearest)), with all powers divided by
// exp(farthest), of such a depth. What leaves [0, 1], since the extent is rounded, is clamped. 0
// where the extent is a point.
FN number relative_depth(int words, neural_extent e, real z) {
    real farthest = e.farthest;
    real extent = e.farthest - e.nearest;
    real at = neural_depth(words, e, z);
    if (words > 0) {
        farthest = K(1.0);
        extent = select(extent > 0.0, K(2.0), K(0.0));
    }
    real least = exponential(-extent);
    real d = (exponential(min(at - farthest, K(0.0))) - least) / (1.0 - least);
    return select(least < 1.0, clamp(d, K(0.0), K(1.0)), K(0.0));
}

// A pixel's features: the count, b0, and b1 to b4, which are stored divided by b0.
FN values neural_features(real count, real b0, real b1, real b2, real b3, real b4) {
    values f;
    f.x[0] = count;
    f.x[1] = b0;
    f.x[2] = b0 * b1;
    f.x[3] = b0 * b2;
    f.x[4] = b0 * b3;
    f.x[5] = b0 * b4;
    return f;
}

// What all fragments of a pixel begin the first layer with.
FN values neural_ray(address weights, values features) {
    values bias = layer_bias(weights, NEURAL_FEATURES, NEURAL_FIRST);
    return layer_sum(weights, bias, features, 1, NEURAL_FEATURES - 1, NEURAL_FEATURES,
                     NEURAL_FIRST);
}

// What the network says.
FN number neural_share(address weights, values ray, real d) {
    values own;
    own.x[0] = d;
    values first = layer_sum(weights, ray, own, 0, 1, NEURAL_FEATURES, NEURAL_FIRST);
    first = rectified(first, NEURAL_FIRST);
    values second = layer_outputs(weights + NEURAL_FIRST_END, first, NEURAL_FIRST, NEURAL_SECOND);
    second = rectified(second, NEURAL_SECOND);
    values last = layer_outputs(weights + NEURAL_SECOND_END, second, NEURAL_SECOND, 1);
    return sigmoid(last.x[0]);
}

// What reaches z: that, but never less than what passes all fragments, which is known; that behind
// them all, and 1 in front of them.
FN number neural_transmittance(neural_extent e, real total, real z, real said) {
    real in_front = select(z < e.nearest - e.blur, K(1.0), max(said, total));
    return select(z > e.farthest + e.blur, total, in_front);
}
