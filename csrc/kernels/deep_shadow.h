// Deep shadow maps: a ray's transmittance as a piecewise linear function within a tolerance.
//
// Lokovic and Veach, "Deep Shadow Maps", SIGGRAPH 2000, section 3.2. The exact function steps down
// at each surface: two vertices at one depth, in front of the surface and behind it. From an origin
// on the curve so far, each vertex leaves those slopes that pass it within the tolerance. Once none
// is left, a segment in the middle of the slopes that were ends at the vertex before, and the next
// starts there. A step that no segment passes becomes vertical and ends on the exact function.
// Unlike the paper's, curves never rise, nor fall below what the whole ray lets through: the exact
// function does neither, so a slope is found as before.

// Slopes from the origin (z, T) that pass all vertices since: none where steepest > flattest.
STRUCT(shadow_segment) { number z, T, steepest, flattest; };

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

// The slopes of s that pass a vertex, the exact function's `exact` at z, within the tolerance;
// total: of the whole ray. At the origin's own depth they all do, or none.
FN shadow_segment shadow_segment_through(shadow_segment s, real z, real exact, real total,
                                         real tolerance) {
    real low = max(exact - tolerance, total);
    real high = exact + tolerance;
    real along = z - s.z;
    real fall = (low - s.T) / along;
    real rise = (high - s.T) / along;
    real rise_here = select(s.T > high, K(BY_PRECISION(-2e30, -2e300)), s.flattest);
    shadow_segment t = s;
    t.steepest = select(along > 0.0, max(s.steepest, fall), s.steepest);
    t.flattest = select(along > 0.0, min(s.flattest, rise), rise_here);
    return t;
}

// The curve at z between its nodes (z0, T0) and (z1, T1), z0 < z <= z1.
FN number shadow_between(real z0, real T0, real z1, real T1, real z) {
    real share = (z - z0) / (z1 - z0);
    real T = T0 + (T1 - T0) * share;
    return select(z < z1, max(T, T1), T1);
}
