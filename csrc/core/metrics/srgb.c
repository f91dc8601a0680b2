/* The encoding of sRGB, IEC 61966-2-1. */
#include "core/metrics/metrics.h"

#define SCALAR double
#define LANES MOIT_SRGB_LANES
#include "kernels/dialect.h"
#include "kernels/elementary.h"

void moit_encode_srgb(double *row, int64_t count) {
    for (int64_t x = 0; x < count; x += LANES) {
        real linear;
        memcpy(&linear, row + x, sizeof linear);
        linear = clamp(linear, K(0.0), K(1.0));
        real curve = exponential(logarithm(max(linear, K(0.0031308))) * K(1.0 / 2.4));
        linear = select(linear > K(0.0031308), curve * K(1.055) - K(0.055), linear * K(12.92));
        memcpy(row + x, &linear, sizeof linear);
    }
}
