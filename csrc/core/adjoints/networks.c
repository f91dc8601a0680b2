/* Backwards through small networks, layer by layer. */
#include "core/elementary.h"
#include "core/adjoints/networks.h"

#include <math.h>
#include <stddef.h>

static void layer(const float *w, int inputs, int outputs, const double *x, double *y) {
    for (int j = 0; j < outputs; ++j) {
        const float *row = w + j * (inputs + 1);
        y[j] = (double)row[inputs];
        for (int k = 0; k < inputs; ++k) y[j] += (double)row[k] * x[k];
    }
}

/* Adds to by_x and, unless NULL, by_w. */
static void pull_layer(const float *w, int inputs, int outputs, const double *x, const double *by_y,
                       double *by_x, double *by_w) {
    for (int j = 0; j < outputs; ++j) {
        const float *row = w + j * (inputs + 1);
        for (int k = 0; k < inputs; ++k) by_x[k] += (double)row[k] * by_y[j];
        if (!by_w) continue;
        double *by_row = by_w + j * (inputs + 1);
        for (int k = 0; k < inputs; ++k) by_row[k] += by_y[j] * x[k];
        by_row[inputs] += by_y[j];
    }
}

static void rectify(int n, double *y) {
    for (int j = 0; j < n; ++j) y[j] = y[j] > 0.0 ? y[j] : 0.0;
}

/* By what was rectified: as it was below 0, nothing. */
static void pull_rectified(int n, const double *y, double *by_y) {
    for (int j = 0; j < n; ++j) by_y[j] = y[j] > 0.0 ? by_y[j] : 0.0;
}

static const float *second_of(const moit_network_shape *n) {
    return n->weights + (ptrdiff_t)(n->inputs + 1) * n->first;
}

static const float *last_of(const moit_network_shape *n) {
    return second_of(n) + (ptrdiff_t)(n->first + 1) * n->second;
}

moit_network_activity moit_ask_network(const moit_network_shape *n, const double *x) {
    moit_network_activity a;
    double last;
    layer(n->weights, n->inputs, n->first, x, a.first);
    rectify(n->first, a.first);
    layer(second_of(n), n->first, n->second, a.first, a.second);
    rectify(n->second, a.second);
    layer(last_of(n), n->second, 1, a.second, &last);
    a.share = 1.0 / (1.0 + moit_exp(-last));
    return a;
}

void moit_pull_network(const moit_network_shape *n, const double *x, const moit_network_activity *a,
                       double by_share, double *by_x, double *by_w) {
    double by_second[MOIT_MOST_SECOND] = {0.0}, by_first[MOIT_MOST_FIRST] = {0.0};
    double by_last = by_share * a->share * (1.0 - a->share);
    ptrdiff_t second = second_of(n) - n->weights, last = last_of(n) - n->weights;
    pull_layer(last_of(n), n->second, 1, a->second, &by_last, by_second, by_w ? by_w + last : NULL);
    pull_rectified(n->second, a->second, by_second);
    pull_layer(second_of(n), n->first, n->second, a->first, by_second, by_first,
               by_w ? by_w + second : NULL);
    pull_rectified(n->first, a->first, by_first);
    pull_layer(n->weights, n->inputs, n->first, x, by_first, by_x, by_w);
}
