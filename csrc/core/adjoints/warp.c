/* Backwards through the warp of depth. */
#include "core/adjoints/adjoints.h"
#include "core/techniques/moments.h"

#include <math.h>

/* How z changes with depth where it is warped so, and with the ends of the range. */
typedef struct {
    double depth, near, far;
} warp_slopes;

static warp_slopes slopes_at(const moit_warp_map *map, double depth) {
    if (map->warp == MOIT_WARP_NONE) return (warp_slopes){1.0, 0.0, 0.0};
    warp_slopes s = {0};
    if (!(map->near < map->far) || depth < map->near || depth > map->far) return s;
    double extent = map->high - map->low;
    if (map->warp == MOIT_WARP_LINEAR) {
        double span = map->far - map->near, u = (depth - map->near) / span;
        s.depth = extent / span;
        s.near = -(1.0 - u) * s.depth;
        s.far = -u * s.depth;
        return s;
    }
    double span = log(map->far / map->near), u = log1p((depth - map->near) / map->near) / span;
    s.depth = extent / (span * depth);
    s.near = -(1.0 - u) * extent / (span * map->near);
    s.far = -u * extent / (span * map->far);
    return s;
}

/* The first fragment of pixel p at that depth. */
static int at_depth(const moit_tile *tile, int p, double depth) {
    const double *depths = tile->depth;
    for (int i = tile->offsets[p]; i < tile->offsets[p + 1]; ++i)
        if (depths[i] == depth) return i;
    return -1;
}

/* An image's range is given and stays; of a pixel's own both ends are fragments, the first of those
 * that are there. */
void moit_adjoint_of_warp(const moit_job *job, const moit_tile *tile, const double *by_z,
                          const moit_adjoint *by) {
    const double *depth = tile->depth;
    bool own = job->technique->range_per_pixel;
    for (int p = 0; p < tile->pixels; ++p) {
        moit_warp_map map = own ? moit_pixel_warp(job, tile, p) : job->warp;
        double by_near = 0.0, by_far = 0.0;
        for (int i = tile->offsets[p]; i < tile->offsets[p + 1]; ++i) {
            warp_slopes s = slopes_at(&map, depth[i]);
            by->depth[i] += by_z[i] * s.depth;
            by_near += by_z[i] * s.near;
            by_far += by_z[i] * s.far;
        }
        int nearest = own ? at_depth(tile, p, map.near) : -1;
        int farthest = own ? at_depth(tile, p, map.far) : -1;
        if (nearest >= 0) by->depth[nearest] += by_near;
        if (farthest >= 0) by->depth[farthest] += by_far;
    }
}
