// Depths as points of the unit circle, in double whatever numbers are: what moments are summed of.

STRUCT(quad_point) {
    quad_number re;
    quad_number im;
};

FN quad_point quad_turned(quad_point p, quad_point q) {
    PRECISE quad_point turn;
    turn.re = p.re * q.re - p.im * q.im;
    turn.im = p.re * q.im + p.im * q.re;
    return turn;
}

// The point that z is, seen from that of z = 0, which lies at the angle 4 z quarter: a quarter of
// it is at most pi/4, where these series reach the last digits.
FN quad_point quad_point_of(quad z, double quarter) {
    quad angle = z * quarter;
    quad square = angle * angle;
    quad cosine[9]; // coefficients, which compilers know: terms wait for one another
    quad sine[9];
    cosine[0] = QUAD(1);
    sine[0] = QUAD(1);
    for (int k = 1; k <= 8; ++k) {
        cosine[k] = cosine[k - 1] / QUAD(-2 * k * (2 * k - 1));
        sine[k] = sine[k - 1] / QUAD(-2 * k * (2 * k + 1));
    }
    PRECISE quad_point p;
    p.re = cosine[8];
    p.im = sine[8];
    for (int k = 7; k >= 0; --k) {
        p.re = cosine[k] + p.re * square;
        p.im = sine[k] + p.im * square;
    }
    p.im = p.im * angle;
    for (int k = 0; k < 2; ++k) {
        quad cosine = 1.0 - 2.0 * p.im * p.im;
        p.im = 2.0 * p.re * p.im;
        p.re = cosine;
    }
    return p;
}
