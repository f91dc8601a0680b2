/* Depth to the range that a technique works in. */
#include "core/elementary.h"
#include "core/techniques/table.h"

#include <math.h>
#include <string.h>

/* Where steps of the warps would leave what the precision holds, or its normal numbers. */
static bool is_extreme(const moit_warp_map *map, moit_precision precision) {
    double most = precision == MOIT_FLOAT64 ? 1e300 : 1e30;
    if (map->warp == MOIT_WARP_LINEAR) {
        double span = map->far - map->near;
        return span > most || span < 1.0 / most;
    }
    return map->near < 1.0 / most || map->far > most || map->far / map->near > most;
}

moit_warp_steps moit_warp_steps_of(const moit_warp_map *map, moit_precision precision) {
    double extent = map->high - map->low;
    moit_warp_steps steps = {.near = map->near, .low = map->low, .high = map->high};
    if (map->warp == MOIT_WARP_NONE) return steps;
    if (!(map->near < map->far)) { /* the middle is as good as any */
        steps.kind = MOIT_STEPS_LEVEL;
        steps.low = map->low + 0.5 * extent;
    } else if (is_extreme(map, precision)) {
        steps.kind = MOIT_STEPS_EXTREME;
    } else if (map->warp == MOIT_WARP_LINEAR) {
        steps.kind = MOIT_STEPS_LINEAR;
        steps.scale = extent / (map->far - map->near);
    } else {
        steps.kind = MOIT_STEPS_LOG;
        steps.scale = -extent / moit_log(map->far / map->near);
        steps.inverse = 1.0 / map->near;
    }
    return steps;
}

moit_warp_steps moit_technique_warp(const moit_technique *technique, moit_precision precision,
                                    double near, double far) {
    if (!moit_facts_of(technique->kind).uses_warp)
        return (moit_warp_steps){.kind = MOIT_STEPS_NONE};
    moit_warp_map map = moit_warp_over(technique, near, far);
    return moit_warp_steps_of(&map, precision);
}

double moit_technique_max_alpha(const moit_technique *technique, moit_precision precision) {
    return moit_held_max_alpha(precision, technique->max_alpha);
}

static void warp_tile(const moit_job *job, moit_tile *tile, void *z) {
    int64_t first = tile->first_fragment, n = tile->fragments;
    const void *found = tile->z;
    if (job->depths) {
        moit_moments_warp_curve(job, tile);
        found = tile->curve_z;
        first = tile->first_pixel * job->depths;
        n = tile->pixels * job->depths;
    } else {
        moit_warp_tile(job, tile);
    }
    char *out = (char *)z + (size_t)first * job->scalar;
    if (job->technique->kind == MOIT_FRONT && job->technique->front.small_keys)
        moit_front_round_depth(job->fragments->precision, (int)n, found, out);
    else memcpy(out, found, (size_t)n * job->scalar);
}

moit_status moit_warped(const moit_fragments *fragments, const moit_technique *technique,
                        int64_t depths, const double *depth, void *z, const moit_run *run) {
    moit_job job = moit_job_of(fragments, technique, false, run);
    job.depths = depths;
    job.depth = depth;
    return moit_for_tiles(&job, warp_tile, z);
}
