#include "core/techniques.h"

const moit_technique_row moit_technique_rows[MOIT_KIND_COUNT] = {
    [MOIT_SORTED] = {.weigh = moit_sorted_weigh,
                     .curve = moit_sorted_curve,
                     .bounds = moit_sorted_bounds},
    [MOIT_ALPHA_BLEND] = {.weigh = moit_alpha_blend_weigh},
    [MOIT_WEIGHTED_SUM] = {.weigh = moit_weighted_sum_weigh},
    [MOIT_WEIGHTED_AVERAGE] = {.weigh = moit_weighted_average_weigh},
    [MOIT_WEIGHTED_BLENDED] = {.weigh = moit_weighted_blended_weigh},
    [MOIT_POWER_MOMENTS] = {.weigh = moit_power_weigh,
                            .curve = moit_power_curve,
                            .bounds = moit_power_bounds,
                            .uses_warp = true,
                            .reconstructs = true},
};

bool moit_has_curve(moit_kind kind) { return moit_technique_rows[kind].curve != NULL; }
bool moit_uses_warp(moit_kind kind) { return moit_technique_rows[kind].uses_warp; }
