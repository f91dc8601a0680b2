/* Backwards through the warp of depth. */
#include "core/elementary.h"
#include "core/adjoints/adjoints.h"
#include "core/adjoints/tiles.h"
#include "core/techniques/moments.h"

#include <math.h>

double moit_warp_rise(const moit_warp_map *map) {
    if (map->warp == MOIT_WARP_NONE) return 1.0;
    if (!(map->near < map->far)) return 0.0;
    double extent = map->high - map->low;
    return map->warp == MOIT_WARP_LOG ? extent / moit_log(map->far / map->near)
                                      : extent / (map->far - map->near);
}

double moit_warp_slope(const moit_warp_map *map, double rise, double depth) {
    if (map->warp == MOIT_WARP_NONE) return rise;
    if (depth < map->near || depth > map->far) return 0.0; /* z is an end's */
    return map->warp == MOIT_WARP_LOG ? rise / depth : rise;
}

/* The first fragment of pixel p at that depth. */
static int at_depth(const moit_tile *tile, int p, double depth) {
    const double *depths = tile->depth;
    for (int i = tile->offsets[p]; i < tile->offsets[p + 1]; ++i)
        if (depths[i] == depth) return i;
    return -1;
}

typedef struct {
    double near, far;
} by_ends;

/* depth: of what lies at z, of which that beyond the ends stays there; NULL: what is at an end may
 * be beyond it. */
static void add_ends(const moit_warp_map *map, const double *depth, int first, int end,
                     const double *z, const double *by_z, by_ends *by) {
    for (int i = first; i < end; ++i) {
        if (depth ? depth[i] < map->near || depth[i] > map->far
                  : z[i] == map->low || z[i] == map->high)
            continue;
        double share = (z[i] - map->low) / (map->high - map->low);
        by->near -= by_z[i] * (1.0 - share);
        by->far -= by_z[i] * share;
    }
}

/* The ends of a pixel's own range are fragments, the first of those that are there: z, so far from
 * them in shares of the range, falls as either moves away. By z, before it is by depth: either part
 * alone may be more than a number holds. */
static void pull_ends(const moit_job *job, const moit_warp_map *map, const moit_tile *tile, int p,
                      const moit_adjoint *by) {
    by_ends ends = {0.0, 0.0};
    double *by_z = by->work[1];
    if (map->warp == MOIT_WARP_NONE || !(map->near < map->far)) return;
    add_ends(map, tile->depth, tile->offsets[p], tile->offsets[p + 1], tile->z, by_z, &ends);
    if (job->depths)
        add_ends(map, NULL, tile->curve_offsets[p], tile->curve_offsets[p + 1], tile->curve_z,
                 by->curve_z, &ends);
    int nearest = at_depth(tile, p, map->near), farthest = at_depth(tile, p, map->far);
    if (nearest >= 0) by_z[nearest] += ends.near;
    if (farthest >= 0) by_z[farthest] += ends.far;
}

/* Where the pixel's ends are in the image's range, whose warp rises as the image's does. */
void moit_adjoint_of_unit(const moit_job *job, const moit_tile *tile, int p, double by_logarithm,
                          const moit_adjoint *by) {
    const moit_warp_map *image = &job->warp;
    if (!job->technique->range_per_pixel || image->warp == MOIT_WARP_NONE) return;
    moit_warp_map own = moit_pixel_warp(job, tile, p);
    double ends[2] = {own.near, own.far}, z[2 + MOIT_PADDING];
    int at[2] = {at_depth(tile, p, own.near), at_depth(tile, p, own.far)};
    job->precise->warp(2, ends, image, z);
    if (!(z[0] < z[1])) return;
    for (int k = 0; k < 2; ++k)
        if (at[k] >= 0)
            by->depth[at[k]] += (k ? by_logarithm : -by_logarithm) / (z[1] - z[0])
                                * moit_warp_slope(image, moit_warp_rise(image), ends[k]);
}

/* Of places within an extent, in by_z: adds to by_ends what these move them by. */
static void add_own_ends(const double *extent, int first, int end, const double *z,
                         const double *by_z, by_ends *by) {
    double length = extent[1] - extent[0];
    for (int i = first; i < end; ++i) {
        by->near += by_z[i] * (z[i] - 1.0) / length;
        by->far -= by_z[i] * (1.0 + z[i]) / length;
    }
}

/* From places within pixels' own extents, which words hold, to those in the image's range: ends are
 * fragments, the first of those there, and move as if words held them as they are. */
static void leave_extents(const moit_job *job, const moit_tile *tile, const moit_adjoint *by) {
    const double *extents = moit_extents(job->technique, tile), *z = tile->z;
    double *by_z = by->work[1];
    for (int p = 0; p < tile->pixels; ++p) {
        int first = tile->offsets[p], end = tile->offsets[p + 1], nearest = first, farthest = first;
        const double *extent = extents + 2 * p;
        by_ends ends = {0.0, 0.0};
        if (first == end) continue;
        add_own_ends(extent, first, end, z, by_z, &ends);
        for (int i = tile->curve_offsets[p]; job->depths && i < tile->curve_offsets[p + 1]; ++i)
            if (fabs(((const double *)tile->curve_z)[i]) < 1.0)
                add_own_ends(extent, i, i + 1, tile->curve_z, by->curve_z, &ends);
        for (int i = first; i < end; ++i) {
            by_z[i] *= 2.0 / (extent[1] - extent[0]);
            if (z[i] < z[nearest]) nearest = i;
            if (z[i] > z[farthest]) farthest = i;
        }
        by_z[nearest] += ends.near;
        by_z[farthest] += ends.far;
    }
}

/* An image's range is given and stays. */
void moit_adjoint_of_warp(const moit_job *job, const moit_tile *tile, const moit_adjoint *by) {
    const double *depth = tile->depth, *by_z = by->work[1];
    bool in_words = moit_extents_are_words(job->technique);
    bool own = job->technique->range_per_pixel && !in_words;
    moit_warp_map map = job->warp;
    if (in_words) leave_extents(job, tile, by);
    double rise = moit_warp_rise(&map);
    if (!own)
        moit_tile_adjoints_of(job->run->isa)
            ->pull_warp(tile->fragments, &map, rise, depth, by_z, by->depth);
    for (int p = 0; own && p < tile->pixels; ++p) {
        map = moit_pixel_warp(job, tile, p);
        rise = moit_warp_rise(&map);
        pull_ends(job, &map, tile, p, by);
        for (int i = tile->offsets[p]; i < tile->offsets[p + 1]; ++i)
            by->depth[i] += by_z[i] * moit_warp_slope(&map, rise, depth[i]);
    }
}
