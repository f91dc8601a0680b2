#version 450
// Fourier opacity maps: Jansen and Bavoil, "Fourier Opacity Mapping", 2010. A pixel keeps the mean
// and of each harmonic a cosine and a sine.
//
//   SCALAR, DOUBLE, PASS   arrays/fragments.glsl
//   HARMONICS              1 to 15
//   BITS                   16 or 32: of a coefficient
#include "meshes/extensions.glsl"
#include "kernels/dialect.glsl"
#include "kernels/elementary.h"
#include "kernels/storage.h"
#include "kernels/warp.h"
#include "kernels/fourier_opacity.h"
#include "arrays/fragments.glsl"
#include "arrays/warp.glsl"
#include "arrays/absorbance.glsl"


#if PASS == CAPTURE || PASS == COLLECT || PASS == EXPAND
void expand(uint p, fourier_series s) {
    s = integrated(HARMONICS, s);
    factors[FACTORS_SIZE * p] = SCALAR(s.mean);
    for (uint k = 0u; k < HARMONICS; ++k) {
        factors[FACTORS_SIZE * p + 1u + 2u * k] = SCALAR(s.cosine[k]);
        factors[FACTORS_SIZE * p + 2u + 2u * k] = SCALAR(s.sine[k]);
    }
}

void keep(uint p, fourier_series s) {
    state[STATE_SIZE * p] = SCALAR(s.mean);
    for (uint k = 0u; k < HARMONICS; ++k) {
        state[STATE_SIZE * p + 1u + 2u * k] = SCALAR(s.cosine[k]);
        state[STATE_SIZE * p + 2u + 2u * k] = SCALAR(s.sine[k]);
    }
    if (OF_BLOCKS == 0) expand(p, s);
}

#if PASS == EXPAND
void own_pass(uint p) {
    fourier_series s;
    s.mean = number(state[STATE_SIZE * p]);
    for (uint k = 0u; k < HARMONICS; ++k) {
        s.cosine[k] = number(state[STATE_SIZE * p + 1u + 2u * k]);
        s.sine[k] = number(state[STATE_SIZE * p + 2u + 2u * k]);
    }
    expand(p, s);
}
#elif PASS == COLLECT
#elif BITS == 16
void capture(uint p) {
    fourier_series sum;
    sum.mean = K(0.0);
    for (int k = 0; k < HARMONICS; ++k) sum.cosine[k] = sum.sine[k] = K(0.0);
    for (uint i = offsets[p]; i < offsets[p + 1u]; ++i) {
        surface f = surface_at(i);
        fourier_series s =
            series_of_surface(HARMONICS, absorbance_of(f.alpha), warped(f.depth));
        sum.mean = half_sum(sum.mean, s.mean);
        for (int k = 0; k < HARMONICS; ++k) {
            sum.cosine[k] = half_sum(sum.cosine[k], s.cosine[k]);
            sum.sine[k] = half_sum(sum.sine[k], s.sine[k]);
        }
    }
    keep(p, sum);
}
#else
number all_lanes(double lanes[4]) {
    precise double sum = (lanes[0] + lanes[1]) + (lanes[2] + lanes[3]);
    return number(sum);
}

void capture(uint p) {
    precise double mean[4];
    precise double cosine[HARMONICS][4];
    precise double sine[HARMONICS][4];
    for (int lane = 0; lane < 4; ++lane) {
        mean[lane] = 0.0;
        for (int k = 0; k < HARMONICS; ++k) cosine[k][lane] = sine[k][lane] = 0.0;
    }
    uint end = offsets[p + 1u];
    for (uint i = offsets[p]; i < end; i += 4u)
        for (uint lane = 0u; lane < 4u; ++lane) { // as C's lanes add up
            bool there = i + lane < end;
            surface f = surface_at(there ? i + lane : i);
            number weight = there ? absorbance_of(f.alpha) : K(0.0);
            fourier_series s = series_of_surface(HARMONICS, weight, warped(f.depth));
            mean[lane] += double(s.mean);
            for (int k = 0; k < HARMONICS; ++k) {
                cosine[k][lane] += double(s.cosine[k]);
                sine[k][lane] += double(s.sine[k]);
            }
        }
    fourier_series sum;
    sum.mean = all_lanes(mean);
    for (int k = 0; k < HARMONICS; ++k) {
        sum.cosine[k] = all_lanes(cosine[k]);
        sum.sine[k] = all_lanes(sine[k]);
    }
    keep(p, sum);
}
#endif
#endif

// Of triangles: targets add up what each fragment brings.

#if PASS == DRAW_TERMS
void set_terms(surface s, uint p) {
    fourier_series own = series_of_surface(HARMONICS, absorbance_of(s.alpha), warped(s.depth));
    numbers[0] = own.mean;
    for (int k = 0; k < HARMONICS; ++k) {
        numbers[1 + 2 * k] = own.cosine[k];
        numbers[2 + 2 * k] = own.sine[k];
    }
}
#elif PASS == COLLECT
void collect(uint p) {
    fourier_series sum;
    sum.mean = numbers[0];
    for (int k = 0; k < HARMONICS; ++k) {
        sum.cosine[k] = numbers[1 + 2 * k];
        sum.sine[k] = numbers[2 + 2 * k];
    }
    keep(p, sum);
}
#endif

#if PASS == FACTOR
void factor(uint p) { set_total(p, exponential(-double(state[STATE_SIZE * p]))); }
#endif

#if PASS == TRANSMITTANCE || PASS == CURVE || PASS == COMPOSITE || PASS == DRAW_SHADES
fourier_series ray;

void load_ray(uint p) {
    ray.mean = factors[FACTORS_SIZE * p];
    for (uint k = 0u; k < HARMONICS; ++k) {
        ray.cosine[k] = factors[FACTORS_SIZE * p + 1u + 2u * k];
        ray.sine[k] = factors[FACTORS_SIZE * p + 2u + 2u * k];
    }
}

number in_front(uint p, surface s) {
    number own = own_absorbance(s.alpha);
#if ABSORBS == 1
    return series_absorbance(HARMONICS, ray, warped(s.depth), own);
#else
    return series_transmittance(HARMONICS, ray, warped(s.depth), own);
#endif
}
#endif
#if BITS == 16
#define BLOCK_NUMBER(x) rounded_to_half(x)
#endif
#include "arrays/blocks.glsl"
#include "arrays/questions.glsl"
