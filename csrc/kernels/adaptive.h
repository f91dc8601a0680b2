// Adaptive transparency: a transmittance function in a few steps, of which the one that matters
// least goes when a fragment brings one too many.
//
// Salvi, Montgomery and Lefohn, "Adaptive Transparency", HPG 2011. A node is a depth and what is
// left of the light behind it. A fragment takes its share from all nodes behind it and adds a node
// of its own, in front of those at its depth. Of the N + 1 nodes there are then, leaving out node i
// and giving its transmittance to node i - 1 takes the area between the two from under the
// function: the node of the least area goes, neither the first nor the last ever. So the function
// is too low where it is wrong, and its end is right. Needs storage.h.

STRUCT(visibility) {
    number depth;
    number through; // share of light that is left behind it
};

// Nodes that are not in use lie behind all others, and let through what these do.
FN number empty_depth() {
    real most = K(BY_PRECISION(3.40282346638528859812e38, 1.79769313486231570815e308));
    return most;
}

// Node i once a fragment has been put in, from nodes i - 1 and i (before the first: `depth` itself
// and 1; behind the last: an empty one and 0, which is not read).
FN visibility node_shifted(visibility before, visibility here, real depth, real passes) {
    truth behind = depth <= here.depth;
    real taken = before.through * passes;
    real place = max(depth, before.depth);
    visibility n;
    n.depth = select(behind, place, here.depth);
    n.through = select(behind, taken, here.through);
    return n;
}

// What leaving out a node takes from under the function.
FN number area_lost(visibility before, visibility here) {
    real along = here.depth - before.depth;
    real down = before.through - here.through;
    real area = along * down;
    return area;
}

STRUCT(removal) {
    number place; // of the node to leave out
    number area;
};

// The better one of a choice among the nodes before i and node i.
FN removal or_removal(removal c, real i, real area) {
    truth better = area < c.area;
    removal found;
    found.place = select(better, i, c.place);
    found.area = select(better, area, c.area);
    return found;
}

// Of N + 1 nodes the last is empty: that one goes.
FN number place_left_out(removal c, visibility last, real n) {
    return select(last.depth == empty_depth(), n, c.place);
}

// Node i without the one at `gone`, from nodes i and i + 1.
FN visibility node_kept(visibility here, visibility next, real i, real gone) {
    visibility n;
    n.depth = select(i < gone, here.depth, next.depth);
    n.through = select(i < gone - 1.0, here.through, next.through);
    return n;
}

// Transmittance as a word of 16 bits holds it.
FN visibility held_node(visibility n) {
    real word = unorm16_word(n.through);
    visibility held;
    held.depth = n.depth;
    held.through = unorm16_value(word);
    return held;
}
