// Depth in a technique's unit range.

uniform uint warp; // one of these
#define WARP_NONE 0u   // it is there already
#define WARP_LEVEL 1u  // all depths are one: the middle is as good as any
#define WARP_LINEAR 2u
#define WARP_LOG 3u

uniform number warp_near;
uniform number warp_low;
uniform number warp_high;
uniform number warp_scale;
uniform number warp_inverse; // 1 / near

number warped(number depth) {
    if (warp == WARP_NONE) return depth;
    if (warp == WARP_LEVEL) return warp_low;
    if (warp == WARP_LINEAR) return linear_warp(depth, warp_near, warp_low, warp_high, warp_scale);
    return log_warp(depth, warp_near, warp_inverse, warp_low, warp_high, warp_scale);
}
