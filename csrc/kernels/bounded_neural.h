// Bounded neural transmittance: what power moments leave open, a small network decides.
//
// Of all distributions of absorbance with a ray's moments, and with a surface of absorbance `own`
// at z, the one through z has the least absorbance L in front of z, and none has more than L + W, W
// being its weight at z less `own` (Chebyshev, Markov, Stieltjes; MBOIT 3.2 takes L + beta (W +
// own) with one beta for all). The network's sigmoid is beta. It sees the moments, as the shape
// that they say the distribution has, and the surface; what it says can leave neither bound, and
// does not matter where few surfaces are and moments determine all.
//
// Included once for each count of nodes, after power_moments.h and network.h. A network of two
// layers of HIDDEN: OF_SURFACE inputs are a fragment's, then NAMED(OF_RAY) are its pixel's.

#ifndef HIDDEN
#define HIDDEN 8
#define OF_SURFACE 4
#define OF_RAY (2 * NODES) // with four moments 4, with six 6
#define RAY_INPUTS (OF_SURFACE + OF_RAY)
#endif

// What a pixel's fragments share: of its absorbance along z the mean, as its distance from the
// first node, 1 / deviation, 1 / total, and the network's inputs.
STRUCT(NAMED(outline)) {
    number mean;
    number inverse_deviation;
    number inverse_total;
    values seen;
};

// Moments as the rule has them: without loss, since the weight of its node g_i is
// d / (e_i p_n'(g_i)^2), terms of one sign, and d what the last moment is above that of the nodes.
// Of inputs that are logarithms, what these are taken of.
FN NAMED(outline) NAMED(shape_of)(NAMED(rule) r, real b0) {
    const real least = K(BY_PRECISION(1e-37, 1e-300));
    PRECISE NAMED(outline) o;
    real apart[NODES]; // from the first node, then from the mean
    real share[NODES];
    real all = K(0.0);
    for (int i = 0; i < NODES; ++i) {
        apart[i] = (r.g[i] - r.g[0]) + (r.g_low[i] - r.g_low[0]);
        real slope = K(1.0);
        for (int k = 0; k < NODES; ++k)
            if (k != i) slope = slope * ((r.g[i] - r.g[k]) + (r.g_low[i] - r.g_low[k]));
        share[i] = r.d / max(r.e[i] * slope * slope, least);
        all = all + share[i];
    }
    real mean = K(0.0);
    for (int i = 0; i < NODES; ++i) {
        share[i] = share[i] / max(all, least);
        mean = mean + share[i] * apart[i];
    }
    real moment[7]; // central
    for (int k = 2; k <= 2 * NODES && k < 7; ++k) moment[k] = k == 2 * NODES ? r.d : K(0.0);
    for (int i = 0; i < NODES; ++i) {
        real beside = apart[i] - mean;
        real power = share[i] * beside;
        for (int k = 2; k <= 2 * NODES && k < 7; ++k) {
            power = power * beside;
            moment[k] = moment[k] + power;
        }
    }
    real variance = max(moment[2], K(BY_PRECISION(1e-18, 1e-30)));
    real deviation = sqrt(variance);
    real total = max(b0, K(1e-30));
    o.mean = mean;
    o.inverse_deviation = 1.0 / deviation;
    o.inverse_total = 1.0 / total;
    o.seen.x[0] = total;
    o.seen.x[1] = variance;
    real third = moment[3] / (variance * deviation);
    o.seen.x[2] = clamp(third, K(-6.0), K(6.0));
    real fourth = moment[4] / (variance * variance);
    o.seen.x[3] = clamp(fourth, K(1.0), K(403.428793492735123));
#if NODES > 2
    o.seen.x[4] = moment[5] / (variance * variance * deviation);
    real sixth = moment[6] / (variance * variance * variance);
    o.seen.x[5] = clamp(sixth, K(1.0), K(1.6e5));
#endif
    return o;
}

// unit: how long z's unit is in the image's range, of which the network knows deviations; 1, or
// half a pixel's own extent.
FN values NAMED(inputs_of)(values shape, real unit) {
    PRECISE values seen;
    seen.x[0] = clamp(logarithm(shape.x[0]), K(-8.0), K(8.0));
    seen.x[1] = max(0.5 * logarithm(shape.x[1]) + logarithm(unit), K(-8.0));
    seen.x[2] = shape.x[2];
    seen.x[3] = logarithm(shape.x[3]);
#if NODES > 2
    // these grow as powers of how far tails reach: their logarithms, with the sign of the fifth
    real fifth = shape.x[4];
    real size = logarithm(1.0 + clamp(abs(fifth), K(0.0), K(2.2e4)));
    seen.x[4] = select(fifth < 0.0, -size, size);
    seen.x[5] = logarithm(shape.x[5]);
#endif
    return seen;
}

FN NAMED(outline) NAMED(outline_of)(NAMED(rule) r, real b0, real unit) {
    NAMED(outline) o = NAMED(shape_of)(r, b0);
    o.seen = NAMED(inputs_of)(o.seen, unit);
    return o;
}

// Of a surface at z: absorbance that is in front of it for sure, what else may be, and the
// network's inputs.
STRUCT(NAMED(outlook)) {
    number least;
    number room;
    values seen;
};

// o: but for `seen`.
FN NAMED(outlook) NAMED(outlook_at)(NAMED(rule) r, NAMED(outline) o, real b0, real z, real own) {
    NAMED(masses) mass = NAMED(masses_at)(r, z);
    PRECISE NAMED(outlook) at;
    real least = NAMED(absorbance_past)(mass, b0, own, K(0.0));
    real most = NAMED(absorbance_past)(mass, b0, own, K(1.0));
    real room = max(most - least, K(0.0));
    at.least = least;
    at.room = room;
    at.seen.x[0] = least * o.inverse_total;
    at.seen.x[1] = room * o.inverse_total;
    at.seen.x[2] = own;
    real beside = ((z - r.g[0]) - r.g_low[0]) - o.mean;
    at.seen.x[3] = clamp(beside * o.inverse_deviation, K(-8.0), K(8.0));
    return at;
}

// The first layer's sums as far as they are the same for all of a pixel.
FN values NAMED(first_sums)(address weights, NAMED(outline) o) {
    values begun = layer_bias(weights, RAY_INPUTS, HIDDEN);
    return layer_sum(weights, begun, o.seen, OF_SURFACE, OF_RAY, RAY_INPUTS, HIDDEN);
}

// What the network says: the share of what may be in front of a surface that is counted, which is
// the sigmoid of this.
FN number NAMED(network_output)(address weights, values begun, NAMED(outlook) at) {
    values first = layer_sum(weights, begun, at.seen, 0, OF_SURFACE, RAY_INPUTS, HIDDEN);
    values second = layer_outputs(weights + (RAY_INPUTS + 1) * HIDDEN, rectified(first, HIDDEN),
                                  HIDDEN, HIDDEN);
    values last = layer_outputs(weights + (RAY_INPUTS + 1) * HIDDEN + (HIDDEN + 1) * HIDDEN,
                                rectified(second, HIDDEN), HIDDEN, 1);
    return last.x[0];
}

FN number NAMED(predicted_absorbance)(address weights, values begun, NAMED(outlook) at) {
    real share = sigmoid(NAMED(network_output)(weights, begun, at));
    real absorbance_in_front = at.least + share * at.room;
    return absorbance_in_front;
}
