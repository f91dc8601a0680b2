/* Stages of weighted blending in its published targets: lanes are pixels (words.h). */

#include "kernels/weighted_targets.h"

static void revealage_stage(int pixels, const int32_t *offsets, const void *alpha, double *total) {
    for (int p = 0; p < pixels; p += LANES) {
        pixel_lanes r = pixel_lanes_from(p, pixels, offsets);
        real byte = K(255.0);
        for (int i = 0; i < r.most; ++i)
            byte = select(r.count > i, dimmed_byte(byte, fragment_of(&r, alpha, 1, i)), byte);
        for (int lane = 0; lane < LANES && p + lane < pixels; ++lane)
            total[p + lane] = (double)byte[lane] / 255.0;
    }
}

FN void accumulate(const int coloured, int pixels, const int32_t *offsets, const SCALAR *alpha,
                   const SCALAR *emission, const SCALAR *weight, const SCALAR *color, double *sum) {
    for (int p = 0; p < pixels; p += LANES) {
        pixel_lanes r = pixel_lanes_from(p, pixels, offsets);
        accumulation held = {K(0.0), K(0.0), K(0.0), K(0.0)};
        for (int i = 0; i < r.most; ++i) {
            truth there = r.count > i;
            real w = fragment_of(&r, weight, 1, i);
            accumulation more = held;
            more.weight = fragment_of(&r, alpha, 1, i) * w;
            if (coloured) {
                real emitted = fragment_of(&r, emission, 1, i) * w;
                more.red = emitted * fragment_of(&r, color, 3, i);
                more.green = emitted * fragment_of(&r, color + 1, 3, i);
                more.blue = emitted * fragment_of(&r, color + 2, 3, i);
            }
            accumulation next = accumulated(held, more);
            held.red = select(there, next.red, held.red);
            held.green = select(there, next.green, held.green);
            held.blue = select(there, next.blue, held.blue);
            held.weight = select(there, next.weight, held.weight);
        }
        for (int lane = 0; lane < LANES && p + lane < pixels; ++lane) {
            double *out = sum + 4 * (p + lane);
            out[0] = (double)held.red[lane];
            out[1] = (double)held.green[lane];
            out[2] = (double)held.blue[lane];
            out[3] = (double)held.weight[lane];
        }
    }
}

static void accumulation_stage(int pixels, const int32_t *offsets, const void *alpha,
                               const void *emission, const void *weight, const void *color,
                               double *sum) {
    if (color) accumulate(1, pixels, offsets, alpha, emission, weight, color, sum);
    else accumulate(0, pixels, offsets, alpha, NULL, weight, NULL, sum);
}
