#version 450
// Techniques that blend with weights which other fragments of the pixel have no part in.
//
//   SCALAR, DOUBLE, PASS   arrays/fragments.glsl
//   FORM                   FORM_SUM, FORM_AVERAGE or FORM_BLENDED
//   WEIGHT                 with FORM_BLENDED: of kernels/weights.h, WEIGHT_GIVEN or EQUAL_WEIGHTS
//   BITS                   with FORM_BLENDED, 16: targets as published; 32: in full
#include "meshes/extensions.glsl"
#include "kernels/dialect.glsl"
#include "kernels/elementary.h"
#include "kernels/storage.h"
#include "kernels/weights.h"
#include "kernels/weighted_targets.h"
#include "arrays/fragments.glsl"

#if FORM == FORM_BLENDED && WEIGHT == WEIGHT_GIVEN
layout(std430, binding = WEIGHTS) readonly restrict buffer Weights { SCALAR given[]; };
#endif

uniform number depth_scale;
uniform number depth_near;  // of the image, and
uniform number buffer_scale; // far / (far - near), or 0

number weight_of(surface s) {
#if FORM != FORM_BLENDED || WEIGHT == EQUAL_WEIGHTS
    return K(1.0);
#elif WEIGHT == WEIGHT_GIVEN
    return number(given[s.place]);
#else
    real bright = K(0.0);
#if WEIGHT == WEIGHT_BLOG
    bright = max(max(color_of(s, 0u), color_of(s, 1u)), color_of(s, 2u)) * emission_of(s);
#endif
    real d = clamp(buffer_scale * (s.depth - depth_near) / s.depth, K(0.0), K(1.0));
    return blend_weight(WEIGHT, s.depth * depth_scale, d, s.alpha, bright);
#endif
}

// What a weight of 1 counts where `sum` is the pixel's; a number, even where that is next to
// nothing. What covers nothing occludes nothing; what weighs nothing is not seen.
double share_of_weights(double covered, double sum) {
    precise double share = covered / sum;
#if DOUBLE
    share = min(share, 1.7976931348623157e308); // products of floats do not come near
#endif
    return sum > 0.0 ? share : covered > 0.0 ? 1.0 : 0.0;
}

#if (PASS == FACTOR || PASS == RESOLVE) && FORM == FORM_AVERAGE
#include "arrays/mean_opacity.glsl"
#endif

#if PASS == CAPTURE
void capture(uint p) {
    precise double sum = 0.0;
#if FORM == FORM_BLENDED
    precise double through = 1.0;
#if BITS == 16
    real byte = K(255.0);
    real held = K(0.0);
#endif
    for (uint i = offsets[p]; i < offsets[p + 1u]; ++i) {
        surface s = surface_at(i);
        real weight = weight_of(s);
#if BITS == 16
        byte = dimmed_byte(byte, s.alpha);
        real weighs = s.alpha * weight;
        held = half_sum(held, weighs);
#else
        through *= 1.0 - double(s.alpha);
        sum += double(s.alpha) * double(weight);
#endif
    }
#if BITS == 16
    through = double(byte) / 255.0;
    sum = double(held);
#endif
    set_total(p, through);
    precise double share = share_of_weights(1.0 - through, sum);
#if WEIGHT == EQUAL_WEIGHTS
    share = min(share, 1.0); // but for rounding it is no more
#endif
    doubles[p] = share;
#else
    for (uint i = offsets[p]; i < offsets[p + 1u]; ++i) sum += double(alphas[i]);
    doubles[p] = sum;
#endif
}
#endif

#if PASS == FACTOR

void factor(uint p) {
    precise double sum = doubles[p];
#if FORM == FORM_SUM
    set_total(p, 1.0 - sum);
    doubles[p] = 1.0;
#else
    real covered = covered_in_the_mean(sum, double(offsets[p + 1u] - offsets[p]));
    set_total(p, 1.0 - covered);
    doubles[p] = sum > 0.0 ? covered / sum : 1.0;
#endif
}
#endif

#if DRAWN
// One pass blends it all: colour and opacity with their weights, and what is let through (FORM is
// FORM_BLENDED) or how many there are.
#define SHADES_SECOND
void load_ray(uint p) {}
number in_front(uint p, surface s) { return weight_of(s); }
number second_of(surface s) { return FORM == FORM_BLENDED ? s.alpha : K(1.0); }

#elif PASS == RESOLVE
#define RESOLVES_DRAWN
contribution resolved_drawn(uint p, vec4 held, vec4 second) {
    precise double sum = double(held.a), share = 1.0, total = 1.0 - sum;
#if FORM == FORM_BLENDED
    total = double(second.x);
    share = share_of_weights(1.0 - total, sum);
#elif FORM == FORM_AVERAGE
    real covered = covered_in_the_mean(sum, double(second.x));
    total = 1.0 - double(covered);
    share = sum > 0.0 ? double(covered) / sum : 1.0;
#endif
    set_total(p, total);
    precise contribution c;
    for (int k = 0; k < 3; ++k) c.color[k] = share * double(held[k]);
    c.covers = share * sum;
    return c;
}

#else
double ray_share;

void load_ray(uint p) { ray_share = doubles[p]; }

number in_front(uint p, surface s) {
    // beyond, what weighs next to nothing beside what weighs nothing would be infinite
    const double most = double(BY_PRECISION(3.4028234663852886e38, 1.7976931348623157e308));
    precise double share = ray_share * double(weight_of(s));
    precise double T = ray_share == 0.0 ? 1.0 : min(share, most);
    return number(T);
}
#endif

#if PASS == COMPOSITE && FORM == FORM_BLENDED && BITS == 16
#define RESOLVES
#define OVERFLOWS
bool sums_overflow = false;
bool overflowed(uint p) { return sums_overflow; }

// The sums are those of the accumulation target.
contribution resolved(uint p) {
    accumulation held = accumulation(K(0.0), K(0.0), K(0.0), K(0.0));
    for (uint i = offsets[p]; i < offsets[p + 1u]; ++i) {
        surface s = surface_at(i);
        real weight = weight_of(s);
        real emitted = number(emissions[i]) * weight;
        real weighs = s.alpha * weight;
        real red = emitted * number(colors[3u * i]);
        real green = emitted * number(colors[3u * i + 1u]);
        real blue = emitted * number(colors[3u * i + 2u]);
        held = accumulated(held, accumulation(red, green, blue, weighs));
    }
    number most = max(max(abs(held.red), abs(held.green)), max(abs(held.blue), abs(held.weight)));
    sums_overflow = most >= MOST_HALF;
    precise contribution sum;
    precise double share = share_of_weights(1.0 - totals[4u * p], double(held.weight));
    sum.color = double[3](double(held.red) * share, double(held.green) * share,
                          double(held.blue) * share);
    sum.covers = double(held.weight) * share;
    return sum;
}
#endif
#include "arrays/questions.glsl"
