// Sums of doubles that do not depend on the order of what is added, in all their digits but for
// odds of one in 10^13 or so: what each addition rounds off is kept, and added in the end.
//
// Knuth, The Art of Computer Programming 2, 4.2.2; Ogita, Rump and Oishi, "Accurate Sum and Dot
// Product", 2005. The bias of moments in double is a few units in their last place. Where surfaces
// lie close together, transmittance shows those units in its third digit: plain sums, which are off
// by as much, would make it depend on which fragment arrived first. Sums of floats have digits to
// spare, and are plain.

STRUCT(kept_sum) {
    quad_number high;
    quad_number low; // what has been rounded off
};

FN kept_sum nothing_kept() {
    kept_sum s;
    s.high = QUAD(0);
    s.low = QUAD(0);
    return s;
}

FN kept_sum kept_with(kept_sum s, quad x) {
    PRECISE kept_sum o;
    quad sum = s.high + x;
    o.high = sum;
    o.low = s.low;
    if (BY_PRECISION(0, 1) > 0) {
        quad of_x = sum - s.high;
        quad of_s = sum - of_x;
        quad lost_x = x - of_x;
        quad lost_s = s.high - of_s;
        quad lost = lost_s + lost_x;
        o.low = s.low + lost;
    }
    return o;
}

FN kept_sum both_kept(kept_sum s, kept_sum t) {
    PRECISE kept_sum o = kept_with(s, t.high);
    o.low = o.low + t.low;
    return o;
}

// Of fragments i, i + 4, i + 8, ... for i from 0 to 3, as those four are summed side by side.
FN quad_number total_kept(kept_sum s0, kept_sum s1, kept_sum s2, kept_sum s3) {
    PRECISE kept_sum s = both_kept(both_kept(s0, s1), both_kept(s2, s3));
    quad total = s.high + s.low;
    return total;
}
