// Depth in a technique's unit range.
//
//   WARP   one of these

#define WARP_NONE 0   // it is there already
#define WARP_LEVEL 1  // all depths are one: the middle is as good as any
#define WARP_LINEAR 2
#define WARP_LOG 3

uniform number warp_near;
uniform number warp_low;
uniform number warp_high;
uniform number warp_scale;
uniform number warp_inverse; // 1 / near

number warped(number depth) {
#if WARP == WARP_NONE
    return depth;
#elif WARP == WARP_LEVEL
    return warp_low;
#elif WARP == WARP_LINEAR
    return linear_warp(depth, warp_near, warp_low, warp_high, warp_scale);
#else
    return log_warp(depth, warp_near, warp_inverse, warp_low, warp_high, warp_scale);
#endif
}
