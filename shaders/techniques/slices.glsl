#version 450
// Slices of optical depth: ours, from the storage of Drobot, 2025 (kernels/slices.h). Fragments add
// whole numbers to a pixel's slices, by atomics: no order shows, and no interlock is needed. Where
// slices stand comes as a table.
//
//   SCALAR, DOUBLE, PASS   arrays/fragments.glsl
//   SLOTS                  2 to 256 slices
//   CELLS                  64 to 8192, of depth
#include "kernels/dialect.glsl"
#include "kernels/elementary.h"
#include "kernels/warp.h"
#include "kernels/slices.h"
#include "arrays/fragments.glsl"
#include "arrays/warp.glsl"
#include "arrays/absorbance.glsl"

#define SUMS (uint(SLOTS) + 3u) // before each slice, and behind the last

// Of each region's cells: slot, from and share, as stages.h has them.
layout(std430, binding = NETWORK) readonly restrict buffer Tables { float tables[]; };
layout(std430, binding = STATE) buffer Words { uint sums[]; };

uniform uint image_top; // in the display, as the columns
uniform uint image_left;
uniform uint image_width;
uniform uint first_pixel;
uniform uint region_side; // 0: all pixels have one table
uniform uint region_top;  // pixels that the first region has beyond the image
uniform uint region_left;
uniform uint regions_across;
uniform number code_scale;
uniform number code_most;
uniform number half_step;

struct slice_reading {
    uint slot; // in `sums`, of the slice at the front
    bool any;
    number joined, code, near;
};

slice_reading reading_of(uint p, surface s) {
    uint pixel = first_pixel + p;
    uint row = pixel / image_width;
    uint column = pixel % image_width;
    uint region = 0u;
    if (region_side > 0u)
        region = (row + region_top) / region_side * regions_across
                 + (column + region_left) / region_side;
    slice_place place = slice_place_of(warped(s.depth), K(CELLS));
    uint entry = 3u * (region * uint(CELLS) + uint(place.cell));
    number from = number(tables[entry + 1u]);
    uint slot = uint(tables[entry]);
    real threshold = slice_threshold(row + image_top, column + image_left, place.cell);
    slice_reading r;
    r.slot = SUMS * p + slot / 2u;
    r.any = (slot & 1u) == 1u;
    r.joined = slice_joined(place.inside, from, number(tables[entry + 2u]));
    r.code = slice_code(absorbance_of(s.alpha), code_scale, code_most, threshold);
    r.near = slice_near(r.code, r.joined);
    return r;
}

#if PASS == CAPTURE
void capture(uint p) {
    for (uint k = 0u; k < SUMS; ++k) sums[SUMS * p + k] = 0u;
    precise double through = 1.0;
    for (uint i = offsets[p]; i < offsets[p + 1u]; ++i)
        through = through * (1.0 - double(alphas[i]));
    set_total(p, through);
}
#endif

#if PASS == DEPOSIT
// A sum that grows beyond what a slice holds may not wrap.
void add(uint at, uint steps) {
    if (atomicAdd(sums[at], steps) >= 0x80000000u) atomicMin(sums[at], 0x80000000u);
}

void own_pass(uint p, surface s) {
    slice_reading r = reading_of(p, s);
    uint code = uint(r.code);
    if (code == 0u) return; // its cell may have no slices
    uint near = uint(r.near);
    add(r.slot + 1u, near);
    add(r.slot + 2u, code - near);
}
#endif

#if PASS == INTEGRATE
void own_pass(uint p) {
    uint sum = 0u;
    for (uint k = 1u; k < SUMS; ++k) {
        sum += min(sums[SUMS * p + k], uint(code_most));
        sums[SUMS * p + k] = sum;
    }
}
#endif

void load_ray(uint p) {}

number in_front(uint p, surface s) {
    slice_reading r = reading_of(p, s);
    number before = number(sums[r.slot]);
    number at = number(sums[r.slot + (r.any ? 1u : 0u)]);
    number behind = number(sums[r.slot + (r.any ? 2u : 0u)]);
    number twice = slice_depth(before, at, behind, r.joined);
    number x = slice_absorbance(twice, slice_own(r.near, r.code, r.joined), half_step);
#if ABSORBS == 1
    return x;
#else
    return exponential(-x);
#endif
}
#include "arrays/questions.glsl"
