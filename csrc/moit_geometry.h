/* What gives fragments: triangles, splats, points, lines and volumes, as a camera sees them. */
#ifndef MOIT_GEOMETRY_H
#define MOIT_GEOMETRY_H

#include "moit.h"

#ifdef __cplusplus
extern "C" {
#endif

/* ---- Meshes ---------------------------------------------------------------------------------- */

/* Triangles, drawn in their order. */
typedef struct moit_mesh {
    int64_t vertices, triangles;
    const float *position;      /* (vertices, 3) finite */
    const float *normal;        /* (vertices, 3) of any length; NULL: facets have their own */
    const float *color;         /* (vertices, 3) finite, not multiplied by alpha */
    const float *alpha;         /* (vertices) in [0, 1] */
    const int32_t *corners;     /* (triangles, 3), in [0, vertices) */
    const float *uv;            /* (vertices, 2) finite: places on images; NULL: there are none */
    const int32_t *material_of; /* (triangles), in [0, materials), -1: none; of no use without uv */
    const struct moit_material *materials;
} moit_mesh;

/* What triangles wear beside colour and alpha of their vertices, which an image multiplies: rows
 * of texels from its top, of (0, 0) to (1, 1) in uv. */
typedef struct moit_material {
    const float *texels;           /* (.., 4) red, green, blue, not multiplied by alpha; of MIPMAP
                                    * all levels (moit_fill_levels) */
    int32_t first;                 /* texel, where others draw what moit_textured_triangles lists */
    int width, height;             /* each in [1, MOST_SIDE] */
    int filtering, wrap_u, wrap_v; /* of kernels/options.h */
    bool transparent;              /* the image has alpha below 1 somewhere */
    bool masked;                   /* what has alpha below cutoff is not there, the rest opaque */
    float cutoff;
    bool lit;     /* else its colour is what is seen */
    bool painted; /* else the image multiplies alpha alone */
    bool listed;  /* even what is opaque is listed as fragments, and hides nothing */
} moit_material;

/* How many texels there are in all levels of an image of such a size. */
int64_t moit_level_texels(int width, int height);

/* The levels that follow the first, width height texels that texels begins with: each has half the
 * columns and rows of the one before, rounded down, and at least 1. Their texels are means by area,
 * in which colour counts by alpha; where that is 0, evenly. */
void moit_fill_levels(int width, int height, float *texels);

/* Light from far away, on both sides of surfaces: where it travels, as the eye sees it (right, up,
 * away), of length 1, and its colour, 1 as bright as the light that there is without any. */
enum { MOIT_MOST_LIGHTS = MOST_LIGHTS };
typedef struct moit_lights {
    int count; /* 0: one, white, from the upper left behind the eye */
    double direction[MOIT_MOST_LIGHTS][3], color[MOIT_MOST_LIGHTS][3];
} moit_lights;

/* A point p is at x = right . (p - eye), y = up . (p - eye), z = forward . (p - eye), and on a
 * picture that spans [-1, 1] to the right and up at scale[0] x / z, scale[1] y / z. */
typedef struct moit_camera {
    double eye[3], right[3], up[3], forward[3]; /* the last three orthogonal, of length 1 */
    double scale[2];                            /* positive */
    double near, far;                           /* of z; 0 < near < far */
    moit_lights lights;
} moit_camera;

/* Pictures have at most so many columns and rows. */
enum { MOIT_MOST_SIDE = MOST_SIDE };

typedef struct moit_raster moit_raster;

/* A fragment for each pixel whose middle a triangle covers (of an edge between two triangles, one
 * has what lies on it: the top-left rule), with its distance z, in the order of triangles; of
 * opaque triangles (alpha 1 at all corners) the nearest alone, before all others, which must not be
 * behind it. offsets (width height + 1) get where each pixel's fragments go.
 *
 * moit_begin_raster makes *raster, with which moit_draw writes depth, alpha
 * (offsets[width height]) and color (offsets[width height], 3); moit_end_raster frees it (NULL
 * too). reached (offsets[width height], lights): the share of each light that comes to each
 * fragment; NULL: all of it. The mesh must not change meanwhile. With offsets NULL nothing is
 * counted, and the raster knows its screen triangles only. */
moit_status moit_begin_raster(const moit_mesh *mesh, const moit_camera *camera, int width,
                              int height, int64_t *offsets, moit_raster **raster,
                              const moit_run *run);
moit_status moit_draw(const moit_raster *raster, const double *reached, float *depth, float *alpha,
                      float *color, const moit_run *run);
void moit_end_raster(moit_raster *raster);

/* The same by areas: a part for each pixel that a triangle touches (z, colour and alpha are those
 * of the middle of what it covers there), also of what is opaque or hidden, in the order of
 * triangles. moit_draw_parts also says which share of the pixel it is, and of which triangle of the
 * mesh, counted from 0, or where the screen sees that one's corners turn the other way
 * -1 - triangle.
 *
 * moit_join_parts makes fragments of them, in place: parts of a pixel that share a corner of the
 * mesh (by position) and turn the same way, or share an edge on two sides of which they lie, are
 * one surface, whose shares add up. Of these alpha counts by the share; of opaque fragments the
 * nearest alone is left, the first, and none behind it. offsets become those of fragments. which
 * (parts): the fragment that each part went to, -1: none. */
moit_status moit_begin_parts(const moit_mesh *mesh, const moit_camera *camera, int width,
                             int height, int64_t *offsets, moit_raster **raster,
                             const moit_run *run);
moit_status moit_draw_parts(const moit_raster *raster, const double *reached, float *depth,
                            float *alpha, float *color, double *share, int32_t *source,
                            const moit_run *run);
moit_status moit_join_parts(const moit_mesh *mesh, int64_t pixels, int64_t *offsets,
                            const double *share, const int32_t *source, float *depth, float *alpha,
                            float *color, int64_t *which);

/* Screen coordinates are whole numbers of 1/256 pixel, as GPUs have them. */
enum { MOIT_SUBPIXELS = 256 };

/* A triangle as it is drawn: clipped to what is in front of the eye and not too far aside, its
 * corners moved to the nearest 1/256 pixel, x to the right, y down, its area positive. What draws
 * these as csrc/core/stages/raster.h does, gets the fragments of moit_draw. */
typedef struct moit_screen_triangle {
    double inverse_z[3];                        /* 1 / z of the corners */
    double color[3][3], alpha[3], normal[3][3]; /* normals as the eye sees them: right, up, away */
    int32_t x[3], y[3];
    int32_t opaque; /* 1: alpha is 1 at all corners of the mesh's triangle, else 0 */
    int32_t source; /* the mesh's triangle; clipping leaves up to six of one */
} moit_screen_triangle;

/* How many there are, and all of them, in the order of triangles: out (moit_screen_triangle_count).
 */
int64_t moit_screen_triangle_count(const moit_raster *raster);
moit_status moit_screen_triangles(const moit_raster *raster, moit_screen_triangle *out,
                                  const moit_run *run);

/* The same of a mesh with uv, of which each triangle has a material. */
typedef struct moit_textured_triangle {
    moit_screen_triangle triangle; /* opaque: 1 for masked ones, too */
    double u[3], v[3], cutoff;     /* of the corners; 0: it is not masked */
    int32_t first, width, height, filtering, wrap_u, wrap_v, lit, masked;
} moit_textured_triangle;
moit_status moit_textured_triangles(const moit_raster *raster, moit_textured_triangle *out,
                                    const moit_run *run);

/* ---- Splats ---------------------------------------------------------------------------------- */

/* Ellipsoids whose opacity falls off as a Gaussian does. */
typedef struct moit_splats {
    int64_t count;
    const float *mean;      /* (count, 3) finite */
    const float *scale;     /* (count, 3) deviations along the axes, finite and not negative */
    const float *rotation;  /* (count, 4) w, x, y, z of a quaternion of length 1: from the axes */
    const float *opacity;   /* (count) in [0, 1], in the middle */
    const float *harmonics; /* (count, harmonics_of_degree, 3): coefficients of colour as it is seen
                             * from each side, less 1/2 */
    int degree;             /* in [0, MOIT_MOST_DEGREE] */
} moit_splats;
enum { MOIT_MOST_DEGREE = 3 };

/* How splats become fragments. */
typedef enum moit_splatting {
    /* as ellipses on the screen, at the distance of their middles; no fragment behind what lets
     * less than 1e-4 through: as 3D Gaussian Splatting's rasteriser has it */
    MOIT_PROJECTED,
    MOIT_ALONG_RAYS,    /* by the most of their density along each ray, and there */
    MOIT_ALL_PROJECTED, /* as the first, and all of them: what does not sort knows no end */
    /* as these two, with opacities as much less as what is added to variances makes ellipses
     * larger: as files that say so were trained to be seen */
    MOIT_FILTERED = 4 | MOIT_PROJECTED,
    MOIT_ALL_FILTERED = 4 | MOIT_ALL_PROJECTED
} moit_splatting;

typedef struct moit_splat_raster moit_splat_raster;

/* The fragments of a picture, in the order of splats: begin counts them, draw gives those of rows
 * [top, bottom), as often as one likes, and end lets go of the raster. offsets (width height + 1),
 * of the whole picture, stays until then; the splats need not. range: how far the nearest and the
 * farthest fragments are; where there is none from infinity to below it. After a failure *raster is
 * NULL. deviation (N): of the normal distribution that each has along its ray, in depth; or NULL,
 * as it is of MOIT_PROJECTED. */
moit_status moit_begin_splats(const moit_splats *splats, moit_splatting splatting,
                              const moit_camera *camera, int width, int height, int64_t *offsets,
                              float range[2], moit_splat_raster **raster, const moit_run *run);
moit_status moit_draw_splats(const moit_splat_raster *raster, int top, int bottom, float *depth,
                             float *alpha, float *color, float *deviation, const moit_run *run);
void moit_end_splats(moit_splat_raster *raster);

/* A splat on the screen. Of a pixel so far from its middle (dx to the right, dy down), in
 * deviations squared: square (dx^2, dx dy, dy^2) over along (1, dx, dy, dx^2, dx dy, dy^2), and its
 * distance from the eye: depth (1, dx, dy) over the same. Projected: along is 1, and depth no
 * more than its first. What draws these as csrc/core/stages/splats.h does, gets the fragments of
 * moit_draw_splats. */
typedef struct moit_screen_splat {
    double x, y;   /* its middle, in pixels */
    double spread; /* along rays: the deviation of its density along those of its middle */
    float square[3], along[6], depth[3];
    float opacity, color[3];
    float nearest;                    /* what is nearer than that is not seen */
    float z;                          /* of its middle */
    int32_t across[2], down[2];       /* the first and last pixels where it may be seen */
    int32_t left, top, right, bottom; /* tiles: [left, right), [top, bottom); none: not seen */
    int32_t flat;                     /* 1: projected */
    int32_t index;                    /* among the splats */
    int32_t opaque;                   /* 0, as no splat is; what triangles have, too */
} moit_screen_splat;

/* Tiles are squares of pixels, as the reference rasteriser of 3D Gaussian Splatting has them:
 * which of them a splat is drawn in decides what of its rim is seen. */
enum { MOIT_SPLAT_TILE = SPLAT_TILE };

/* What a device needs that draws splats itself: those on the screen (count), in their order, and
 * of MOIT_PROJECTED ones which are in each tile of the picture, front to back: of tile t the
 * numbers front_to_back[first[t]] to front_to_back[first[t + 1]]. moit_let_go_of_screen_splats
 * frees it, after a failure too. */
typedef struct moit_screen_splats {
    moit_screen_splat *splats; /* (count) */
    int64_t count;
    int64_t *first;         /* (tiles + 1) */
    int32_t *front_to_back; /* indices among `splats`; or NULL */
    int64_t tiles;
} moit_screen_splats;

moit_status moit_find_screen_splats(const moit_splats *splats, moit_splatting splatting,
                                    const moit_camera *camera, int width, int height,
                                    moit_screen_splats *found, const moit_run *run);
void moit_let_go_of_screen_splats(moit_screen_splats *found);

/* ---- Points and lines ------------------------------------------------------------------------ */

/* Strokes are what a disc or a ball leaves that moves along straight lines from node to node; one
 * of a single node is a point. Sizes, colours and opacities change linearly between nodes. */
typedef struct moit_strokes {
    int64_t count, nodes;
    const int64_t *first; /* (count + 1): nodes of stroke i from first[i] to first[i + 1]; rising */
    const double *position; /* (nodes, 3) finite */
    const float *radius;    /* (nodes) not negative */
    const float *color;     /* (nodes, 3) finite, not negative, not multiplied by alpha */
    const float *alpha;     /* (nodes) in [0, 1] */
} moit_strokes;

/* How strokes become fragments. */
typedef struct moit_stroking {
    bool solid;  /* balls, of which the side to the eye is seen; else discs that face the picture */
    bool pixels; /* radii are pixels of the picture, and depth is that of the middles; else units */
    bool lit;    /* light falls on what is solid; else its colour is what is seen */
    int samples; /* of a pixel, by which its coverage is told: 1, its middle, or MOIT_SAMPLES */
} moit_stroking;
enum { MOIT_SAMPLES = 64 };

typedef struct moit_stroke_raster moit_stroke_raster;

/* The fragments of a picture, in the order of strokes, as moit_begin_splats, moit_draw_splats and
 * moit_end_splats have it. A fragment's alpha counts by the share of samples that are covered.
 * Parts of a stroke that follow one another and meet in a pixel, or overlap there in depth by
 * their own thickness, are one fragment; a stroke whose last node is where its first is, is closed.
 * lights are those of the camera; reached (fragments of these rows, lights) as moit_draw. */
moit_status moit_begin_strokes(const moit_strokes *strokes, const moit_stroking *how,
                               const moit_camera *camera, int width, int height, int64_t *offsets,
                               float range[2], moit_stroke_raster **raster, const moit_run *run);
moit_status moit_draw_strokes(const moit_stroke_raster *raster, int top, int bottom,
                              const double *reached, float *depth, float *alpha, float *color,
                              const moit_run *run);
void moit_end_strokes(moit_stroke_raster *raster);

/* A part of a stroke on the screen, from node to node; of a point both are one. All of it lies
 * between two circles and the tangents to both, in pixels; a flat one is just that. What draws
 * these as csrc/core/stroke_layers.c and csrc/kernels/strokes.h do, gets the fragments of
 * moit_draw_strokes. */
typedef struct moit_screen_stroke {
    double x[2], y[2], radius[2]; /* the circles */
    double along[2], apart;       /* the direction from one to the other, and how far that is */
    double lean, upright;         /* of the tangents to them */
    double at[6], size[2];        /* nodes as the eye sees them (right, up, away), their radii */
    double outside[2];            /* of what is solid: |at|^2 - size^2, */
    double over, per_over;        /* and of all balls between its ends what rays are put into */
    double start, beyond;
    float color[6], opacity[2];
    float alpha;                      /* the most that its stroke has anywhere */
    int32_t holder;                   /* the circle that holds the other one, or -1 */
    int32_t everywhere;               /* 1: it is so near that it may be seen anywhere */
    int32_t left, top, right, bottom; /* pixels: [left, right), [top, bottom); none: not seen */
    int32_t stroke, place;            /* places follow one another where parts of a stroke do */
    int32_t opens, closes;            /* 1: the first, the last part of a closed stroke */
    int32_t other;                    /* where among the parts the other one of these is, or -1 */
    int32_t how;                      /* STROKE_SOLID, STROKE_PIXELS, STROKE_LIT, STROKE_SAMPLED */
    int32_t opaque;                   /* 0: what triangles have, too */
} moit_screen_stroke;

/* What a device needs that draws strokes itself: the parts that are seen, in their order. *parts
 * (*count) is the caller's to free. */
moit_status moit_find_screen_strokes(const moit_strokes *strokes, const moit_stroking *how,
                                     const moit_camera *camera, int width, int height,
                                     moit_screen_stroke **parts, int64_t *count);

/* ---- Volumes on grids ------------------------------------------------------------------------ */

/* What absorbs and gives light, at points of a regular grid, linear between them. */
typedef struct moit_grid {
    int size[3]; /* points along each axis, at least 2 */
    double origin[3],
        spacing[3];      /* where the first point is, and how far apart they are; positive */
    int channels;        /* 1: a number, which the table says the meaning of; 4: as rows */
    const float *values; /* (size[0], size[1], size[2], channels) finite */
    int rows;            /* at least 1; of the table, at equal distances from low to high */
    double low, high;    /* low below high */
    const float *table;  /* (rows, 4) red, green, blue, and absorbance of a unit of length,
                                   * none negative */
} moit_grid;

/* The fragments of rows [top, bottom) of a picture, front to back: what a ray through the middle
 * of each pixel meets of the volume between depths that are whole multiples of `step`, where it
 * meets something. Their absorbance is the integral (Simpson's rule in each cell, exact for what
 * is linear between points of the grid), their colour the mean of what is seen of it from the
 * front. offsets: (width (bottom - top) + 1). *numbers: (their last, 6) depth, back, alpha, red,
 * green, blue, for the caller to free. */
moit_status moit_march_grid(const moit_grid *grid, const moit_camera *camera, double step,
                            int width, int height, int top, int bottom, int64_t *offsets,
                            float **numbers, const moit_run *run);

#ifdef __cplusplus
}
#endif

#endif
