/* Rows of FLIP by lanes, compiled once for each instruction set: what filters add up, and section
 * 4.1.3 (color) and 4.3 (color and features) of Andersson et al. 2020. A unit defines SCALAR,
 * LANES, TABLE and, beyond the baseline, TARGET, as those of core/stages do. */
#include "core/metrics/flip.h"

#include "core/stages/lanes.h"

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

static void flip_errors(const float from_opponent[3][3], const float *image, const float *reference,
                        float *errors, int64_t stride) {
    const real greatest = greatest_difference();
    for (int64_t x = 0; x < stride; x += LANES) {
        seen p = see(from_opponent, image + x, stride);
        seen q = see(from_opponent, reference + x, stride);
        real error = error_of(p, q, greatest);
        memcpy(errors + x, &error, sizeof error);
    }
}

/* Adds to `many` vectors of out what one filter gives there, in its order for any lanes. */
FN void add_at(const flip_filter *filter, const bool odd, const int many,
               const float *const *centre, int64_t x, float *restrict out) {
    real sum[4];
    for (int i = 0; i < many; ++i)
        sum[i] =
            load(out + x + i * LANES) + K(filter->weights[0]) * load(centre[0] + x + i * LANES);
    for (int k = 1; k <= filter->reach; ++k) {
        const float *before = centre[-k] + x, *after = centre[k] + x;
        const real weight = K(filter->weights[k]);
        for (int i = 0; i < many; ++i) {
            real a = load(after + i * LANES), b = load(before + i * LANES);
            sum[i] += weight * (odd ? a - b : a + b);
        }
    }
    for (int i = 0; i < many; ++i) store(out + x + i * LANES, sum[i]);
}

FN void add_all(const flip_filter *filter, const bool odd, const float *const *centre,
                float *restrict out, int64_t stride) {
    int64_t x = 0;
    for (; x + 4 * LANES <= stride; x += 4 * LANES) add_at(filter, odd, 4, centre, x, out);
    for (; x < stride; x += LANES) add_at(filter, odd, 1, centre, x, out);
}

static void add_filtered(const flip_filter *filter, const float *const *lines, float *restrict out,
                         int64_t stride) {
    const float *const *centre = lines + FLIP_MOST_REACH;
    if (filter->odd) add_all(filter, true, centre, out, stride);
    else add_all(filter, false, centre, out, stride);
}

const flip_lines TABLE = {add_filtered, flip_errors};

#include "core/stages/lanes_end.h"
