// The passes that all techniques have in common. A technique's file includes this last, and has
//
//   void capture(uint p)               where PASS is CAPTURE
//   void factor(uint p)                where PASS is FACTOR
//   void own_pass(uint p)              where PASS is one of its own, a pixel a thread
//   void own_pass(uint p, surface s)   where that is a fragment a thread
//   void load_ray(uint p)              what in_front needs of pixel p
//   number in_front(uint p, surface s) the transmittance in front of s
//
// or, where RESOLVES is defined, for in_front in COMPOSITE
//
//   contribution resolved(uint p)      what the pixel's fragments add to the image, and cover
//
// Where OVERFLOWS is defined, for COMPOSITE and RESOLVE,
//
//   bool overflowed(uint p)            whether what p keeps is more than half floats hold

#include "kernels/options.h"

#if PASS >= OVER_TRIANGLES
#include "meshes/drawn.glsl"
#else
#if PASS == TRANSMITTANCE || PASS >= FRAGMENTS
layout(std430, binding = RAYS) readonly restrict buffer Rays { uint ray_of[]; }; // of each fragment
#elif PASS == CURVE
layout(std430, binding = ASKED) readonly restrict buffer Asked { double asked[]; }; // depths
uniform uint depths_asked;
uniform uint asked_of_pixel; // 0: all pixels are asked the same depths
#elif PASS == COMPOSITE
// BEHIND_NUMBERS a pixel: a colour, and where fragments give what is absorbed in front of them, the
// least of that, which their weights are relative to.
layout(std430, binding = ASKED) readonly restrict buffer Behind { double behind[]; };
#define BEHIND_NUMBERS (ABSORBS == 0 ? 3u : 4u)
uniform uint behind_of_pixel; // 0: the same is behind all
uniform uint scaling;         // one of SCALE_NOT ..
// Whether alpha says LOOK_AGAIN of pixels: 0: never; 1: whose weights are lost; 2: of those that
// let nothing through as well, where weights are scaled.
uniform uint marks;
uniform uint marks_overflows; // whether alpha is negative of pixels whose half floats overflow
uniform double least_weight; // a lesser sum of weights is that of lost ones, as 0 is
#elif PASS == CHANNELS
// 3 a fragment
layout(std430, binding = ASKED) readonly restrict buffer Opacities { SCALAR opacities[]; };
#endif
layout(std430, binding = ANSWERS) writeonly restrict buffer Answers { SCALAR answers[]; };

void main() {
    uint at = thread();
    if (at >= count) return;
#if PASS == CAPTURE
    capture(at);
#elif PASS == FACTOR
    factor(at);
#elif PASS >= FRAGMENTS
    own_pass(ray_of[at], surface_at(at));
#elif PASS >= OWN
    own_pass(at);
#elif PASS == TRANSMITTANCE
    load_ray(ray_of[at]);
    answers[at] = SCALAR(in_front(ray_of[at], surface_at(at)));
#elif PASS == CURVE
    uint p = at / depths_asked;
    load_ray(p);
    number depth = number(asked[asked_of_pixel * p * depths_asked + at % depths_asked]);
    answers[at] = SCALAR(in_front(p, surface(~0u, depth, K(0.0))));
#elif PASS == COMPOSITE
    precise contribution sum;
#ifdef RESOLVES
    sum = resolved(at);
#else
    load_ray(at);
    sum = contribution(double[3](0.0, 0.0, 0.0), 0.0);
    for (uint i = offsets[at]; i < offsets[at + 1u]; ++i) {
        surface s = surface_at(i);
#if ABSORBS == 1
        real more = max(in_front(at, s) - number(behind[BEHIND_NUMBERS * at + 3u]), K(0.0));
        precise double T = double(exponential(-more));
#elif ABSORBS == 2
        precise double T = 1.0;
#else
        precise double T = double(in_front(at, s));
#endif
        precise double emits = double(emissions[i]) * T;
        for (uint c = 0u; c < 3u; ++c) sum.color[c] += emits * double(colors[3u * i + c]);
        sum.covers += double(s.alpha) * T;
    }
#endif
    precise double scale = 1.0;
    precise double shown = 1.0 - totals[4u * at];
    precise double excess = sum.covers - shown;
    // what covers nothing may emit all the same
    if (scaling == SCALE_ALL && sum.covers > 0.0) scale = shown / sum.covers;
    if (scaling == SCALE_EXCESS && excess > 0.000030517578125) scale = shown / sum.covers;
    precise double red = totals[4u * at + 1u];
    for (uint c = 0u; c < 3u; ++c) {
        precise double channel = totals[4u * at + 1u + c] * behind[BEHIND_NUMBERS * behind_of_pixel * at + c]
                                 + scale * sum.color[c];
        answers[4u * at + c] = SCALAR(channel);
    }
    precise double mean = red + ((totals[4u * at + 2u] - red) + (totals[4u * at + 3u] - red)) / 3.0;
    bool lost = sum.covers < least_weight || sum.covers == 0.0;
    lost = lost && totals[4u * at] < 0.5;
    lost = scaling == SCALE_ALL && (lost || (marks == 2u && totals[4u * at] == 0.0));
    SCALAR opacity = marks > 0u && lost ? SCALAR(LOOK_AGAIN) : SCALAR(1.0 - mean);
#ifdef OVERFLOWS
    if (marks_overflows > 0u && overflowed(at)) opacity = -opacity;
#endif
    answers[4u * at + 3u] = opacity;
#elif PASS == CHANNELS
    // channels that differ are multiplied up, as they would be in a render target
    bool grey = true;
    precise double through[3] = double[3](1.0, 1.0, 1.0);
    for (uint i = offsets[at]; i < offsets[at + 1u]; ++i)
        for (uint c = 0u; c < 3u; ++c) {
            through[c] *= 1.0 - double(opacities[3u * i + c]);
            grey = grey && opacities[3u * i + c] == alphas[i];
        }
    if (!grey)
        for (uint c = 0u; c < 3u; ++c) totals[4u * at + 1u + c] = through[c];
#endif
}
#endif
