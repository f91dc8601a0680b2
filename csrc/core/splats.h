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

/* ---- Projection: what is read forwards and, for derivatives, backwards ----------------------- */

#define MOIT_SPLAT_DILATION 0.3    /* what is added to variances, in pixels squared */
#define MOIT_THINNEST_SPLAT 1e-4   /* of the longest axis: along rays a disc has some thickness */
#define MOIT_MOST_SPLAT_ALPHA 0.99 /* as csrc/kernels/splats.h has it */

/* The middle from the eye, in the world and as the eye sees it (right, up, away). */
void moit_splat_middle(const moit_splat_raster *raster, const moit_splats *splats, int64_t i,
                       double away[3], double at[3]);

/* The directions of its axes in the world, from a quaternion. */
void moit_splat_columns(const float *quaternion, double column[3][3]);

/* Its axes as the eye sees them, each as long as the deviation along it. */
void moit_splat_axes(const moit_splat_raster *raster, const moit_splats *splats, int64_t i,
                     double axis[3][3]);

/* The least that an axis is long: of what is seen along rays; else 0. */
double moit_least_scale(const moit_splat_raster *raster, const moit_splats *splats, int64_t i);

/* As an ellipse: slopes of its middle, and where they are held; axes on the screen, in pixels. */
typedef struct moit_flat_splat {
    double pixels[2], limit[2], slope[2], limited[2], on[3][2];
} moit_flat_splat;
void moit_flatten_splat(const moit_splat_raster *raster, const double at[3],
                        const double axis[3][3], moit_flat_splat *flat);

/* What MOIT_FILTERED leaves of opacity: the root of how the area of an ellipse of such a covariance
 * (xx, xy, yy) grows by what is added to it. by: its derivatives by these, or NULL. */
double moit_filtered_share(const double covariance[3], double by[3]);

/* By rays: with A what makes the ellipsoid a sphere (rows `sphere`), a ray of direction
 * d = m / z + e comes nearest to its middle m at the distance |A m x A d| / |A d|
 * = |A m x A e| / |A d|: nothing cancels. u: A m; step: A e of a pixel's side; turned: u x step;
 * over: |A m / z|^2. False: nothing is seen. */
typedef struct moit_round_splat {
    double size[3], sphere[3][3], u[3], d[3], pixel[2], step[2][3], turned[2][3], over;
} moit_round_splat;
bool moit_round_splat_of(const moit_splat_raster *raster, const double at[3],
                         const double axis[3][3], moit_round_splat *round);

/* Real spherical harmonics, up to degree 3, in the order and with the signs of the reference;
 * how many there are. */
int moit_harmonics_at(int degree, const double direction[3], double value[16]);

/* Fills on_screen, whose room is there. */
moit_status moit_project_splats(const moit_splat_raster *raster, const moit_splats *splats,
                                const moit_run *run);

/* Pixels of a tile: columns [left, right) of rows [top, bottom). */
typedef struct moit_tile_pixels {
    int left, top, right, bottom;
} moit_tile_pixels;

/* What is called for every fragment that moit_draw_splats gives, in the order of each tile's
 * splats: `listed`, its place in raster->listed; (x, y), its pixel; at, its own place. Calls for
 * one place in `listed` follow one another on one thread. */
typedef void moit_splat_visitor(void *context, int64_t listed, const moit_screen_splat *splat,
                                int x, int y, float alpha, int64_t at);
moit_status moit_visit_splats(const moit_splat_raster *raster, int top, int bottom,
                              moit_splat_visitor *visit, void *context, const moit_run *run);

#endif
