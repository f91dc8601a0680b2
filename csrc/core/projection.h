/* Triangles on the screen: what projecting a mesh leaves, and drawing its tiles needs. */
#ifndef MOIT_PROJECTION_H
#define MOIT_PROJECTION_H

#include "core/raster.h"

#include <stddef.h>

struct moit_raster {
    const moit_mesh *mesh;
    moit_camera camera;
    int width, height, columns, rows; /* pixels; tiles */
    bool by_area;                     /* what triangles touch, not whose middle they cover */
    moit_projected_triangle *triangles;
    int64_t count, room;
    double (*weights)[3][3]; /* of the mesh's corners, for each corner that clipping made */
    int64_t clipped, clipped_room;
    int64_t *first;  /* (tiles + 1) */
    int32_t *listed; /* triangles of each tile, in order */
    int64_t *offsets;
};

/* Fills triangles and weights, of a raster that has neither: what is in front of the eye, clipped
 * to the guard band and snapped. */
moit_status moit_project(moit_raster *r, const moit_run *run);

static inline double moit_dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* What a triangle wears, NULL where it is nothing. */
static inline const moit_material *moit_material_of(const moit_raster *r, int64_t source) {
    const moit_mesh *m = r->mesh;
    return m->uv && m->material_of[source] >= 0 ? &m->materials[m->material_of[source]] : NULL;
}

#endif
