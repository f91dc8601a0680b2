// Fragments as arrays, the passes over them, and what passes leave for one another.
//
// Pixel p owns the fragments offsets[p] to offsets[p + 1], in order of arrival. None of them is
// opaque or behind what is. With transmission `alphas` is net coverage, else what `emissions` is.
//
//   SCALAR   float or double: what arrays hold
//   DOUBLE   0 or 1: numbers are float or double; 1 where SCALAR is double
//   PASS     one of those of arrays/bindings.glsl
//   STATE_SIZE, FACTORS_SIZE, DOUBLES_SIZE   numbers that a pixel has in these buffers
//   INDICES_SIZE   those of a fragment

//   ABSORBED   what in_front gives. 0, or none: transmittance; 1: minus its logarithm, where that
//              is known; 2: transmittance, of which nothing is left: fragments count alike

#include "arrays/bindings.glsl"
#define MOST_HALF 65504.0 // the largest half float
#ifdef ABSORBED
#define ABSORBS ABSORBED
#else
#define ABSORBS 0
#endif
// Of what moments are stored in: 1, floats or fewer digits (kernels/power_rules.h).
#define HELD_AS_FLOATS (double(SCALAR(0.1lf)) != 0.1lf ? 1 : 0)
#define DRAWN \
    (PASS == DRAW_TERMS || PASS == DRAW_ORDERED || PASS == DRAW_WORDS || PASS == DRAW_SHADES)

#if !DRAWN
layout(local_size_x = GROUP) in;
#endif
#if PASS < OVER_TRIANGLES
// pixels + 1
layout(std430, binding = OFFSETS) readonly restrict buffer Offsets { uint offsets[]; };
layout(std430, binding = DEPTHS) readonly restrict buffer Depths { SCALAR depths[]; };
layout(std430, binding = ALPHAS) readonly restrict buffer Alphas { SCALAR alphas[]; };
layout(std430, binding = EMISSIONS) readonly restrict buffer Emissions { SCALAR emissions[]; };
// 3 a fragment
layout(std430, binding = COLORS) readonly restrict buffer Colors { SCALAR colors[]; };
#endif

// What a technique keeps of a pixel: as stored, and as fragments read it.
layout(std430, binding = STATE) restrict buffer State { SCALAR state[]; };
layout(std430, binding = FACTORS) restrict buffer Factors { SCALAR factors[]; };
// The same in double: what a technique keeps no longer than a question takes.
layout(std430, binding = DOUBLES) restrict buffer Doubles { double doubles[]; };
// Whole numbers of fragments, that their pixel's other passes go by.
layout(std430, binding = INDICES) restrict buffer Indices { uint indices[]; };
// What a pixel lets through, of net coverage and of each channel: 4 a pixel.
layout(std430, binding = TOTALS) restrict buffer Totals { double totals[]; };

#if !DRAWN
uniform uint count; // of threads with something to do

// More than 65,535 groups make rows of them.
uint thread() {
    return gl_GlobalInvocationID.y * gl_NumWorkGroups.x * gl_WorkGroupSize.x + gl_GlobalInvocationID.x;
}
#endif

// A fragment as techniques see it: where it is in the arrays, or nowhere.
struct surface {
    uint place;
    number depth;
    number alpha;
};

#if PASS >= OVER_TRIANGLES
vec3 drawn_color; // of the fragment that is drawn
#if NUMBERS_DRAWN > 0
number numbers[NUMBERS_DRAWN]; // meshes/drawn.glsl
#endif
number color_of(surface s, uint c) { return number(drawn_color[c]); }
number emission_of(surface s) { return s.alpha; }
#else
number color_of(surface s, uint c) { return number(colors[3u * s.place + c]); }
number emission_of(surface s) { return number(emissions[s.place]); }

surface surface_at(uint i) { return surface(i, number(depths[i]), number(alphas[i])); }
#endif


void set_total(uint p, double total) {
    for (uint k = 0u; k < 4u; ++k) totals[4u * p + k] = total;
}

// What a pixel's fragments add to the image, and how much of it they cover.
struct contribution {
    double color[3];
    double covers;
};
