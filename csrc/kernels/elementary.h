// Numbers as indices, whole numbers, exp and log, sine and cosine, and the absorbance of a surface.
//
// Written out so that every instruction set and GLSL give the same numbers; a library's exp
// differs between machines in the last bit.
#ifndef ELEMENTARY
#define ELEMENTARY

// x within [0, most], and 0 where x is NaN: each number that comes to be an index or a word passes
// here first, as nobody knows what became of an array since it was looked at.
FN number within(real x, real most) {
    real least = select(x > 0.0, x, K(0.0));
    return min(least, most);
}

// The greatest integer that x, between -2^22 and 2^22, is not below.
FN number whole_below(real x) {
    real near = nearest_integer(x);
    return select(near > x, near - 1.0, near);
}

// exp(x) = 2^n exp(r), n the integer nearest to x log2(e), so |r| <= log(2)/2 and the series
// reaches the last bit at this degree. ln(2) is split so that n ln2_high is exact. Results below
// the least normal number are 0; x must not exceed 80 (transmittance only needs x <= 0).
FN number exponential(real x) {
    const real least = K(BY_PRECISION(-87.0, -708.0));
    const real ln2_high = K(BY_PRECISION(0.693145751953125, 0.69314718036912381649));
    const real ln2_low = K(BY_PRECISION(1.42860682030941723e-6, 1.90821492927058770e-10));
    real bounded = max(x, least);
    real n = nearest_integer(bounded * K(1.4426950408889634));
    real r = (bounded - n * ln2_high) - n * ln2_low;
    real series = K(1.0);
    for (int k = BY_PRECISION(7, 13); k > 0; --k) series = 1.0 + series * r * K(1.0 / k);
    return select(x < least, K(0.0), times_power_of_two(series, n));
}

// ln(x) for positive normal x. With x = 2^n (1 + f) and s = f / (2 + f),
// ln(1 + f) = 2 atanh(s) = f - f^2/2 + s (f^2/2 + R), R = 2 (s^2/3 + s^4/5 + ...); subtracting
// f^2/2 by itself keeps the last bit (the arrangement of Ng's fdlibm).
FN number logarithm(real x) {
    const real ln2_high = K(BY_PRECISION(0.693145751953125, 0.69314718036912381649));
    const real ln2_low = K(BY_PRECISION(1.42860682030941723e-6, 1.90821492927058770e-10));
    real n = exponent_of(x);
    real f = times_power_of_two(x, -n) - 1.0;
    real s = f / (2.0 + f);
    real s2 = s * s;
    real series = K(0.0);
    for (int k = BY_PRECISION(4, 10); k > 0; --k) series = s2 * (K(2.0 / (2 * k + 1)) + series);
    real half_square = 0.5 * f * f;
    real ln = n * ln2_high - ((half_square - (s * (half_square + series) + n * ln2_low)) - f);
    return ln;
}

// -ln(1 - alpha), the absorbance of a surface (MBOIT 3.1; optical depth in MT eq. 3), for
// alpha in [0, 1). What 1 - alpha rounds off is known exactly and put back to first order, so thin
// layers keep their digits: alpha = 1e-6 gives 1.0000005e-6.
FN number absorbance(real alpha) {
    real through = 1.0 - alpha;
    real lost = alpha - (1.0 - through);
    return lost / through - logarithm(through);
}

// A point of the unit circle.
STRUCT(circle_point) { number cosine, sine; };

// The point that lies `angle` radians, at most an eighth of a turn, beside a quarter of the turn:
// the series reach the last bit at these degrees.
FN circle_point beside_quarter(real quarters, real angle) {
    real square = angle * angle;
    real cosine = K(1.0);
    real sine = K(1.0);
    for (int k = BY_PRECISION(5, 8); k > 0; --k)
        cosine = 1.0 - cosine * square * K(1.0 / (2 * k * (2 * k - 1)));
    for (int k = BY_PRECISION(4, 8); k > 0; --k)
        sine = 1.0 - sine * square * K(1.0 / (2 * k * (2 * k + 1)));
    sine = angle * sine;
    // which quarter of the turn, from -2 to 2: 1 and -1 swap the two, 2 and -2 turn both around
    real quarter = quarters - 4.0 * nearest_integer(0.25 * quarters);
    real facing = 1.0 - abs(quarter);
    truth upright = abs(quarter) == 1.0;
    PRECISE circle_point p;
    p.cosine = select(upright, -(quarter * sine), facing * cosine);
    p.sine = select(upright, quarter * cosine, facing * sine);
    return p;
}

// cos(2 pi x) and sin(2 pi x), for |x| below 2^20. What is left beside a quarter is exact.
FN circle_point sine_cosine(real turns) {
    real quarters = nearest_integer(4.0 * turns);
    real angle = (turns - 0.25 * quarters) * K(6.283185307179586477);
    return beside_quarter(quarters, angle);
}

// cos(x) and sin(x), for |x| up to some turns: pi/2 is split so that n high is exact.
FN circle_point sine_cosine_of_angle(real x) {
    const real high = K(BY_PRECISION(1.5703125, 1.57079632673412561417));
    const real low = K(BY_PRECISION(4.8382679489661923e-4, 6.07710050650619224932e-11));
    real quarters = nearest_integer(x * K(0.63661977236758134308));
    real angle = (x - quarters * high) - quarters * low;
    return beside_quarter(quarters, angle);
}

FN number cosine_of_turns(real turns) {
    circle_point p = sine_cosine(turns);
    return p.cosine;
}

FN number sine_of_turns(real turns) {
    circle_point p = sine_cosine(turns);
    return p.sine;
}

// The sum of two angles.
FN circle_point turned(circle_point p, circle_point q) {
    PRECISE circle_point sum;
    sum.cosine = p.cosine * q.cosine - p.sine * q.sine;
    sum.sine = p.sine * q.cosine + p.cosine * q.sine;
    return sum;
}

#endif
