// A pixel's fragments front to back, of equal depths the earlier first, without a limit to how many
// there are: rounds over all of them, each of which finds the next few.

#define ROUND 8u
#define NOWHERE (~0u)

struct nearest_few {
    number depth[ROUND];
    uint place[ROUND]; // NOWHERE: there are no more
};

bool in_front_of(number depth, uint place, number other_depth, uint other_place) {
    return depth < other_depth || (depth == other_depth && place < other_place);
}

// The ROUND nearest of the pixel's fragments that are behind the one at (depth, place), or of all
// where that is NOWHERE.
nearest_few nearest_behind(uint p, number depth, uint place) {
    nearest_few found;
    for (uint k = 0u; k < ROUND; ++k) found.place[k] = NOWHERE;
    for (uint i = offsets[p]; i < offsets[p + 1u]; ++i) {
        number coming = number(depths[i]);
        uint from = i;
        if (place != NOWHERE && !in_front_of(depth, place, coming, from)) continue;
        for (uint k = 0u; k < ROUND; ++k) { // the farther of two goes on
            bool passes = found.place[k] != NOWHERE
                          && !in_front_of(coming, from, found.depth[k], found.place[k]);
            number stays = passes ? found.depth[k] : coming;
            uint stays_at = passes ? found.place[k] : from;
            coming = passes ? coming : found.depth[k];
            from = passes ? from : found.place[k];
            found.depth[k] = stays;
            found.place[k] = stays_at;
            if (from == NOWHERE) break;
        }
    }
    return found;
}

// What the fragments nearer than (depth, place) let through; NOWHERE: those strictly nearer than depth.
double nearer_let_through(uint p, number depth, uint place) {
    precise double through = 1.0;
    for (uint i = offsets[p]; i < offsets[p + 1u]; ++i) {
        number other = number(depths[i]);
        bool nearer = other < depth || (place != NOWHERE && other == depth && i < place);
        through *= nearer ? 1.0 - double(alphas[i]) : 1.0;
    }
    return through;
}
