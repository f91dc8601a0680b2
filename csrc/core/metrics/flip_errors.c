/* FLIP's comparison of filtered rows: sections 4.1.3 (color) and 4.3 (color and features) of
 * Andersson et al. 2020. */
#include "core/metrics/flip.h"

#define SCALAR float
#define LANES FLIP_LANES
#include "kernels/dialect.h"
#include "kernels/elementary.h"

const double moit_xyz_over_white[3][3] = {
    {0.4338953888315031, 0.3762423726222511, 0.1898622385462458},
    {0.2126368216773238, 0.7151829818412507, 0.0721801964814255},
    {0.0177524231517299, 0.1094656286624651, 0.8727819481858050},
};

STRUCT(rgb) { real r, g, b; };
STRUCT(lab) { real lightness, a, b; };

STRUCT(seen) {
    lab color;
    real edge, point; /* lengths of gradients */
};

/* CIE 1976's cube root and the line that continues it near black. */
FN real perceived(real t) {
    const real least = K(216.0 / 24389.0); /* (6/29)^3 */
    real root = exponential(logarithm(max(t, least)) * K(1.0 / 3.0));
    return select(t > least, root, t * K(841.0 / 108.0) + K(4.0 / 29.0));
}

FN real over_white(int i, rgb c) {
    const double *m = moit_xyz_over_white[i];
    return c.r * K(m[0]) + c.g * K(m[1]) + c.b * K(m[2]);
}

/* CIELAB, the chroma scaled by lightness: the Hunt effect. */
FN lab hunt_lab(rgb c) {
    real x = perceived(over_white(0, c)), y = perceived(over_white(1, c));
    real z = perceived(over_white(2, c));
    real lightness = K(116.0) * y - K(16.0), share = K(0.01) * lightness;
    return (lab){lightness, share * (K(500.0) * (x - y)), share * (K(200.0) * (y - z))};
}

/* x^power; 0 where x is too small for a logarithm. */
FN real raised(real x, real power) {
    const real least = K(1e-35);
    return select(x < least, K(0.0), exponential(logarithm(max(x, least)) * power));
}

/* HyAB, a distance meant for large differences, to the power of 0.7. */
FN real color_difference(lab p, lab q) {
    real a = p.a - q.a, b = p.b - q.b;
    return raised(abs(p.lightness - q.lightness) + sqrt(a * a + b * b), K(0.7));
}

/* That of the two farthest colors of sRGB, green and blue. */
FN real greatest_difference(void) {
    const real none = K(0.0), full = K(1.0);
    return color_difference(hunt_lab((rgb){none, full, none}), hunt_lab((rgb){none, none, full}));
}

FN seen see(const float from_opponent[3][3], const float *filtered, int64_t stride) {
    real v[FLIP_ROWS], channels[3];
    for (int i = 0; i < FLIP_ROWS; ++i) memcpy(&v[i], filtered + i * stride, sizeof(real));
    for (int i = 0; i < 3; ++i) {
        const float *m = from_opponent[i];
        channels[i] =
            K(m[0]) * v[FLIP_Y] + K(m[1]) * v[FLIP_RED_GREEN] + K(m[2]) * v[FLIP_BLUE_YELLOW];
        channels[i] = clamp(channels[i], K(0.0), K(1.0));
    }
    return (seen){
        hunt_lab((rgb){channels[0], channels[1], channels[2]}),
        sqrt(v[FLIP_EDGE_X] * v[FLIP_EDGE_X] + v[FLIP_EDGE_Y] * v[FLIP_EDGE_Y]),
        sqrt(v[FLIP_POINT_X] * v[FLIP_POINT_X] + v[FLIP_POINT_Y] * v[FLIP_POINT_Y]),
    };
}

/* The color's error, the closer to 1 the more the features differ. Color differences beyond 0.4 of
 * the greatest are compressed into the last twentieth. */
FN real error_of(seen p, seen q, real greatest) {
    const real knee = K(0.4) * greatest, linear_share = K(0.95);
    real difference = color_difference(p.color, q.color);
    real beyond = (difference - knee) / (greatest - knee);
    real error = select(difference < knee, difference * (linear_share / knee),
                        linear_share + beyond * (1.0f - linear_share));
    real feature = max(abs(p.edge - q.edge), abs(p.point - q.point)) * K(0.70710678118654752);
    return min(raised(error, 1.0f - sqrt(feature)), K(1.0));
}

void moit_flip_errors(const float from_opponent[3][3], const float *image, const float *reference,
                      float *errors, int64_t stride) {
    const real greatest = greatest_difference();
    for (int64_t x = 0; x < stride; x += LANES) {
        seen p = see(from_opponent, image + x, stride);
        seen q = see(from_opponent, reference + x, stride);
        real error = error_of(p, q, greatest);
        memcpy(errors + x, &error, sizeof error);
    }
}
