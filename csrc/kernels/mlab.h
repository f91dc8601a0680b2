// Multi-layer alpha blending: a pixel keeps a few layers, the nearest first, and of each fragment
// that is one too many blends the two farthest into one.
//
// Salvi and Vaidyanathan, "Multi-layer Alpha Blending", I3D 2014. Layers hold premultiplied colour
// and transmittance; two blend by over, and stand where the front one stood. A fragment goes in
// front of a layer of its own depth. To insert one, walk over the layers from the front with
// `layers_passed`, leaving at each what comes to lie there and carrying the other on; what is
// carried past the last is `layers_blended` behind it. Needs storage.h.
//
// Merged by energy (ours) those two neighbours blend whose blending harms the picture least, not
// always the farthest, and they stand where the one stood that takes more of the light.

STRUCT(layer) {
    number depth;
    number red; // premultiplied, as green and blue
    number green;
    number blue;
    number through; // share of light that passes
};

// Layers that are not in use lie behind all others and let everything through: blending one changes
// nothing, so neither does inserting one.
FN layer empty_layer() {
    layer l;
    l.depth = K(BY_PRECISION(3.40282346638528859812e38, 1.79769313486231570815e308));
    l.red = K(0.0);
    l.green = K(0.0);
    l.blue = K(0.0);
    l.through = K(1.0);
    return l;
}

// A half float as a blend target holds it; larger numbers become its largest, 65504, not infinite.
FN number half_held(real x) { return rounded_to_half(clamp(x, K(-65504.0), K(65504.0))); }

// What a target of four half floats makes of a layer; depth has been stored already.
FN layer held_layer(layer l) {
    layer held;
    held.depth = l.depth;
    held.red = half_held(l.red);
    held.green = half_held(l.green);
    held.blue = half_held(l.blue);
    held.through = half_held(l.through);
    return held;
}

// A fragment as a layer; one of opacity below `least` is none.
FN layer layer_of(real depth, real alpha, real red, real green, real blue, real least) {
    layer none = empty_layer();
    truth seen = alpha >= least;
    real own_red = red * alpha;
    real own_green = green * alpha;
    real own_blue = blue * alpha;
    real through = 1.0 - alpha;
    layer l;
    l.depth = select(seen, depth, none.depth);
    l.red = select(seen, own_red, none.red);
    l.green = select(seen, own_green, none.green);
    l.blue = select(seen, own_blue, none.blue);
    l.through = select(seen, through, none.through);
    return l;
}

STRUCT(layer_pair) {
    layer front;
    layer behind;
};

// Which of a layer in its place and one that comes along stays, and which goes on.
FN layer_pair layers_passed(layer here, layer coming) {
    truth front = coming.depth <= here.depth;
    layer_pair p;
    p.front.depth = select(front, coming.depth, here.depth);
    p.front.red = select(front, coming.red, here.red);
    p.front.green = select(front, coming.green, here.green);
    p.front.blue = select(front, coming.blue, here.blue);
    p.front.through = select(front, coming.through, here.through);
    p.behind.depth = select(front, here.depth, coming.depth);
    p.behind.red = select(front, here.red, coming.red);
    p.behind.green = select(front, here.green, coming.green);
    p.behind.blue = select(front, here.blue, coming.blue);
    p.behind.through = select(front, here.through, coming.through);
    return p;
}

// Two neighbouring layers as one.
FN layer layers_blended(layer front, layer behind) {
    real dimmed_red = front.through * behind.red;
    real dimmed_green = front.through * behind.green;
    real dimmed_blue = front.through * behind.blue;
    real red = front.red + dimmed_red;
    real green = front.green + dimmed_green;
    real blue = front.blue + dimmed_blue;
    real through = front.through * behind.through;
    layer l;
    l.depth = front.depth;
    l.red = red;
    l.green = green;
    l.blue = blue;
    l.through = through;
    return l;
}

// ---- Merged by energy

STRUCT(blending) {
    number place; // of the layer that its neighbour in front takes in
    number loss;
    number behind; // 1 where that takes more of the light
};

// What blending layer i with the one before it does to the picture, where light `reaches` these
// two: what is yet to come between them is seen through the lesser of both too much or too little,
// by the chance that it comes there.
FN blending blending_of(real reaches, layer before, layer here, real i) {
    const real least = K(1e-30);
    real between = reaches * before.through;
    real front_energy = reaches - between;
    real left = between * here.through;
    real behind_energy = between - left;
    real both = front_energy + behind_energy;
    real product = front_energy * behind_energy;
    real lesser = product / max(both, least);
    real gap = max(here.depth - before.depth, K(0.0));
    blending b;
    b.place = i;
    b.loss = sqrt(gap) * lesser;
    b.behind = select(behind_energy > front_energy, K(1.0), K(0.0));
    return b;
}

// The better one of two choices, the first of equals.
FN blending or_blending(blending c, blending next) {
    truth better = next.loss < c.loss;
    blending b;
    b.place = select(better, next.place, c.place);
    b.loss = select(better, next.loss, c.loss);
    b.behind = select(better, next.behind, c.behind);
    return b;
}

// Of N + 1 layers, whose last is `last`, none is blended with another if that is none: it goes.
FN blending blending_needed(blending c, layer last, real n) {
    layer none = empty_layer();
    truth needed = last.depth < none.depth;
    blending b;
    b.place = select(needed, c.place, n);
    b.loss = c.loss;
    b.behind = select(needed, c.behind, K(0.0));
    return b;
}

FN layer layer_chosen(truth first, layer one, layer other) {
    layer l;
    l.depth = select(first, one.depth, other.depth);
    l.red = select(first, one.red, other.red);
    l.green = select(first, one.green, other.green);
    l.blue = select(first, one.blue, other.blue);
    l.through = select(first, one.through, other.through);
    return l;
}

// Two neighbouring layers as one that stands where the choice says.
FN layer layers_merged(layer front, layer behind, blending c) {
    layer l = layers_blended(front, behind);
    l.depth = select(c.behind > 0.5, behind.depth, front.depth);
    return l;
}
