/* FLIP's filters and its opponent space, once a comparison. Sections and Table 1 are those of
 * Andersson et al. 2020. */
#include "core/elementary.h"
#include "core/metrics/flip.h"

#include <math.h>

/* 0.7 m from a display 0.7 m and 3840 pixels wide: 67.02. */
static const double pixels_per_degree = 3840.0 * (M_PI / 180.0);

/* Farther taps of a narrow Gaussian change no float. */
static void drop_what_rounds_away(flip_filter *filter) {
    while (filter->reach > 0 && filter->weights[filter->reach] < 1e-9f * filter->weights[0])
        --filter->reach;
}

/* 4.1: the contrast sensitivity function of one channel, a sum of Gaussians in frequency, seen in
 * space: sqrt(a sqrt(pi / b)) exp(-(pi x)^2 / b) along each axis, x in degrees. Gives the sum. */
static double sensitivity(flip_filter *filter, double a, double b) {
    const double widest = 0.04; /* the greatest b: its 3 sigma cut all channels */
    *filter = (flip_filter){
        .reach = (int)ceil(3.0 * sqrt(widest / (2.0 * M_PI * M_PI)) * pixels_per_degree)};
    double sum = 0.0;
    for (int k = 0; k <= filter->reach; ++k) {
        double x = M_PI * k / pixels_per_degree;
        double weight = sqrt(a * sqrt(M_PI / b)) * moit_exp(-x * x / b);
        filter->weights[k] = (float)weight;
        sum += k ? 2.0 * weight : weight;
    }
    drop_what_rounds_away(filter);
    return sum;
}

static void scale(flip_filter *filter, double factor) {
    for (int k = 0; k <= filter->reach; ++k)
        filter->weights[k] = (float)((double)filter->weights[k] * factor);
}

/* Table 1. */
static void contrast_sensitivity(flip_filters *flip) {
    scale(&flip->luminance, 1.0 / sensitivity(&flip->luminance, 1.0, 0.0047));
    scale(&flip->red_green, 1.0 / sensitivity(&flip->red_green, 1.0, 0.0053));
    double narrow = sensitivity(&flip->blue_yellow[0], 34.1, 0.04);
    double wide = sensitivity(&flip->blue_yellow[1], 13.5, 0.025);
    for (int i = 0; i < 2; ++i)
        scale(&flip->blue_yellow[i], 1.0 / sqrt(narrow * narrow + wide * wide));
}

/* 4.2: a Gaussian as wide as an edge detector of 0.082 degrees, and its derivatives, of which
 * positive and negative weights sum to 1 and -1 each. */
static void features(flip_filters *flip) {
    const double sigma = 0.5 * 0.082 * pixels_per_degree;
    const int reach = (int)ceil(3.0 * sigma);
    double smooth = 0.0, edge = 0.0, rising = 0.0, falling = 0.0;
    double weights[3][BLOCK_REACH + 1];
    for (int k = 0; k <= reach; ++k) {
        double both = k ? 2.0 : 1.0, gauss = moit_exp(-0.5 * k * k / (sigma * sigma));
        weights[0][k] = gauss;
        weights[1][k] = -k * gauss;
        weights[2][k] = (k * k / (sigma * sigma) - 1.0) * gauss;
        smooth += both * gauss;
        edge += k * gauss;
        *(weights[2][k] > 0.0 ? &rising : &falling) += both * fabs(weights[2][k]);
    }
    flip->smooth = (flip_filter){.reach = reach};
    flip->edge = (flip_filter){.reach = reach};
    flip->point = (flip_filter){.reach = reach};
    for (int k = 0; k <= reach; ++k) {
        flip->smooth.weights[k] = (float)(weights[0][k] / smooth);
        flip->edge.weights[k] = (float)(weights[1][k] / edge);
        flip->point.weights[k] = (float)(weights[2][k] / (weights[2][k] > 0.0 ? rising : falling));
    }
}

/* Opponent space is (y, x - y, y - z) over white. CIE's offsets and factors, the same for both
 * images and every pixel, would cancel again after the linear filters. */
static void opponent_space(flip_filters *flip) {
    const double(*m)[3] = moit_xyz_over_white;
    double inverse[3][3], determinant = 0.0;
    for (int i = 0; i < 3; ++i) {
        int i1 = (i + 1) % 3, i2 = (i + 2) % 3;
        for (int j = 0; j < 3; ++j) {
            int j1 = (j + 1) % 3, j2 = (j + 2) % 3;
            inverse[j][i] = m[i1][j1] * m[i2][j2] - m[i1][j2] * m[i2][j1];
        }
        determinant += m[0][i] * inverse[i][0];
    }
    for (int i = 0; i < 3; ++i) {
        flip->to_opponent[0][i] = (float)m[1][i];
        flip->to_opponent[1][i] = (float)(m[0][i] - m[1][i]);
        flip->to_opponent[2][i] = (float)(m[1][i] - m[2][i]);
        /* x = y + (x - y), z = y - (y - z) */
        flip->from_opponent[i][0] =
            (float)((inverse[i][0] + inverse[i][1] + inverse[i][2]) / determinant);
        flip->from_opponent[i][1] = (float)(inverse[i][0] / determinant);
        flip->from_opponent[i][2] = (float)(-inverse[i][2] / determinant);
    }
}

void moit_flip_prepare(flip_filters *flip) {
    contrast_sensitivity(flip);
    features(flip);
    opponent_space(flip);
}
