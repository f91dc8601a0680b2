/* Backwards through the warp of depth. */
#include "core/adjoints/adjoints.h"
#include "core/techniques/moments.h"

#include <math.h>

/* How fast z rises: this, by depth itself where it is by logarithms; 0 where there is but one z. */
static double rise_of(const moit_warp_map *map) {
    if (map->warp == MOIT_WARP_NONE) return 1.0;
    if (!(map->near < map->far)) return 0.0;
    double extent = map->high - map->low;
    return map->warp == MOIT_WARP_LOG ? extent / log(map->far / map->near)
                                      : extent / (map->far - map->near);
}

static double slope_at(const moit_warp_map *map, double rise, double depth) {
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

/* The ends of a pixel's own range are fragments, the first of those that are there: z, so far from
 * them in shares of the range, falls as either moves away. */
static void pull_ends(const moit_warp_map *map, const moit_tile *tile, int p, double rise,
                      const double *by_z, double *by_depth) {
    double by_near = 0.0, by_far = 0.0;
    if (map->warp == MOIT_WARP_NONE || !(map->near < map->far)) return;
    for (int i = tile->offsets[p]; i < tile->offsets[p + 1]; ++i) {
        double share = (((const double *)tile->z)[i] - map->low) / (map->high - map->low);
        by_near -= by_z[i] * (1.0 - share);
        by_far -= by_z[i] * share;
    }
    int nearest = at_depth(tile, p, map->near), farthest = at_depth(tile, p, map->far);
    if (nearest >= 0) by_depth[nearest] += by_near * slope_at(map, rise, map->near);
    if (farthest >= 0) by_depth[farthest] += by_far * slope_at(map, rise, map->far);
}

/* An image's range is given and stays. */
void moit_adjoint_of_warp(const moit_job *job, const moit_tile *tile, const double *by_z,
                          const moit_adjoint *by) {
    const double *depth = tile->depth;
    bool own = job->technique->range_per_pixel;
    moit_warp_map map = job->warp;
    double rise = rise_of(&map);
    for (int i = 0; !own && i < tile->fragments; ++i)
        by->depth[i] += by_z[i] * slope_at(&map, rise, depth[i]);
    for (int p = 0; own && p < tile->pixels; ++p) {
        map = moit_pixel_warp(job, tile, p);
        rise = rise_of(&map);
        for (int i = tile->offsets[p]; i < tile->offsets[p + 1]; ++i)
            by->depth[i] += by_z[i] * slope_at(&map, rise, depth[i]);
        pull_ends(&map, tile, p, rise, by_z, by->depth);
    }
}
