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
    truth round = select(between, K(0.0), K(1.0)) > 0.0;
    for (int once = 0; once < 1; ++once) {
        BREAK_UNLESS(round);
        dx = select(last, x - s.x[1], dx);
        dy = select(last, y - s.y[1], dy);
        real rim = sqrt(dx * dx + dy * dy) - select(last, s.radius[1], s.radius[0]);
        o.away = select(round, rim, o.away);
        o.share = select(round, select(last, K(1.0), K(0.0)), o.share);
    }
    return o;
}

// Of discs that face the picture; first, last: how far they are. What is not met has no share.
FN stroke_point flat_stroke_at(stroke_outline s, real first, real last, real x, real y,
                               int holder) {
    PRECISE stroke_point o;
    PRECISE stroke_distance d = away_from_outline(s, x, y, holder);
    o.rank = d.away;
    o.met = d.away <= 0.0;
    o.share = K(0.0);
    o.middle = first;
    for (int once = 0; once < 1; ++once) {
        BREAK_UNLESS(o.met);
        // 1 / z is what is linear on the screen
        real middle = first * last / (last + d.share * (first - last));
        real share = d.share * middle / last;
        o.middle = select(o.met, middle, o.middle);
        o.share = select(o.met, share, o.share);
    }
    return o;
}

// A ray enters where a t^2 + 2 b t + c has its lesser root, or the only one of what falls: nowhere
// where this is below 0;
FN number square_of_entry(real a, real b, real c) {
    real square = b * b - a * c;
    return square;
}

// else there.
FN number entry_of_ball(real a, real b, real c, real square) {
    real root = sqrt(max(square, K(0.0)));
    truth ahead = b < 0.0;
    real at = select(ahead, c, -b - root) / select(ahead, root - b, a);
    return at;
}

// Of a ray along (right, up, 1): its product with the place of an end, and with itself.
FN number along_ray(stroke_balls s, real right, real up, int end) {
    real towards = right * s.at[3 * end] + up * s.at[3 * end + 1] + s.at[3 * end + 2];
    return towards;
}
FN number square_of_ray(real right, real up) {
    real square = right * right + up * up + 1.0;
    return square;
}

// Whether the ball at the first end is met anywhere.
FN truth first_ball_is_met(stroke_balls s, real right, real up) {
    real b = -along_ray(s, right, up, 0);
    real square = square_of_entry(square_of_ray(right, up), b, s.outside[0]);
    return square >= 0.0;
}

// Of balls. only_one: the last is the first.
FN stroke_point solid_stroke_at(stroke_balls s, real right, real up, int only_one) {
    PRECISE stroke_point o;
    real ray = square_of_ray(right, up);
    real first = along_ray(s, right, up, 0);
    truth ends = EVERYWHERE;
    o.share = K(0.0);
    o.rank = K(1.7976931348623157e308);
    if (only_one == 0) {
        // what is entered between the ends is entered nowhere before
        real along = along_ray(s, right, up, 1) - first;
        real a = s.over * ray - along * along;
        real b = -s.over * first - along * s.start;
        real square = square_of_entry(a, b, s.beyond);
        truth there = BOTH(s.over > 0.0, square >= 0.0);
        for (int once = 0; once < 1; ++once) {
            BREAK_UNLESS(there);
            real at = entry_of_ball(a, b, s.beyond, square);
            real share = (s.start + at * along) * s.per_over;
            truth between = BOTH(there, BOTH(share > 0.0, share < 1.0));
            o.share = select(between, share, o.share);
            o.rank = select(between, at, o.rank);
            ends = select(between, K(0.0), K(1.0)) > 0.0;
        }
    }
    for (int k = 0; k < 2; ++k) {
        if (k == 1 && only_one != 0) break;
        real b = -along_ray(s, right, up, k);
        real square = square_of_entry(ray, b, s.outside[k]);
        truth there = BOTH(ends, square >= 0.0);
        for (int once = 0; once < 1; ++once) {
            BREAK_UNLESS(there);
            real at = entry_of_ball(ray, b, s.outside[k], square);
            truth nearer = BOTH(there, at < o.rank);
            o.share = select(nearer, K(k), o.share);
            o.rank = select(nearer, at, o.rank);
        }
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
