/* What the rasteriser and its stages share. */
#ifndef MOIT_RASTER_H
#define MOIT_RASTER_H

#include "moit_geometry.h"

/* Tiles are squares of pixels. */
enum { MOIT_RASTER_TILE = 32 };

/* A triangle on the screen, of positive area: x to the right, y down, in 1/256 pixel. */
typedef struct moit_projected_triangle {
    int32_t x[3], y[3];
    int32_t clipped; /* its row of moit_raster.weights, -1: its corners are the mesh's own */
    bool opaque;     /* alpha 1 at all corners */
    bool turned;     /* its last two corners changed places to make the area positive */
    int64_t source;  /* the mesh's triangle */
    double inverse_z[3];
} moit_projected_triangle;

/* Pixels of a triangle in a tile, in rows: x and y of the pixel, weights of its second and third
 * corner on the surface, and z; and by areas the share of the pixel that it covers. Arrays are
 * padded (stages.h). */
typedef struct moit_covered {
    double x[MOIT_RASTER_TILE * MOIT_RASTER_TILE + 16], y[MOIT_RASTER_TILE * MOIT_RASTER_TILE + 16],
        second[MOIT_RASTER_TILE * MOIT_RASTER_TILE + 16],
        third[MOIT_RASTER_TILE * MOIT_RASTER_TILE + 16],
        z[MOIT_RASTER_TILE * MOIT_RASTER_TILE + 16],
        share[MOIT_RASTER_TILE * MOIT_RASTER_TILE + 16];
    int32_t place[MOIT_RASTER_TILE * MOIT_RASTER_TILE + 16]; /* of the pixel in its tile */
} moit_covered;

/* As stages->cover by areas: all pixels of the rectangle that the triangle touches. */
int moit_cover_areas(const moit_projected_triangle *triangle, int left, int top, int right,
                     int bottom, moit_covered *out);

/* Padded numbers of a tile's pixels. */
enum { MOIT_REACHED = MOIT_RASTER_TILE * MOIT_RASTER_TILE + 16 };

/* How a triangle's image is read: its first texel, and of the corners the place on it and 1/z.
 * step: by how much the weights on the screen of the second and third corner change to the next
 * pixel of the row, and of the column. */
typedef struct moit_sampling {
    const moit_material *material;
    const float *texels;
    double u[3], v[3], inverse_z[3], step[2][2];
} moit_sampling;

/* A triangle's corners as light finds them: colours, opacity, and normals as the eye sees them. */
typedef struct moit_corners {
    double color[3][3], alpha[3], normal[3][3];
} moit_corners;

#endif
