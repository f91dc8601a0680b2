// Wavelet transparency: Aizenshtein, Smal and McGuire, arXiv:2201.00094, 2022. Targets hold the
// coefficients of Haar wavelets, to which each fragment adds by blending.
//
// Loops over coefficients are written out: compilers leave what has an index in memory.
#include "engine/common.glsl"
#include "engine/dialect.glsl"
#include "kernels/haar_wavelet.h"

// 2^LEVELS coefficients, 2 to 5.
#ifndef LEVELS
#define LEVELS 3
#endif
// 0: of the absorbance in front of a depth, as published; 1: of the absorbance there.
#ifndef DENSITY
#define DENSITY 0
#endif
#define CELLS float(1 << LEVELS)

// Coefficients: the scaling function's, then wavelet k of level p at 2^p + k.
struct sums {
    vec4 target0;
#if LEVELS > 2
    vec4 target1;
#endif
#if LEVELS > 3
    vec4 target2;
    vec4 target3;
#endif
#if LEVELS > 4
    vec4 target4;
    vec4 target5;
    vec4 target6;
    vec4 target7;
#endif
};
// The absorbance at the far end of each cell, from front to back.
struct factors {
    vec4 factor0;
#if LEVELS > 2
    vec4 factor1;
#endif
#if LEVELS > 3
    vec4 factor2;
    vec4 factor3;
#endif
#if LEVELS > 4
    vec4 factor4;
    vec4 factor5;
    vec4 factor6;
    vec4 factor7;
#endif
};

// The interval of a level of `count` wavelets, from 0 on.
float interval_of(haar_place place, float count) {
    return whole_below(place.cell * (count / CELLS));
}

// What a surface adds to the wavelet there, over its height: minus the integral of a tent in front
// of it, or the wavelet's sign.
float wavelet_of(haar_place place, float count) {
    float inside = (place.cell + place.inside) * (count / CELLS) - interval_of(place, count);
    if (DENSITY == 1) return inside < 0.5 ? -1.0 : 1.0;
    return min(inside, 1.0 - inside) / count;
}

vec4 at_one_of_four(float k, float x) {
    return vec4(k == 0.0 ? x : 0.0, k == 1.0 ? x : 0.0, k == 2.0 ? x : 0.0, k == 3.0 ? x : 0.0);
}

sums accumulate(float z, float alpha) {
    float s = absorbance(alpha);
    haar_place place = haar_place_of(LEVELS, DENSITY, 0.5 * z + 0.5);
    float behind = DENSITY == 1 ? 1.0 : 1.0 - (place.cell + place.inside) / CELLS;
    float second = 1.41421356 * s * wavelet_of(place, 2.0);
    bool is_near = interval_of(place, 2.0) == 0.0;
    sums o;
    o.target0 = vec4(behind * s, wavelet_of(place, 1.0) * s, is_near ? second : 0.0,
                     is_near ? 0.0 : second);
#if LEVELS > 2
    o.target1 = at_one_of_four(interval_of(place, 4.0), 2.0 * s * wavelet_of(place, 4.0));
#endif
#if LEVELS > 3
    float k3 = interval_of(place, 8.0), a3 = 2.82842712 * s * wavelet_of(place, 8.0);
    o.target2 = at_one_of_four(k3, a3);
    o.target3 = at_one_of_four(k3 - 4.0, a3);
#endif
#if LEVELS > 4
    float k4 = interval_of(place, 16.0), a4 = 4.0 * s * wavelet_of(place, 16.0);
    o.target4 = at_one_of_four(k4, a4);
    o.target5 = at_one_of_four(k4 - 4.0, a4);
    o.target6 = at_one_of_four(k4 - 8.0, a4);
    o.target7 = at_one_of_four(k4 - 12.0, a4);
#endif
    return o;
}

// Means over both halves of two intervals.
vec4 halves(vec2 mean, vec2 apart) {
    return vec4(mean.x - apart.x, mean.x + apart.x, mean.y - apart.y, mean.y + apart.y);
}

// Absorbance grows from front to back to the total, which rounding of coefficients is kept from
// changing: the ends of four cells, behind `least`.
vec4 grown(float least, vec4 cells, float total) {
    vec4 share = DENSITY == 1 ? cells / CELLS : cells;
    float behind = DENSITY == 1 ? 1.0 : 0.0; // what is in front counts, or is in it already
    float a = clamp(behind * least + share.x, least, total);
    float b = clamp(behind * a + share.y, a, total);
    float c = clamp(behind * b + share.z, b, total);
    return vec4(a, b, c, clamp(behind * c + share.w, c, total));
}

