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

// A sum held in a half float after one more surface was blended into it, as a render target would:
// rounded every time. Beyond the largest half it stays at that.
FN number half_sum(real held, real added) {
    real sum = clamp(held + added, K(-65504.0), K(65504.0));
    return rounded_to_half(sum);
}

// x as a float holds it, for |x| from 2^-126 to below 2^128.
FN number rounded_to_single(real x) {
    real step = leading_power(x) * K(1.1920928955078125e-7); // 2^-23
    real rounded = select(step > 0.0, nearest_integer(x / step) * step, K(0.0));
    return select(K(BY_PRECISION(0.0, 1.0)) > 0.0, rounded, x);
}

// The word 0 .. 65535 that holds x of [0, 1]; what lies outside is clamped, NaN gives 0. Which side
// of a half 65535 x lies on is decided exactly: 65536 x is, and x is what it is too much by.
FN number unorm16_word(real x) {
    real inside = within(x, K(1.0));
    real wide = inside * 65536.0;
    real near = nearest_integer(wide - inside);
    real apart = wide - near;
    real word = near + select(apart - 0.5 >= inside, K(1.0), K(0.0));
    return word - select(apart + 0.5 < inside, K(1.0), K(0.0));
}

// The same of 8 bits: 255 x = 256 x - x.
FN number unorm8_byte(real x) {
    real inside = within(x, K(1.0));
    real wide = inside * 256.0;
    real near = nearest_integer(wide - inside);
    real apart = wide - near;
    real byte = near + select(apart - 0.5 >= inside, K(1.0), K(0.0));
    return byte - select(apart + 0.5 < inside, K(1.0), K(0.0));
}

FN number unorm8_value(real byte) { return byte / K(255.0); }

FN number unorm16_value(real word) { return word / K(65535.0); }
