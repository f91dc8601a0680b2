// Adaptive transparency: a transmittance function in a few steps, of which the one that matters
// least goes when a fragment brings one too many.
//
// Salvi, Montgomery and Lefohn, "Adaptive Transparency", HPG 2011. A node is a depth and what is
// left of the light behind it. A fragment takes its share from all nodes behind it and adds a node
// of its own, in front of those at its depth. Of the N + 1 nodes there are then, leaving out node i
// and giving its transmittance to node i - 1 takes the area between the two from under the
// function: the node of the least area goes, neither the first nor the last ever. So the function
// is too low where it is wrong, and its end is right. Needs storage.h.
//
// Merged by energy (ours) the two neighbours become one whose merging harms the picture least, the
// last node not excepted, and they stand between their depths. That errs to both sides, so colours
// are renormalised as a rule.

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

// ---- Merged by energy

STRUCT(merging) {
    number place; // of the node that its neighbour in front takes in
    number loss;
    number front; // depths of the two
    number behind;
    number front_energy; // what each of them takes of the light
    number behind_energy;
};

// What depths are multiplied with that are held as words, for gaps between them.
FN number word_step() {
    real step = K(1.52590218966964217e-5); // 1 / 65535
    return step;
}

// What merging the node at `here` with the one before it does to the picture. `reaches` is the
// light that reaches the one before. What is seen wrongly afterwards is, of the fragments that the
// two stand for, at most those that take the lesser of the two energies, by what both dim
// together; and by as much what others add, the more of them, the wider the gap is: `scale` times
// the depths that are held, for which the whole range is 1.
FN merging merging_of(real reaches, visibility before, visibility here, real i, real scale) {
    const real least = K(1e-30);
    real front_energy = reaches - before.through;
    real behind_energy = before.through - here.through;
    real both = reaches - here.through;
    real opacity = both / max(reaches, least);
    real gap = (here.depth - before.depth) * scale;
    real wrong = opacity + 1.5 * gap;
    real loss = min(front_energy, behind_energy) * wrong;
    merging m;
    m.place = i;
    m.loss = loss;
    m.front = before.depth;
    m.behind = here.depth;
    m.front_energy = front_energy;
    m.behind_energy = behind_energy;
    return m;
}

// The better one of two choices, the first of equals.
FN merging or_merging(merging c, merging next) {
    truth better = next.loss < c.loss;
    merging m;
    m.place = select(better, next.place, c.place);
    m.loss = select(better, next.loss, c.loss);
    m.front = select(better, next.front, c.front);
    m.behind = select(better, next.behind, c.behind);
    m.front_energy = select(better, next.front_energy, c.front_energy);
    m.behind_energy = select(better, next.behind_energy, c.behind_energy);
    return m;
}

// Of N + 1 nodes, `kept` and `last` at their end, none is merged if the last is empty: it goes.
FN merging merging_needed(merging c, visibility kept, visibility last, real n) {
    truth needed = last.depth < empty_depth();
    merging m;
    m.place = select(needed, c.place, n);
    m.loss = c.loss;
    m.front = select(needed, c.front, kept.depth);
    m.behind = select(needed, c.behind, kept.depth);
    m.front_energy = c.front_energy;
    m.behind_energy = c.behind_energy;
    return m;
}

// Where the merged node stands: at the mean of the two, weighted by energy, or with the one behind
// where that takes more than one and a half times as much.
FN number merged_depth(merging c) {
    const real least = K(1e-30);
    real energy = c.front_energy + c.behind_energy;
    real share = c.behind_energy / max(energy, least);
    real along = (c.behind - c.front) * share;
    real mean = min(c.front + along, c.behind);
    return select(c.behind_energy > 1.5 * c.front_energy, c.behind, mean);
}

// Node i of those in which the node at `gone` has been merged with the one before it, from nodes i
// and i + 1.
FN visibility node_merged(visibility here, visibility next, real i, real gone, real depth) {
    truth shrinks = i < gone - 1.0;
    truth stays = i < gone;
    visibility n;
    n.depth = select(stays, select(shrinks, here.depth, depth), next.depth);
    n.through = select(shrinks, here.through, next.through);
    return n;
}

// A node as words of 16 bits hold it.
FN visibility held_node(visibility n) {
    real word = unorm16_word(n.through);
    visibility held;
    held.depth = n.depth;
    held.through = unorm16_value(word);
    return held;
}
