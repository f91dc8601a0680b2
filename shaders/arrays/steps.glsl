// Transmittance that falls in steps. A technique's file has, before it includes this,
//
//   STEPS       how many a pixel has
//   KEPT_STEPS  the array that holds them: of each pixel STEPS times a depth, as it is held, and
//               what is left of the light behind it
//   QUANTIZED   0 or 1: depth is held as a word of 16 bits

number held_depth(number depth) {
#if QUANTIZED
    return unorm16_word(warped(depth));
#else
    return warped(depth);
#endif
}

#if PASS == TRANSMITTANCE || PASS == CURVE || PASS == COMPOSITE || PASS == DRAW_SHADES
number step_depth[STEPS];
number step_through[STEPS];

void load_ray(uint p) {
    for (uint k = 0u; k < STEPS; ++k) {
        step_depth[k] = KEPT_STEPS[2u * (STEPS * p + k)];
        step_through[k] = KEPT_STEPS[2u * (STEPS * p + k) + 1u];
    }
}

number in_front(uint p, surface s) {
    number z = held_depth(s.depth);
    number through = K(1.0);
    for (uint k = 0u; k < STEPS; ++k)
        through = behind_step(z, step_depth[k], step_through[k], through);
    return through;
}
#endif
