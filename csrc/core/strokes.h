/* What the parts of strokes, their shapes and drawing them share. */
#ifndef MOIT_CORE_STROKES_H
#define MOIT_CORE_STROKES_H

#include "moit_geometry.h"

/* A node as the eye sees it: at (right, up, away). */
typedef struct moit_stroke_end {
    double at[3], radius;
    float color[3], alpha;
} moit_stroke_end;

/* From node to node, in front of the eye; of a point both ends are the same. Places of parts of a
 * stroke follow one another where the parts do. */
typedef struct moit_stroke_part {
    moit_stroke_end end[2];
    int32_t stroke, place;
    bool opens, closes; /* the first and the last part of a closed stroke */
} moit_stroke_part;

struct moit_stroke_raster {
    moit_stroking how;
    moit_camera camera;
    int width, height; /* pixels */
    int columns, rows; /* tiles */
    moit_stroke_part *parts;
    int64_t count;   /* parts */
    int64_t *first;  /* (tiles + 1) */
    int32_t *listed; /* parts of each tile, in order */
    const int64_t *offsets;
};

/* Fills parts, of a raster that has none. */
moit_status moit_stroke_parts(moit_stroke_raster *raster, const moit_strokes *strokes);

/* A part on the screen: two circles, in pixels, between whose tangents all of it lies; a flat one
 * is just that. */
typedef struct moit_stroke_shape {
    const moit_stroke_part *part;
    const moit_stroke_raster *raster;
    double x[2], y[2], radius[2];
    double along[2], length, lean, upright; /* direction of the axis, and of the tangents to it */
    int holder;                             /* the circle that holds the other one, or -1 */
    bool everywhere;                        /* it is so near that it may be seen anywhere */
    /* Of what is solid: |at|^2 - radius^2 of its ends, and of all balls between these what rays are
     * put into; and rays of places on the screen, slopes at (0, 0) and how much more a pixel on. */
    double outside[2], over, per_over, start, beyond, slope[2], slope_of_one[2];
} moit_stroke_shape;
moit_stroke_shape moit_shape_of_stroke(const moit_stroke_raster *raster,
                                       const moit_stroke_part *part);

/* How far (x, y) is from the part on the screen, in pixels, below 0 inside; no farther than from a
 * solid one. *share: of the way along the axis, on the screen. */
double moit_away_from_stroke(const moit_stroke_shape *shape, double x, double y, double *share);

/* What is met at (x, y). depth: of the surface, or of the middle where radii are pixels; middle: of
 * the axis there, which is so thick; rank: less is seen before more. */
typedef struct moit_stroke_point {
    double share, depth, middle, thickness, rank;
    double normal[3]; /* of what is solid, towards its outside, of any length */
} moit_stroke_point;
bool moit_meets_stroke(const moit_stroke_shape *shape, double x, double y, moit_stroke_point *out);

/* The share of each light that falls on a surface of such a normal, seen at (x, y): one share where
 * the camera has none; and what of a colour is seen in such light. */
int moit_light_shares(const moit_stroke_raster *raster, const double normal[3], double x, double y,
                      double *share);
void moit_lit_color(const moit_stroke_raster *raster, const double *share, double color[3]);

#endif
