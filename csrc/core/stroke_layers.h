/* What strokes leave in a pixel: parts that follow one another and meet there are one layer. */
#ifndef MOIT_STROKE_LAYERS_H
#define MOIT_STROKE_LAYERS_H

#include "core/strokes.h"

/* A layer of a pixel: which samples it covers, where they have been ranked, and sums over them.
 * near, far: between which depths it lies, with its own thickness. */
typedef struct moit_stroke_layer {
    uint64_t covered;
    int32_t place;      /* of its last part */
    bool opens, closes; /* it has the first part; its last part meets the first one */
    double near, far, depth, alpha, color[3], share[MOIT_MOST_LIGHTS];
    float rank[MOIT_SAMPLES]; /* the last member: nobody clears it */
} moit_stroke_layer;

/* What a part covers of the pixel whose corner is (x, y); false: nothing. */
bool moit_cover_by_stroke(const moit_stroke_shape *shape, double x, double y,
                          moit_stroke_layer *out);

/* Whether a part that covers `own` of the pixel at (x, y) goes on where `layer` ends: it overlaps
 * it, or their joint, the part's end `end`, is there. */
bool moit_stroke_goes_on(const moit_stroke_layer *layer, const moit_stroke_layer *own,
                         const moit_stroke_shape *shape, int end, double x, double y);

/* Joins what `own` covers to the layer: where both cover a sample the lesser rank is seen. */
void moit_join_strokes(moit_stroke_layer *layer, const moit_stroke_layer *own);

/* The fragment of a layer. reached: the share of each light that comes to it; NULL: all. */
typedef struct moit_stroke_fragment {
    float depth, alpha, color[3];
} moit_stroke_fragment;
moit_stroke_fragment moit_fragment_of_stroke(const moit_stroke_raster *raster,
                                             const moit_stroke_layer *layer, const double *reached);

#endif