factors factor(sums t) {
    vec2 apart = 1.41421356 * t.target0.zw;
    vec4 four = halves(vec2(t.target0.x - t.target0.y, t.target0.x + t.target0.y), apart);
    factors f;
#if LEVELS == 2
    float total = DENSITY == 1 ? t.target0.x : four.w;
    f.factor0 = vec4(grown(0.0, four, total).xyz, total);
#else
    vec4 a = halves(four.xy, 2.0 * t.target1.xy), b = halves(four.zw, 2.0 * t.target1.zw);
#if LEVELS == 3
    float total = DENSITY == 1 ? t.target0.x : b.w;
    f.factor0 = grown(0.0, a, total);
    f.factor1 = vec4(grown(f.factor0.w, b, total).xyz, total);
#else
    vec4 a3 = 2.82842712 * t.target2, b3 = 2.82842712 * t.target3;
    vec4 c = halves(a.xy, a3.xy), d = halves(a.zw, a3.zw);
    vec4 e = halves(b.xy, b3.xy), g = halves(b.zw, b3.zw);
#if LEVELS == 4
    float total = DENSITY == 1 ? t.target0.x : g.w;
    f.factor0 = grown(0.0, c, total);
    f.factor1 = grown(f.factor0.w, d, total);
    f.factor2 = grown(f.factor1.w, e, total);
    f.factor3 = vec4(grown(f.factor2.w, g, total).xyz, total);
#else
    vec4 last = halves(g.zw, 4.0 * t.target7.zw);
    float total = DENSITY == 1 ? t.target0.x : last.w;
    f.factor0 = grown(0.0, halves(c.xy, 4.0 * t.target4.xy), total);
    f.factor1 = grown(f.factor0.w, halves(c.zw, 4.0 * t.target4.zw), total);
    f.factor2 = grown(f.factor1.w, halves(d.xy, 4.0 * t.target5.xy), total);
    f.factor3 = grown(f.factor2.w, halves(d.zw, 4.0 * t.target5.zw), total);
    f.factor4 = grown(f.factor3.w, halves(e.xy, 4.0 * t.target6.xy), total);
    f.factor5 = grown(f.factor4.w, halves(e.zw, 4.0 * t.target6.zw), total);
    f.factor6 = grown(f.factor5.w, halves(g.xy, 4.0 * t.target7.xy), total);
    f.factor7 = vec4(grown(f.factor6.w, last, total).xyz, total);
#endif
#endif
#endif
    return f;
}

// Where the answer starts and ends in the cell of number `cell` among four, or as before.
vec2 ends_among(vec2 before, float start, vec4 ends, float cell) {
    vec2 found = cell >= 0.0 ? vec2(start, ends.x) : before;
    found = cell >= 1.0 ? ends.xy : found;
    found = cell >= 2.0 ? ends.yz : found;
    return cell >= 3.0 ? ends.zw : found;
}

float transmittance(factors f, float z, float alpha) {
    haar_place place = haar_place_of(LEVELS, DENSITY, 0.5 * z + 0.5);
    vec2 ends = ends_among(vec2(0.0, 0.0), 0.0, f.factor0, place.cell);
#if LEVELS > 2
    ends = ends_among(ends, f.factor0.w, f.factor1, place.cell - 4.0);
#endif
#if LEVELS > 3
    ends = ends_among(ends, f.factor1.w, f.factor2, place.cell - 8.0);
    ends = ends_among(ends, f.factor2.w, f.factor3, place.cell - 12.0);
#endif
#if LEVELS > 4
    ends = ends_among(ends, f.factor3.w, f.factor4, place.cell - 16.0);
    ends = ends_among(ends, f.factor4.w, f.factor5, place.cell - 20.0);
    ends = ends_among(ends, f.factor5.w, f.factor6, place.cell - 24.0);
    ends = ends_among(ends, f.factor6.w, f.factor7, place.cell - 28.0);
#endif
    float own = EXCLUDE_SELF == 1 ? absorbance(alpha) : 0.0;
    return haar_transmittance(DENSITY, ends.x, ends.y, place.inside, own);
}

float transmittance_of_sums(sums t, float z, float alpha) {
    return transmittance(factor(t), z, alpha);
}

#ifndef MEANS_OF_BLOCKS
vec4 resolve(vec4 shaded_sum, sums t) {
    float total = t.target0.x;
#if DENSITY == 0
    total = total + t.target0.y + 1.41421356 * t.target0.w;
#if LEVELS == 3
    total = total + 2.0 * t.target1.w;
#endif
#if LEVELS == 4
    total = total + 2.0 * t.target1.w + 2.82842712 * t.target3.w;
#endif
#if LEVELS == 5
    total = total + 2.0 * t.target1.w + 2.82842712 * t.target3.w + 4.0 * t.target7.w;
#endif
#endif
    return covered(shaded_sum, max(total, 0.0));
}
#endif
