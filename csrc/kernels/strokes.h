// Parts of strokes: what a disc or a ball leaves that moves straight on from one place to another,
// its size changing evenly. On the screen that is two circles and the tangents to both; of balls a
// ray meets the nearest, whose place is the root of a square.

// Two circles, in pixels; the direction from one middle to the other, and of the tangents to both.
STRUCT(stroke_outline) {
    number x[2];
    number y[2];
    number radius[2];
    number along[2];
    number apart;
    number lean;
    number upright;
};

// Places and radii of the first and the last ball, as the eye sees them (right, up, away). outside:
// |at|^2 - radius^2. over, per_over, start, beyond: of all balls between these what rays are put
// into (stroke_shapes.c). near, far: nothing is seen before or behind.
STRUCT(stroke_balls) {
    number at[6];
    number outside[2];
    number over;
    number per_over;
    number start;
    number beyond;
    number near;
    number far;
};

// What is met at a place of the screen: at which share of the way; middle: how far the axis is
// there. rank: less is seen before more; of balls how far what is met is.
STRUCT(stroke_point) {
    truth met;
    number share;
    number rank;
    number middle;
};

// How far a place of the screen is from an outline, in pixels, below 0 inside; and next to which
// share of the way, on the screen.
STRUCT(stroke_distance) {
    number away;
    number share;
};

// holder: the circle that holds the other one, or -1.
FN stroke_distance away_from_outline(stroke_outline s, real x, real y, int holder) {
    PRECISE stroke_distance o;
    real dx = x - s.x[0];
    real dy = y - s.y[0];
    truth between = K(0.0) > 0.0;
    truth last = K(holder) > 0.0;
    o.share = K(0.0);
    o.away = K(0.0);
    if (holder < 0) {
        real u = dx * s.along[0] + dy * s.along[1];
        real v = abs(dx * s.along[1] - dy * s.along[0]);
        real tangent = s.upright * u - s.lean * v;
        o.share = tangent / (s.upright * s.apart);
        o.away = s.upright * v + s.lean * u - s.radius[0];
        last = tangent > 0.0;
        between = BOTH(last, o.share < 1.0);
    }
    dx = select(last, x - s.x[1], dx);
    dy = select(last, y - s.y[1], dy);
    real rim = sqrt(dx * dx + dy * dy) - select(last, s.radius[1], s.radius[0]);
    o.away = select(between, o.away, rim);
    o.share = select(between, o.share, select(last, K(1.0), K(0.0)));
    return o;
}

// Of discs that face the picture; first, last: how far they are.
FN stroke_point flat_stroke_at(stroke_outline s, real first, real last, real x, real y,
                               int holder) {
    PRECISE stroke_point o;
    PRECISE stroke_distance d = away_from_outline(s, x, y, holder);
    // 1 / z is what is linear on the screen
    o.middle = first * last / (last + d.share * (first - last));
    o.share = d.share * o.middle / last;
    o.rank = d.away;
    o.met = d.away <= 0.0;
    return o;
}

// Where a ray enters: the lesser root of a t^2 + 2 b t + c, or the only one of what falls.
STRUCT(ball_entry) {
    truth there;
    number at;
};

FN ball_entry entry_of_ball(real a, real b, real c) {
    PRECISE ball_entry o;
    real square = b * b - a * c;
    real root = sqrt(max(square, K(0.0)));
    truth ahead = b < 0.0;
    o.at = select(ahead, c, -b - root) / select(ahead, root - b, a);
    o.there = square >= 0.0;
    return o;
}

// Of balls, along (right, up, 1). only_one: the last is the first.
FN stroke_point solid_stroke_at(stroke_balls s, real right, real up, int only_one) {
    PRECISE stroke_point o;
    real square = right * right + up * up + 1.0;
    real towards[2];
    for (int k = 0; k < 2; ++k)
        towards[k] = right * s.at[3 * k] + up * s.at[3 * k + 1] + s.at[3 * k + 2];
    o.share = K(0.0);
    o.rank = K(1.7976931348623157e308);
    truth ends = EVERYWHERE;
    if (only_one == 0) {
        // what is entered between the ends is entered nowhere before
        real along = towards[1] - towards[0];
        PRECISE ball_entry e = entry_of_ball(s.over * square - along * along,
                                             -s.over * towards[0] - along * s.start, s.beyond);
        real share = (s.start + e.at * along) * s.per_over;
        truth between = BOTH(BOTH(s.over > 0.0, e.there), BOTH(share > 0.0, share < 1.0));
        o.share = select(between, share, o.share);
        o.rank = select(between, e.at, o.rank);
        ends = select(between, K(0.0), K(1.0)) > 0.0;
    }
    for (int k = 0; k < 2; ++k) {
        BREAK_UNLESS(ends);
        PRECISE ball_entry e = entry_of_ball(square, -towards[k], s.outside[k]);
        truth nearer = BOTH(BOTH(e.there, e.at < o.rank), ends);
        o.share = select(nearer, K(k), o.share);
        o.rank = select(nearer, e.at, o.rank);
        if (only_one != 0) break;
    }
    o.middle = s.at[2] + o.share * (s.at[5] - s.at[2]);
    o.met = BOTH(o.rank >= s.near, o.rank <= s.far);
    return o;
}

// From the middle of the ball that is met to where it is met: (right, up, away), of any length.
STRUCT(stroke_normal) { number along[3]; };

FN stroke_normal normal_of_stroke(stroke_balls s, stroke_point p, real right, real up) {
    PRECISE stroke_normal o;
    for (int k = 0; k < 3; ++k) {
        real direction = k == 0 ? right : (k == 1 ? up : K(1.0));
        real axis = s.at[k] + p.share * (s.at[3 + k] - s.at[k]);
        o.along[k] = p.rank * direction - axis;
    }
    return o;
}
