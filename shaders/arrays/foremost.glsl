// The foremost LAYERS fragments of a pixel, as `indices` has them, that are not faint.

struct foremost {
    double through; // of those that are in front of what asks, or of all
    bool beyond;    // what asks is none of them
};

// place: of the fragment that asks; ~0u: what is strictly nearer than `depth` counts.
foremost foremost_before(uint p, number depth, uint place) {
    precise foremost f;
    f.through = 1.0;
    f.beyond = true;
    uint end = offsets[p + 1u];
    for (uint k = 0u; k < LAYERS; ++k) {
        uint at = offsets[p] + k;
        if (at < end && !is_faint(indices[at])) {
            uint i = indices[at];
            bool reached = place == ~0u ? !(number(depths[i]) < depth) : i == place;
            f.beyond = f.beyond && !reached;
            f.through = f.through * (f.beyond ? 1.0 - double(alphas[i]) : 1.0);
        }
    }
    return f;
}

bool is_foremost(uint p, uint i) {
    bool found = false;
    uint end = min(offsets[p] + LAYERS, offsets[p + 1u]);
    for (uint at = offsets[p]; at < end; ++at) found = found || (indices[at] == i && !is_faint(i));
    return found;
}
