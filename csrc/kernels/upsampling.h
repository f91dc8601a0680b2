// What pixels between those of a smaller picture take of its four nearest.
//
// Bilinear, or beside that by how near the opaque surfaces of the two pictures are to each other:
// the joint bilateral upsampling of Kopf, Cohen, Lischinski and Uyttendaele, 2007, with the depth
// of opaque surfaces for its guide. What was drawn small was hidden by the smaller picture's
// surface, so that of a pixel whose own is elsewhere tells little. Where the smaller picture's are
// the nearest and the farthest of its pixels', turn about, two of the four are as the pixel's at an
// edge.

// Shares of the four, of sum 1.
STRUCT(four_shares) {
    number upper_left;
    number upper_right;
    number lower_left;
    number lower_right;
};

// across, along: from the middle of the upper left to that of its neighbours, in [0, 1).
FN four_shares bilinear_shares(real across, real along) {
    PRECISE four_shares s;
    s.upper_left = (1.0 - along) * (1.0 - across);
    s.upper_right = (1.0 - along) * across;
    s.lower_left = along * (1.0 - across);
    s.lower_right = along * across;
    return s;
}

// Near 1 where two surfaces are as far away, 1/2 where they are apart by 1/64 of the farther's
// depth, above 1/256 anywhere. Depths are positive.
FN number likeness(real depth, real other) {
    real farther = max(depth, other);
    real apart = abs(depth - other) / farther * 64.0;
    real like = 1.0 / (1.0 + apart * apart) + K(0.00390625);
    return select(like > 0.0, like, K(0.00390625));
}

// `s`, weighted by how like the surface at `depth` those of the four are.
FN four_shares depth_aware_shares(four_shares s, real depth, real upper_left, real upper_right,
                                  real lower_left, real lower_right) {
    PRECISE four_shares o;
    o.upper_left = s.upper_left * likeness(depth, upper_left);
    o.upper_right = s.upper_right * likeness(depth, upper_right);
    o.lower_left = s.lower_left * likeness(depth, lower_left);
    o.lower_right = s.lower_right * likeness(depth, lower_right);
    real sum = (o.upper_left + o.upper_right) + (o.lower_left + o.lower_right);
    o.upper_left = o.upper_left / sum;
    o.upper_right = o.upper_right / sum;
    o.lower_left = o.lower_left / sum;
    o.lower_right = o.lower_right / sum;
    return o;
}
