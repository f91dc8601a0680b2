// Deep shadow maps: a ray's transmittance as a piecewise linear function within a tolerance.
//
// Lokovic and Veach, "Deep Shadow Maps", SIGGRAPH 2000, section 3.2. The exact function steps down
// at each surface: two vertices at one depth, in front of the surface and behind it. From an origin on
// the curve so far, each vertex leaves those slopes that pass it within the tolerance. Once none is
// left, a segment in the middle of the slopes that were ends at the vertex before, and the next
// starts there. A step that no segment passes becomes vertical and ends on the exact function.
// Unlike the paper's, curves never rise, nor fall below what the whole ray lets through: the exact
// function does neither, so a slope is found as before.

// Slopes from the origin (z, T) that pass all vertices since.
STRUCT(shadow_segment) { number z, T, steepest, flattest; };
// What a surface does. Where `broken`, the curve has a node at the surface before, at broken_T; where
// `stepped`, it has nodes at this surface, at stepped_T and then on the exact function behind.
STRUCT(shadow_step) {
    shadow_segment next; // goes on from here
    truth broken, stepped;
    number broken_T, stepped_T;
};

FN shadow_segment shadow_segment_from(real z, real T) {
    shadow_segment s;
    s.z = z;
    s.T = T;
    s.steepest = K(BY_PRECISION(-1e30, -1e300)); // finite, so that a middle is
    s.flattest = K(0.0);
    return s;
}

// T of the middle of its slopes, at z not in front of the origin.
FN number shadow_segment_at(shadow_segment s, real z) {
    real slope = min(0.5 * (s.steepest + s.flattest), K(0.0));
    real T = s.T + slope * (z - s.z);
    return select(z > s.z, T, s.T);
}

// The slopes that pass between low and high at z; at the origin's own depth all do.
FN shadow_segment shadow_segment_through(shadow_segment s, real z, real low, real high) {
    real along = z - s.z;
    real fall = (low - s.T) / along;
    real rise = (high - s.T) / along;
    shadow_segment t = s;
    t.steepest = select(along > 0.0, max(s.steepest, fall), s.steepest);
    t.flattest = select(along > 0.0, min(s.flattest, rise), s.flattest);
    return t;
}

FN shadow_segment shadow_select(truth t, shadow_segment a, shadow_segment b) {
    shadow_segment s;
    s.z = select(t, a.z, b.z);
    s.T = select(t, a.T, b.T);
    s.steepest = select(t, a.steepest, b.steepest);
    s.flattest = select(t, a.flattest, b.flattest);
    return s;
}

// A surface at z with exact transmittance `before` in front of it and `behind` it; the surface before
// lies at `last`, and `total` is what the whole ray lets through.
FN shadow_step shadow_step_at(shadow_segment s, real last, real z, real before, real behind,
                              real total, real tolerance) {
    real low = max(before - tolerance, total);
    real high = before + tolerance;
    shadow_segment on = shadow_segment_through(s, z, low, high);
    shadow_step step;
    step.broken = on.steepest > on.flattest;
    step.broken_T = shadow_segment_at(s, last);
    shadow_segment anew = shadow_segment_from(last, step.broken_T);
    shadow_segment front =
        shadow_select(step.broken, shadow_segment_through(anew, z, low, high), on);

    real low_behind = max(behind - tolerance, total);
    real high_behind = behind + tolerance;
    shadow_segment through = shadow_segment_through(front, z, low_behind, high_behind);
    step.stepped_T = shadow_segment_at(front, z);
    // at the origin itself the curve is where it is
    real excess = select(z > front.z, through.steepest - through.flattest, front.T - high_behind);
    step.stepped = excess > 0.0;
    step.next = shadow_select(step.stepped, shadow_segment_from(z, behind), through);
    return step;
}

// The curve at z between its nodes (z0, T0) and (z1, T1), z0 < z <= z1.
FN number shadow_between(real z0, real T0, real z1, real T1, real z) {
    real share = (z - z0) / (z1 - z0);
    real T = T0 + (T1 - T0) * share;
    return select(z < z1, max(T, T1), T1);
}
