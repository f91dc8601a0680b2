// The nearest LAYERS fragments of a pixel exactly, and behind them what moments of all others leave
// (csrc/core/techniques/front.c). A technique of moments includes this, and has
//
//   void gather(uint p, uint n)           in CAPTURE and FACTOR: of the first n terms of term_of
//                                         `total_gathered` and `mean_gathered`
//   void load_ray(uint p)                 of the tail
//   number in_tail(uint p, surface s)     what of the tail lets through in front of s
//
//   NUMBERS   means that a state of moments has
#if LAYERS
#include "arrays/ranks.glsl"
#include "arrays/foremost.glsl"
#endif

#include "arrays/terms.glsl"

#if LAYERS
#if PASS == CAPTURE
// Absorbance and z of the nearest, from the nearest: in `doubles`, two of each.
void hold_nearest(uint p) {
    for (uint k = 0u; k < LAYERS; ++k)
        if (offsets[p] + k < offsets[p + 1u]) {
            surface f = surface_at(indices[offsets[p] + k]);
            doubles[2u * (LAYERS * p + k)] = double(absorbance_of(f.alpha));
            doubles[2u * (LAYERS * p + k) + 1u] = double(warped(f.depth));
        }
}
#endif

#if PASS == FACTOR
uniform double bias;
uniform double safe[NUMBERS]; // what bias moves means toward
uniform double covering;      // what outweighs the rounding of all
uniform double least_tail;    // a lesser part of all is none

double tail_mean[NUMBERS]; // biased

void gather(uint p, uint n);

// What is left of b0 and the means b without the nearest: its absorbance, and `tail_mean`. Sets the
// pixel's total.
double tail_of(uint p, double b0, double b[NUMBERS]) {
    gather(p, min(offsets[p + 1u] - offsets[p], uint(LAYERS)));
    precise double rest = b0 - total_gathered;
    rest = rest > least_tail * b0 ? rest : 0.0;
    precise double own = max(covering * b0 / max(rest, 1e-300lf), bias);
    own = min(own, 0.2lf);
    for (int k = 0; k < NUMBERS; ++k) {
        precise double left = b0 * b[k] - total_gathered * mean_gathered[k];
        precise double mean = rest > 0.0 ? clamp(left / rest, -1.0lf, 1.0lf) : 0.0;
        precise double biased = mean + own * (safe[k] - mean);
        tail_mean[k] = biased;
    }
    double through = foremost_before(p, K(0.0), ~1u).through;
    set_total(p, through * exponential(-rest));
    return rest;
}
#endif

#if READS
void load_ray(uint p);
number in_tail(uint p, surface s);

number in_front(uint p, surface s) {
    foremost f = foremost_before(p, s.depth, s.place);
    if (!f.beyond) return number(f.through);
    precise double T = f.through * double(in_tail(p, s));
    return number(T);
}

#if PASS == COMPOSITE
#define RESOLVES
uniform uint scales_tail; // 1: to what it covers

contribution resolved(uint p) {
    load_ray(p);
    precise contribution sum = contribution(double[3](0.0, 0.0, 0.0), 0.0);
    precise double covers = 0.0;
    uint end = offsets[p + 1u];
    for (uint i = offsets[p]; i < end; ++i)
        if (foremost_before(p, K(0.0), i).beyond)
            covers += double(alphas[i]) * double(in_front(p, surface_at(i)));
    precise double rest = foremost_before(p, K(0.0), ~1u).through - totals[4u * p];
    precise double share = scales_tail == 1u && covers > 0.0 ? rest / covers : 1.0;
    for (uint i = offsets[p]; i < end; ++i) {
        surface s = surface_at(i);
        precise double T = double(in_front(p, s));
        if (scales_tail == 1u && foremost_before(p, K(0.0), i).beyond)
            T = double(SCALAR(share * T));
#if ABSORBS == 2
        T = 1.0;
#endif
        precise double emits = double(emissions[i]) * T;
        for (uint c = 0u; c < 3u; ++c) sum.color[c] += emits * double(colors[3u * i + c]);
        sum.covers += double(s.alpha) * T;
    }
    return sum;
}
#endif
#endif
#endif
