/* Backwards through a network of two hidden layers that gives one share (kernels/network.h). */
#ifndef MOIT_ADJOINTS_NETWORKS_H
#define MOIT_ADJOINTS_NETWORKS_H

enum { MOIT_MOST_FIRST = 32, MOIT_MOST_SECOND = 16 };

typedef struct moit_network_shape {
    const float *weights;
    int inputs, first, second;
} moit_network_shape;

/* The hidden layers, as rectified, and the share. */
typedef struct moit_network_activity {
    double first[MOIT_MOST_FIRST], second[MOIT_MOST_SECOND], share;
} moit_network_activity;

/* Of inputs x. */
moit_network_activity moit_ask_network(const moit_network_shape *network, const double *x);

/* By the share: adds to by_x and, unless NULL, by_w, by the weights as they lie. */
void moit_pull_network(const moit_network_shape *network, const double *x,
                       const moit_network_activity *a, double by_share, double *by_x, double *by_w);

#endif
