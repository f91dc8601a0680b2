// Non-linearly quantised moments: four moments as two depths, a weight and an offset.
//
// Peters, "Non-Linearly Quantized Moment Shadow Maps", HPG 2017, read with overestimation as in the
// supplement of Sharpe, "Moment Transparency", HPG 2018. The first three moments are those of two
// nodes, the Gauss rule; the fourth is that of the nodes and an offset, which is the last pivot d
// of the Hankel matrix. So they are another spelling of the rule of power_moments.h, and
// transmittance is read with it: roots in the form that does not cancel, whatever the offset.
//
// The published code says how such numbers are read, not what words they are kept in. Here nodes
// and weight are unsigned normalised words, and the offset's word holds its eighth root. Measured
// on 6300 rays of 2 to 60 surfaces, |T - unquantised T| that a word for the offset alone brings, at
// beta 0:
//
//     root       1         2         3         4         6         8         12
//     mean       3.7e-2    4.1e-4    2.0e-5    6.9e-6    3.0e-6    2.4e-6    2.2e-6
//     99.9 %     1         7.5e-2    3.8e-3    1.0e-3    3.2e-4    1.9e-4    1.3e-4
//
// Words of nodes and weight bring 6.6e-4 on the mean, most of it where a node is rounded to the
// other side of z. For the same reason moments are biased, by as much as Moment Transparency does
// without words: T then is nearer to what it is there than with any other bias from 0 to 1e-5.
//
// Included with NODES 2, after power_moments.h and storage.h.

STRUCT(NAMED(nonlinear)) {
    number node[2]; // node[0] <= node[1]
    number weight;  // of node[1]
    number offset;  // what b4 exceeds that of the nodes by
};

FN NAMED(nonlinear) NAMED(nonlinear_of)(NAMED(rule) r) {
    NAMED(nonlinear) n;
    n.node[0] = r.g[0];
    n.node[1] = r.g[1];
    n.weight = r.e[0] / (r.e[0] + r.e[1]);
    n.offset = r.d;
    return n;
}

// Nodes at one depth, a weight of 0 and an offset of 0 are kept from making the rule degenerate:
// the first two as published.
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
    r.g_low[1] = apart - (r.g[1] - r.g[0]); // a float's; doubles need none
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
    w.offset = unorm16_word(sqrt(sqrt(sqrt(share))));
    return w;
}

FN NAMED(nonlinear) NAMED(nonlinear_values)(NAMED(nonlinear) w, real low, real extent) {
    real root = unorm16_value(w.offset);
    real square = root * root;
    real share = square * square;
    real most = extent * extent * 0.125;
    NAMED(nonlinear) n;
    for (int i = 0; i < 2; ++i) {
        real place = unorm16_value(w.node[i]) * extent;
        n.node[i] = low + place;
    }
    n.weight = unorm16_value(w.weight);
    n.offset = share * share * (most * most);
    return n;
}
