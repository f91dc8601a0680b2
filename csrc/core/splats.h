/* What drawing splats and its stage share. */
#ifndef MOIT_SPLATS_H
#define MOIT_SPLATS_H

#include "moit.h"

/* Tiles are squares of pixels, as the reference rasteriser of 3D Gaussian Splatting has them:
 * which of them a splat is drawn in decides what of its rim is seen. */
enum { MOIT_SPLAT_TILE = 16, MOIT_SPLAT_PIXELS = MOIT_SPLAT_TILE * MOIT_SPLAT_TILE };

/* A splat on the screen. Of a pixel so far from its middle (dx to the right, dy down), in
 * deviations squared: square (dx^2, dx dy, dy^2) over along (1, dx, dy, dx^2, dx dy, dy^2), and its
 * distance from the eye: depth (1, dx, dy) over the same. flat: along is 1, and so are no more than
 * the first of depth. */
typedef struct moit_screen_splat {
    double x, y; /* its middle, in pixels */
    float square[3], along[6], depth[3];
    float opacity, color[3];
    float nearest;                    /* what is nearer than that is not seen */
    float z;                          /* of its middle */
    int32_t across[2], down[2];       /* the first and last pixels where it may be seen */
    int32_t left, top, right, bottom; /* tiles: [left, right), [top, bottom); none: not seen */
    bool flat;
} moit_screen_splat;

struct moit_splat_raster {
    moit_splatting splatting;
    moit_camera camera;
    int width, height;            /* pixels */
    int columns, rows;            /* tiles */
    int64_t count;                /* splats */
    moit_screen_splat *on_screen; /* (count) */
    int64_t *first;               /* (tiles + 1) */
    int32_t *listed;              /* splats of each tile, in order */
    int32_t *order;               /* where front to back each stands among them; or NULL */
    int64_t most_listed;          /* of a tile */
    const int64_t *offsets;
};

/* Fills on_screen, whose room is there. */
moit_status moit_project_splats(const moit_splat_raster *raster, const moit_splats *splats,
                                const moit_run *run);

/* Pixels of a tile: columns [left, right) of rows [top, bottom). */
typedef struct moit_tile_pixels {
    int left, top, right, bottom;
} moit_tile_pixels;

#endif
