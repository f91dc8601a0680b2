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

/* How parts are looked at: at a place (x, y) of the screen along slope[k] + (x or y)
 * slope_of_one[k] and 1. */
typedef struct moit_stroke_sight {
    double slope[2], slope_of_one[2], near, far;
    bool solid;
} moit_stroke_sight;

struct moit_stroke_raster {
    moit_stroking how;
    moit_camera camera;
    moit_stroke_sight sight;
    int width, height; /* pixels */
    int columns, rows; /* tiles */
    moit_stroke_part *parts;
    int64_t count;   /* parts */
    int64_t *first;  /* (tiles + 1) */
    int32_t *listed; /* parts of each tile, in order */
    const int64_t *offsets;
};

/* What places of the screen have met of a part, as csrc/kernels/strokes.h has it; met: a bit for
 * each. Between which depths that lies, with its own thickness: near, far. Arrays are padded. */
enum { MOIT_STROKE_ROOM = MOIT_SAMPLES + 16 };
typedef struct moit_stroke_points {
    uint64_t met;
    double near, far;
    double share[MOIT_STROKE_ROOM], rank[MOIT_STROKE_ROOM], middle[MOIT_STROKE_ROOM];
} moit_stroke_points;

/* A raster that has no parts yet. */
moit_stroke_raster moit_stroke_raster_of(const moit_stroking *how, const moit_camera *camera,
                                         int width, int height);

/* Fills parts, of a raster that has none. */
moit_status moit_stroke_parts(moit_stroke_raster *raster, const moit_strokes *strokes);

/* A part as it is drawn; `alpha` and `other` are those of the part alone. */
moit_screen_stroke moit_screen_stroke_of(const moit_stroke_raster *raster,
                                         const moit_stroke_part *part);

/* The share of each light that falls on what is met of something solid at (x, y): one share where
 * the camera has none; and what of a colour is seen in such light. */
int moit_light_shares(const moit_stroke_raster *raster, const moit_screen_stroke *stroke,
                      double met_share, double rank, double x, double y, double *share);
void moit_lit_color(const moit_stroke_raster *raster, const double *share, double color[3]);

#endif
