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

FN seen load_seen(const float row[FLIP_SEEN][BLOCK_SIDE], int x) {
    return (seen){{load(row[FLIP_L] + x), load(row[FLIP_A] + x), load(row[FLIP_B] + x)},
                  load(row[FLIP_EDGES] + x),
                  load(row[FLIP_POINTS] + x)};
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

static void raise_errors(const float image[FLIP_SEEN][BLOCK_SIDE],
                         const float reference[FLIP_SEEN][BLOCK_SIDE], float errors[BLOCK_SIDE]) {
    const real greatest = greatest_difference();
    for (int x = 0; x < BLOCK_SIDE; x += LANES) {
        real error = error_of(load_seen(image, x), load_seen(reference, x), greatest);
        store(errors + x, max(load(errors + x), error));
    }
}

FN real aces(real x) {
    real below = x * (K(MOIT_ACES_SQUARE_BELOW) * x + K(MOIT_ACES_SLOPE_BELOW))
                 + K(MOIT_ACES_CONSTANT_BELOW);
    return min(x * (K(MOIT_ACES_SQUARE) * x + K(MOIT_ACES_SLOPE)) / below, K(1.0));
}

/* Scaled in doubles, whose range no image leaves. Negative radiance is shown as black: the curve
 * would turn it bright. */
FN void display_row(flip_display display, const double *row, float *shown) {
    const double root = display.root, white = display.exposed ? 100.0 : 1.0;
    for (int x = 0; x < BLOCK_STRIDE; ++x) {
        double bright = row[x] > 0.0 ? row[x] : 0.0;
        bright = bright * root * root;
        shown[x] = (float)(bright < white ? bright : white);
    }
    if (!display.exposed) return;
    for (int x = 0; x < BLOCK_STRIDE; x += LANES) store(shown + x, aces(load(shown + x)));
}

static void show(const flip_filters *filters, flip_display display, const double *const rgb[3],
                 float opponent[3][BLOCK_STRIDE]) {
    float shown[3][BLOCK_STRIDE];
    for (int i = 0; i < 3; ++i) display_row(display, rgb[i], shown[i]);
    for (int x = 0; x < BLOCK_STRIDE; x += LANES) {
        real r = load(shown[0] + x), g = load(shown[1] + x), b = load(shown[2] + x);
        for (int i = 0; i < 3; ++i) {
            const float *m = filters->to_opponent[i];
            store(opponent[i] + x, K(m[0]) * r + K(m[1]) * g + K(m[2]) * b);
        }
    }
}

enum { TOGETHER = 2 }; /* vectors along a row, whose sums do not wait for one another */

/* Sums of one filter of even weights; each adds its terms in one order, from the centre on. */
FN void even_along(const flip_filter *filter, const float *row, real sum[TOGETHER]) {
    for (int i = 0; i < TOGETHER; ++i) sum[i] = K(filter->weights[0]) * load(row + i * LANES);
    for (int k = 1; k <= filter->reach; ++k) {
        for (int i = 0; i < TOGETHER; ++i) {
            real both = load(row + k + i * LANES) + load(row - k + i * LANES);
            sum[i] += K(filter->weights[k]) * both;
        }
    }
}

FN void put_along(const real sum[TOGETHER], float *out) {
    for (int i = 0; i < TOGETHER; ++i) store(out + i * LANES, sum[i]);
}

/* The four filters of luminance, whose sums of both sides are the same. */
FN void luminance_along(const flip_filters *filters, const float *row, int x,
                        float planes[FLIP_PLANES][BLOCK_SIDE]) {
    real narrow[TOGETHER], smooth[TOGETHER], edge[TOGETHER], point[TOGETHER];
    for (int i = 0; i < TOGETHER; ++i) {
        real centre = load(row + i * LANES);
        narrow[i] = K(filters->luminance.weights[0]) * centre;
        smooth[i] = K(filters->smooth.weights[0]) * centre;
        edge[i] = K(filters->edge.weights[0]) * centre;
        point[i] = K(filters->point.weights[0]) * centre;
    }
    for (int k = 1; k <= filters->smooth.reach; ++k) {
        const bool near = k <= filters->luminance.reach;
        for (int i = 0; i < TOGETHER; ++i) {
            real after = load(row + k + i * LANES), before = load(row - k + i * LANES);
            real both = after + before;
            if (near) narrow[i] += K(filters->luminance.weights[k]) * both;
            smooth[i] += K(filters->smooth.weights[k]) * both;
            edge[i] += K(filters->edge.weights[k]) * (after - before);
            point[i] += K(filters->point.weights[k]) * both;
        }
    }
    put_along(narrow, planes[FLIP_LUMINANCE] + x);
    put_along(smooth, planes[FLIP_SMOOTH] + x);
    put_along(edge, planes[FLIP_EDGE] + x);
    put_along(point, planes[FLIP_POINT] + x);
}

static void along(const flip_filters *filters, const float opponent[3][BLOCK_STRIDE],
                  float planes[FLIP_PLANES][BLOCK_SIDE]) {
    for (int x = 0; x < BLOCK_SIDE; x += TOGETHER * LANES) {
        const float *luminance = opponent[0] + BLOCK_REACH + x;
        const float *red_green = opponent[1] + BLOCK_REACH + x;
        const float *blue_yellow = opponent[2] + BLOCK_REACH + x;
        real sum[TOGETHER];
        luminance_along(filters, luminance, x, planes);
        even_along(&filters->red_green, red_green, sum);
        put_along(sum, planes[FLIP_NARROW_RED_GREEN] + x);
        even_along(&filters->blue_yellow[0], blue_yellow, sum);
        put_along(sum, planes[FLIP_NARROW_BLUE_YELLOW] + x);
        even_along(&filters->blue_yellow[1], blue_yellow, sum);
        put_along(sum, planes[FLIP_WIDE_BLUE_YELLOW] + x);
    }
}

typedef const float (*plane_rows)[FLIP_PLANES][BLOCK_SIDE];

/* sum + what a filter gives across rows of one plane. */
FN real even_across(const flip_filter *filter, plane_rows rows, int plane, int x, real sum) {
    plane_rows centre = rows + BLOCK_REACH;
    sum += K(filter->weights[0]) * load(centre[0][plane] + x);
    for (int k = 1; k <= filter->reach; ++k)
        sum += K(filter->weights[k]) * (load(centre[k][plane] + x) + load(centre[-k][plane] + x));
    return sum;
}

/* The lengths of gradients: edges in `edge`, and points in `point`. */
FN void gradients(const flip_filters *filters, plane_rows rows, int x, real *edge, real *point) {
    plane_rows centre = rows + BLOCK_REACH;
    real edge_y = K(0.0);
    real point_y = K(filters->point.weights[0]) * load(centre[0][FLIP_SMOOTH] + x);
    for (int k = 1; k <= filters->smooth.reach; ++k) {
        real after = load(centre[k][FLIP_SMOOTH] + x), before = load(centre[-k][FLIP_SMOOTH] + x);
        edge_y += K(filters->edge.weights[k]) * (after - before);
        point_y += K(filters->point.weights[k]) * (after + before);
    }
    real edge_x = even_across(&filters->smooth, rows, FLIP_EDGE, x, K(0.0));
    real point_x = even_across(&filters->smooth, rows, FLIP_POINT, x, K(0.0));
    *edge = sqrt(edge_x * edge_x + edge_y * edge_y);
    *point = sqrt(point_x * point_x + point_y * point_y);
}

static void see(const flip_filters *filters, plane_rows rows, float seen[FLIP_SEEN][BLOCK_SIDE]) {
    for (int x = 0; x < BLOCK_SIDE; x += LANES) {
        const real none = K(0.0);
        real y = even_across(&filters->luminance, rows, FLIP_LUMINANCE, x, none);
        real rg = even_across(&filters->red_green, rows, FLIP_NARROW_RED_GREEN, x, none);
        real by = even_across(&filters->blue_yellow[0], rows, FLIP_NARROW_BLUE_YELLOW, x, none);
        by = even_across(&filters->blue_yellow[1], rows, FLIP_WIDE_BLUE_YELLOW, x, by);
        real channels[3], edge, point;
        for (int i = 0; i < 3; ++i) {
            const float *m = filters->from_opponent[i];
            channels[i] = clamp(K(m[0]) * y + K(m[1]) * rg + K(m[2]) * by, K(0.0), K(1.0));
        }
        lab color = hunt_lab((rgb){channels[0], channels[1], channels[2]});
        gradients(filters, rows, x, &edge, &point);
        store(seen[FLIP_L] + x, color.lightness);
        store(seen[FLIP_A] + x, color.a);
        store(seen[FLIP_B] + x, color.b);
        store(seen[FLIP_EDGES] + x, edge);
        store(seen[FLIP_POINTS] + x, point);
    }
}

const flip_lines TABLE = {show, along, see, raise_errors};

#include "core/stages/lanes_end.h"
