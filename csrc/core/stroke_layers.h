/* What strokes leave in a pixel: parts that follow one another and meet there are one layer. */
#ifndef MOIT_STROKE_LAYERS_H
#define MOIT_STROKE_LAYERS_H

#include "core/stages/stages.h"

/* A part that is being drawn. */
typedef struct moit_stroke_look {
    const moit_stroke_raster *raster;
    const moit_stages *stages; /* of doubles */
    const moit_screen_stroke *stroke;
    bool alone;       /* no other part joins it: nobody asks for ranks */
    bool depth_only;  /* nor for anything but depth */
    bool exists_only; /* of one that is alone: nor for that, but whether there is a fragment */
} moit_stroke_look;

/* A layer of a pixel: which samples it covers, where they have been ranked, and sums over them.
 * near, far: between which depths it lies, with its own thickness. */
typedef struct moit_stroke_layer {
    uint64_t covered;
    int32_t place;      /* of its last part */
    bool opens, closes; /* it has the first part; its last part meets the first one */
    double near, far, depth, alpha, color[3], share[MOIT_MOST_LIGHTS];
    float rank[MOIT_SAMPLES]; /* the last member: nobody clears it */
} moit_stroke_layer;

/* What a part covers of n pixels of a row from (left, top) on, as many as a tile has columns at
 * most. */
enum { MOIT_STROKE_TILE = 16 };
typedef struct moit_stroke_row {
    double away[MOIT_STROKE_TILE + 16];
    moit_stroke_points points; /* where a pixel has one sample */
    int left, top;
} moit_stroke_row;
void moit_look_at_row(const moit_stroke_look *look, int left, int top, int n, moit_stroke_row *row);

/* What it covers of the i-th of these pixels; false: nothing. */
bool moit_cover_by_stroke(const moit_stroke_look *look, const moit_stroke_row *row, int i,
                          moit_stroke_layer *out);

/* Whether a part that covers `own` of the pixel at (x, y) goes on where `layer` ends: it overlaps
 * it, or their joint, the part's end `end`, is there. */
bool moit_stroke_goes_on(const moit_stroke_layer *layer, const moit_stroke_layer *own,
                         const moit_screen_stroke *stroke, int end, double x, double y);

/* Joins what `own` covers to the layer: where both cover a sample the lesser rank is seen. */
void moit_join_strokes(moit_stroke_layer *layer, const moit_stroke_layer *own);

/* The fragment of a layer. reached: the share of each light that comes to it; NULL: all. */
typedef struct moit_stroke_fragment {
    float depth, alpha, color[3];
} moit_stroke_fragment;
moit_stroke_fragment moit_fragment_of_stroke(const moit_stroke_raster *raster,
                                             const moit_stroke_layer *layer, const double *reached);

#endif
