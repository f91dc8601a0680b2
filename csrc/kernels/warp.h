// Depth to the range that a technique works in; ends are kept, whatever rounding makes of them.

// scale: the range's extent by that of depth.
FN number linear_warp(real depth, real near, real low, real high, real scale) {
    real z = low + (depth - near) * scale;
    return clamp(z, low, high);
}

// scale: minus the range's extent by ln(far / near); ln(depth / near) = -absorbance(1 - depth /
// near), which keeps the digits of depth - near.
FN number log_warp(real depth, real near, real inverse, real low, real high, real scale) {
    // opaque fragments may lie anywhere: not farther than numbers go
    real beyond = min(max(depth - near, K(0.0)) * inverse, K(BY_PRECISION(1e38, 1e308)));
    real z = low + absorbance(-beyond) * scale;
    return clamp(z, low, high);
}
