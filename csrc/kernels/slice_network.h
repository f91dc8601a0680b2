// What a network makes of slices of optical depth: of those that a pixel keeps of its own extent.
//
// Ours. As many slices as are kept stand at equal steps of a pixel's own range of depth
// (own_extent.h), the first at its nearest end and the last at its farthest. A fragment adds its
// code to the two around it (slices.h). So what slices before these two hold is in front of it for
// sure; of what the two hold besides its own code, some may be. Slices by themselves read as much
// of that as a medium would have that is even between slices; here a network says how much. It sees
// shares of the total, and neither counts nor steps: one network reads slices of all of these.
//
// Behind slices.h, own_extent.h and network.h. A network of two layers of SLICE_HIDDEN.

#define SLICE_INPUTS 10
#define SLICE_HIDDEN 8

// What rounds a fragment's code is its own in its pixel: by its place in the image's range, z in
// [-1, 1], to 65536 steps.
FN number own_slice_threshold(uint row, uint column, real z) {
    real word = whole_below(words_from_end(z));
    return slice_threshold(row, column, word);
}

// Where z is among slices, of which `last` follow the first. What is in front of the extent, or
// behind, by more than the word that its ends are rounded by, is -1 or 2 inside.
FN slice_place own_slice_place(own_extent e, real z, real last) {
    const real word = K(2.0 / 65535.0);
    real share = 0.5 + 0.5 * depth_within(e, z);
    slice_place place = slice_place_of(share, last);
    place.inside = select(z + word < e.nearest, K(-1.0), place.inside);
    place.inside = select(z > e.farthest + word, K(2.0), place.inside);
    return place;
}

// Sums of slices around a place, in steps: before the slice in front of its two, before each of
// these, behind them, behind the next; and of all.
STRUCT(slice_sums) { number outer, front, middle, back, beyond, all; };

// Of a place: absorbance that is in front of it for sure, what else may be, and the network's
// inputs.
STRUCT(slice_outlook) {
    number least;
    number room;
    values seen;
};

// inside: how far between its slices; near, code: of the fragment's own, absorbed what it absorbs;
// of a place without a fragment 0.
FN slice_outlook slice_outlook_at(slice_sums s, real inside, real near, real code, real absorbed,
                                  real quantum) {
    PRECISE slice_outlook at;
    real both = s.back - s.front;
    real open = max(both - code, K(0.0));
    open = select(abs(inside - 0.5) > 1.0, K(0.0), open);
    real sure = select(inside > 1.5, s.back, s.front);
    real twice =
        max(slice_depth(s.front, s.middle, s.back, inside) - slice_own(near, code, inside), K(0.0));
    real share = 1.0 / max(s.all, K(1.0));
    real even = (0.5 * twice - s.front) / max(open, K(1.0));
    at.least = sure * quantum;
    at.room = open * quantum;
    real total = max(s.all * quantum, K(1e-4));
    real room = max(open * quantum, K(1e-4));
    at.seen.x[0] = s.front * share;
    at.seen.x[1] = open * share;
    at.seen.x[2] = absorbed;
    at.seen.x[3] = inside;
    at.seen.x[4] = (s.middle - s.front) / max(both, K(1.0));
    at.seen.x[5] = (s.front - s.outer) * share;
    at.seen.x[6] = (s.beyond - s.back) * share;
    at.seen.x[7] = clamp(logarithm(total), K(-8.0), K(8.0));
    at.seen.x[8] = clamp(even, K(0.0), K(1.0));
    at.seen.x[9] = clamp(logarithm(room), K(-8.0), K(3.0));
    return at;
}

// The share of what may be in front that is counted.
FN number slice_share(address weights, values seen) {
    values first = layer_outputs(weights, seen, SLICE_INPUTS, SLICE_HIDDEN);
    values second = layer_outputs(weights + (SLICE_INPUTS + 1) * SLICE_HIDDEN,
                                  rectified(first, SLICE_HIDDEN), SLICE_HIDDEN, SLICE_HIDDEN);
    values last = layer_outputs(weights + (SLICE_INPUTS + 1) * SLICE_HIDDEN
                                    + (SLICE_HIDDEN + 1) * SLICE_HIDDEN,
                                rectified(second, SLICE_HIDDEN), SLICE_HIDDEN, 1);
    return sigmoid(last.x[0]);
}
