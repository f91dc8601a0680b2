// Numbers without a fraction.

// The greatest integer that x in [0, 2^22) is not below.
FN number whole_below(real x) {
    real near = nearest_integer(x);
    return select(near > x, near - 1.0, near);
}
