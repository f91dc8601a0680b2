// Depth in a technique's unit range.
#include "kernels/options.h"

uniform int warp; // STEPS_NONE to STEPS_LOG

uniform number warp_near;
uniform number warp_low;
uniform number warp_high;
uniform number warp_scale;
uniform number warp_inverse; // 1 / near

number warped(number depth) {
    if (warp == STEPS_NONE) return depth;
    if (warp == STEPS_LEVEL) return warp_low;
    if (warp == STEPS_LINEAR) return linear_warp(depth, warp_near, warp_low, warp_high, warp_scale);
    return log_warp(depth, warp_near, warp_inverse, warp_low, warp_high, warp_scale);
}
