// The render targets of weighted blended transparency as they are published: accumulation in four
// half floats, revealage in a byte, both rounded at every fragment.
//
// McGuire and Bavoil, "Weighted Blended Order-Independent Transparency", JCGT 2(2), 2013, section 4
// and its listing: targets RGBA16F, blended ONE, ONE, and R8, blended ZERO, ONE_MINUS_SRC_COLOR.

// Sums of color times weight and opacity, and of weight times opacity.
STRUCT(accumulation) { number red, green, blue, weight; };

FN accumulation accumulated(accumulation before, accumulation more) {
    accumulation after;
    after.red = half_sum(before.red, more.red);
    after.green = half_sum(before.green, more.green);
    after.blue = half_sum(before.blue, more.blue);
    after.weight = half_sum(before.weight, more.weight);
    return after;
}

// The byte 0 .. 255 behind a fragment more: what a pixel lets through, 255 where it is empty.
FN number dimmed_byte(real before, real alpha) {
    real through = unorm8_value(before) * (1.0 - alpha);
    return unorm8_byte(through);
}
