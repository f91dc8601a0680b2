/* What drawing splats and its stage share. */
#ifndef MOIT_SPLATS_H
#define MOIT_SPLATS_H

#include "moit_geometry.h"

enum { MOIT_SPLAT_PIXELS = MOIT_SPLAT_TILE * MOIT_SPLAT_TILE };

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

/* Whether what is hidden has no fragments. */
bool moit_splats_end(moit_splatting splatting);

/* Fills on_screen, whose room is there. */
moit_status moit_project_splats(const moit_splat_raster *raster, const moit_splats *splats,
                                const moit_run *run);

/* Pixels of a tile: columns [left, right) of rows [top, bottom). */
typedef struct moit_tile_pixels {
    int left, top, right, bottom;
} moit_tile_pixels;

#endif
