// A pixel's own range of depth: where its fragments begin and end, and depth within that.

STRUCT(own_extent) { number nearest, farthest; };

// z in the extent's own range, from -1 at its nearest end to 1 at its farthest; beyond, at that
// end; 0 where the ends are one.
FN number depth_within(own_extent e, real z) {
    real extent = e.farthest - e.nearest;
    real beside = (z - e.nearest) - (e.farthest - z);
    return select(extent > 0.0, clamp(beside / extent, K(-1.0), K(1.0)), K(0.0));
}

// An end of [-1, 1] as words of 16 bits count it, 0 to 65535, before it is rounded.
FN number words_from_end(real z) {
    real share = 0.5 + 0.5 * z;
    return clamp(share, K(0.0), K(1.0)) * K(65535.0);
}

// The words that hold an extent of depths in [-1, 1], each end rounded outwards. Both are what a
// target keeps that holds the greatest of 65535 - nearest and of farthest.
FN number word_at_most(real z) {
    real words = words_from_end(z);
    real near = nearest_integer(words);
    return near - select(near > words, K(1.0), K(0.0));
}

FN number word_at_least(real z) {
    real words = words_from_end(z);
    real near = nearest_integer(words);
    return near + select(near < words, K(1.0), K(0.0));
}

// The extent that two such words stand for, a word long at least: so depth has a place within.
FN own_extent extent_of_words(real nearest, real farthest) {
    PRECISE own_extent e;
    real begins = min(nearest, K(65534.0));
    real ends = max(farthest, begins + 1.0);
    e.nearest = 2.0 * unorm16_value(begins) - 1.0;
    e.farthest = 2.0 * unorm16_value(ends) - 1.0;
    return e;
}
