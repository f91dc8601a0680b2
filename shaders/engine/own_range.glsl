// Each pixel's own range of depth in place of the camera's: a pass before all others finds the
// least and the greatest depth of its fragments, which become z = -1 and 1.
#include "engine/common.glsl"

// Of all fragments the greatest: -depth, depth.
struct extents { vec2 extent; };

extents extents_of(float depth) {
    extents o;
    o.extent = vec2(-depth, depth);
    return o;
}

// ln(depth / near); of depths close together by 2 artanh, as their quotient loses digits.
float logarithm_above(float near, float depth) {
    float s = (depth - near) / (depth + near), q = s * s;
    float close = s * (q * (q * (q * 0.29 + 0.4) + 0.66666667) + 2.0);
    float apart = log2(depth / near) * 0.69314718;
    return s < 0.14 ? close : apart;
}

// Where all fragments have one depth z is 0.
float warped_within(extents e, float depth) {
    float near = -e.extent.x, far = e.extent.y;
    float above = WARP_LOG == 1 ? logarithm_above(near, depth) : depth - near;
    float whole = WARP_LOG == 1 ? logarithm_above(near, far) : far - near;
    float z = clamp(2.0 * (above / whole) - 1.0, -1.0, 1.0);
    return near < far ? z : 0.0;
}

// Half of how long a pixel's range is of the camera's, from z = -1 to 1 as `warped` has that.
float unit_of(extents e) {
    float near = -e.extent.x, far = e.extent.y;
    float whole = WARP_LOG == 1 ? 1.44269504 * logarithm_above(near, far) : far - near;
    return clamp(0.5 * WARP_SCALE * whole, 1e-12, 1.0);
}
