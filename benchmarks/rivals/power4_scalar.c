/* What moit's power4 is measured against: four power moments as published, as plain C with libm.
 *
 * Muenstermann, Krumpen, Klein and Peters, "Moment-Based Order-Independent Transparency", I3D 2018:
 * equations 1 and 2, algorithm 1 at every fragment, with the bias of its supplement. It leaves out
 * what moit does beyond that: factors in double precision, opaque surfaces, transmission, checks.
 * The warped depth of a pixel's fragments is kept from the first pass to the second, which shaders
 * compute twice; a pixel's passes follow one another, so all stays in cache.
 *
 * Compiled when it is needed (moit/rivals.py); NUMBER is float unless said otherwise. */
#include <stdint.h>
#include <tgmath.h>

#ifndef NUMBER
#define NUMBER float
#endif
typedef NUMBER number;

enum { MOST = 4096 }; /* fragments of one pixel; the caller sees to it */

static const number bias = (number)5e-7, safe_even = (number)0.375, beta = (number)0.25;

/* The transmittance in front of z, of biased moments b1 .. b4. */
static number transmittance(number b0, number b1, number b2, number b3, number b4, number z) {
    /* Cholesky factors of the Hankel matrix [[1, b1, b2], [b1, b2, b3], [b2, b3, b4]] */
    number d1 = b2 - b1 * b1;
    number l21_d1 = b3 - b1 * b2;
    number l21 = l21_d1 / d1;
    number d2 = (b4 - b2 * b2) - l21 * l21_d1;
    /* the quadratic whose roots are the other nodes: the matrix' inverse times (1, z, z^2) */
    number y1 = z - b1;
    number y2 = (z * z - b2) - l21 * y1;
    number c2 = y2 / d2;
    number c1 = y1 / d1 - l21 * c2;
    number c0 = 1 - c1 * b1 - c2 * b2;
    number half = c1 / c2 / 2;
    number root = sqrt(half * half - c0 / c2);
    number x1 = -half - root, x2 = -half + root;
    /* the mean of the polynomial that is beta at z, and at a root 1 where that is in front, else 0 */
    number f1 = x1 < z ? 1 : 0, f2 = x2 < z ? 1 : 0;
    number rise01 = (f1 - beta) / (x1 - z);
    number rise12 = (f2 - f1) / (x2 - x1);
    number turn = (rise12 - rise01) / (x2 - z);
    number share = beta + rise01 * (b1 - z) + turn * (b2 - (z + x1) * b1 + z * x1);
    number T = exp(-b0 * share);
    return T < 0 ? 0 : T > 1 ? 1 : T;
}

/* The pixels from `first` to before `end`, over black: red, green, blue, alpha. */
void power4_composite(int64_t first, int64_t end, const int64_t *offsets, const number *depth,
                      const number *alpha, const number *color, number near, number far,
                      number *image) {
    number scale = 2 / (log(far) - log(near)), start = log(near);
    number warped[MOST];
    for (int64_t p = first; p < end; ++p) {
        number b0 = 0, b1 = 0, b2 = 0, b3 = 0, b4 = 0;
        for (int64_t i = offsets[p]; i < offsets[p + 1]; ++i) {
            number a = -log(1 - alpha[i]);
            number z = (log(depth[i]) - start) * scale - 1;
            warped[i - offsets[p]] = z;
            b0 += a;
            b1 += a * z;
            b2 += a * z * z;
            b3 += a * z * z * z;
            b4 += a * (z * z) * (z * z);
        }
        number *out = image + 4 * p, red = 0, green = 0, blue = 0, weight = 0;
        if (b0 > 0) {
            number keep = (1 - bias) / b0;
            b1 *= keep;
            b2 = b2 * keep + bias * safe_even;
            b3 *= keep;
            b4 = b4 * keep + bias * safe_even;
            for (int64_t i = offsets[p]; i < offsets[p + 1]; ++i) {
                number w = alpha[i] * transmittance(b0, b1, b2, b3, b4, warped[i - offsets[p]]);
                red += w * color[3 * i];
                green += w * color[3 * i + 1];
                blue += w * color[3 * i + 2];
                weight += w;
            }
        }
        number covered = 1 - exp(-b0), over = weight > 0 ? covered / weight : 0;
        out[0] = red * over;
        out[1] = green * over;
        out[2] = blue * over;
        out[3] = covered;
    }
}
