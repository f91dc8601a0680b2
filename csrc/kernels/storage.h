// What render targets of 16 bits make of a number: half floats and unsigned normalised words.
//
// IEEE 754-2008 binary16, rounded to nearest, ties to even; words rounded half up, as OpenGL 4.5
// section 2.3.5 converts (its rounding is the implementation's choice).

// x as a half float holds it. Infinite from 65520 on, as half has no larger number; NaN stays NaN.
FN number rounded_to_half(real x) {
    const real least_step = K(5.9604644775390625e-8); // 2^-24, of half's subnormal numbers
    real step = max(leading_power(x) * K(0.0009765625), least_step); // 2^-10
    real rounded = nearest_integer(x / step) * step;
    real size = abs(x);
    real beyond = select(x > 0.0, K(1e30), K(-1e30)) * K(BY_PRECISION(1e30, 1e300));
    return select(size < K(65520.0), rounded, select(size == size, beyond, x));
}

// The word 0 .. 65535 that holds x of [0, 1]; what lies outside is clamped, NaN gives 0.
FN number unorm16_word(real x) {
    real wide = select(x > 0.0, min(x, K(1.0)), K(0.0)) * K(65535.0);
    real near = nearest_integer(wide);
    real apart = wide - near;
    return near + select(apart >= 0.5, K(1.0), K(0.0));
}

FN number unorm16_value(real word) { return word / K(65535.0); }
