/* Rows of structural similarity by lanes, compiled once for each instruction set. A unit defines
 * SCALAR, LANES, TABLE and, beyond the baseline, TARGET, as those of core/stages do. */
#include "core/metrics/ssim.h"

#include "core/stages/lanes.h"

/* The encoding of sRGB, IEC 61966-2-1. */
static void encode(const double linear[BLOCK_STRIDE], double encoded[BLOCK_STRIDE]) {
    for (int x = 0; x < BLOCK_STRIDE; x += LANES) {
        real value = clamp(load(linear + x), K(0.0), K(1.0));
        real curve = exponential(logarithm(max(value, K(0.0031308))) * K(1.0 / 2.4));
        store(encoded + x,
              select(value > K(0.0031308), curve * K(1.055) - K(0.055), value * K(12.92)));
    }
}

static void multiply(const double a[BLOCK_STRIDE], const double b[BLOCK_STRIDE],
                     double product[BLOCK_STRIDE]) {
    for (int x = 0; x < BLOCK_STRIDE; x += LANES) store(product + x, load(a + x) * load(b + x));
}

static void filter(const double weights[SSIM_REACH + 1],
                   const double *const lines[2 * SSIM_REACH + 1], double out[BLOCK_SIDE]) {
    const double *const *centre = lines + SSIM_REACH;
    for (int x = 0; x < BLOCK_SIDE; x += LANES) {
        real sum = K(weights[0]) * load(centre[0] + x);
        for (int k = 1; k <= SSIM_REACH; ++k)
            sum += K(weights[k]) * (load(centre[-k] + x) + load(centre[k] + x));
        store(out + x, sum);
    }
}

static void add(const double *const ours[3], const double *const theirs[2],
                double similarity[BLOCK_SIDE]) {
    const real c1 = K(0.01 * 0.01), c2 = K(0.03 * 0.03);
    for (int x = 0; x < BLOCK_SIDE; x += LANES) {
        real a = load(ours[0] + x), b = load(theirs[0] + x);
        real product = a * b, square = a * a + b * b;
        real covariance = load(ours[2] + x) - product;
        real variances = (load(ours[1] + x) + load(theirs[1] + x)) - square;
        real similar = ((K(2.0) * product + c1) * (K(2.0) * covariance + c2)) /* (13) */
                       / ((square + c1) * (variances + c2));
        store(similarity + x, load(similarity + x) + similar);
    }
}

const ssim_lines TABLE = {encode, multiply, filter, add};

#include "core/stages/lanes_end.h"
