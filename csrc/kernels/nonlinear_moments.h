// Non-linearly quantised moments: four moments as two depths, a weight and an offset.
//
// Peters, "Non-Linearly Quantized Moment Shadow Maps", HPG 2017, read with overestimation as in the
// supplement of Sharpe, "Moment Transparency", HPG 2018. The first three moments are those of two
// nodes, the Gauss rule; the fourth is that of the nodes and an offset, which is the last pivot d of
// the Hankel matrix. So they are another spelling of the rule of power_moments.h, and transmittance
// is read with it: roots in the form that does not cancel, whatever the offset.
//
// The published code says how such numbers are read, not what words they are kept in. Here nodes and
// weight are unsigned normalised words, and the offset's word holds its fourth root: an offset is the
// mean of a product of two squared distances.
//
// Included with NODES 2, after power_moments.h and storage.h.

STRUCT(NAMED(nonlinear)) {
    number node[2]; // node[0] <= node[1]
    number weight;  // of node[1]
    number offset;  // what b4 exceeds that of the nodes by
};

// Of unbiased moments: bias would come out as offset.
FN NAMED(nonlinear) NAMED(nonlinear_of)(NAMED(rule) r) {
    NAMED(nonlinear) n;
    n.node[0] = r.g[0];
    n.node[1] = r.g[1];
    n.weight = r.e[0] / (r.e[0] + r.e[1]);
    n.offset = r.d;
    return n;
}

// Nodes at one depth, a weight of 0 and an offset of 0 are kept from making the rule degenerate: the
// first two as published.
FN NAMED(rule) NAMED(rule_of_nonlinear)(NAMED(nonlinear) n) {
    const real least = K(1e-6);
    real weight = clamp(n.weight, least, 1.0 - least);
    real apart = max(n.node[1] - n.node[0], least);
    real square = apart * apart;
    real offset = max(n.offset, K(1e-24));
    NAMED(rule) r;
    r.g[0] = n.node[0];
    r.g[1] = n.node[0] + apart;
    r.g_low[0] = K(0.0);
    r.g_low[1] = apart - (r.g[1] - r.g[0]);
    r.e[0] = offset / ((1.0 - weight) * square);
    r.e[1] = offset / (weight * square);
    r.d = offset;
    return r;
}

// Words for depths from `low` to low + extent; an offset is at most extent^4 / 64.
FN NAMED(nonlinear) NAMED(nonlinear_words)(NAMED(nonlinear) n, real low, real extent) {
    real square = extent * extent;
    real share = max(n.offset, K(0.0)) * 64.0 / (square * square);
    NAMED(nonlinear) w;
    for (int i = 0; i < 2; ++i) {
        real place = (n.node[i] - low) / extent;
        w.node[i] = unorm16_word(place);
    }
    w.weight = unorm16_word(n.weight);
    w.offset = unorm16_word(sqrt(sqrt(share)));
    return w;
}

FN NAMED(nonlinear) NAMED(nonlinear_values)(NAMED(nonlinear) w, real low, real extent) {
    real root = unorm16_value(w.offset) * extent;
    real square = root * root;
    NAMED(nonlinear) n;
    for (int i = 0; i < 2; ++i) {
        real place = unorm16_value(w.node[i]) * extent;
        n.node[i] = low + place;
    }
    n.weight = unorm16_value(w.weight);
    n.offset = square * square * 0.015625;
    return n;
}
