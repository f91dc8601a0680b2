#version 450
// Hybrid transparency: Maule, Comba, Torchelsen and Bastos, 2013. The foremost fragments of a
// pixel, and all others as layers of their mean opacity in their mean colour.
//
//   SCALAR, DOUBLE, PASS   arrays/fragments.glsl
//   LAYERS                 1 to 32, of a pixel
//   EXACT                  0 or 1: what the others cover is exact
//   CORE_ALPHA             arrays/ranks.glsl
#include "kernels/dialect.glsl"
#include "kernels/elementary.h"
#include "arrays/fragments.glsl"
#include "arrays/ranks.glsl"
#include "arrays/foremost.glsl"

#if PASS == CAPTURE || PASS == FACTOR
// How many are foremost.
uint foremost_of(uint p) {
    uint most = min(LAYERS, offsets[p + 1u] - offsets[p]), found = 0u;
    for (uint k = 0u; k < most; ++k) found += is_faint(indices[offsets[p] + k]) ? 0u : 1u;
    return found;
}
#endif

#if PASS == CAPTURE
void capture(uint p) {
    precise double behind = 0.0;
    uint end = offsets[p + 1u];
    for (uint at = offsets[p] + foremost_of(p); at < end; ++at)
        behind = behind + double(alphas[indices[at]]);
    doubles[3u * p] = foremost_before(p, K(0.0), ~1u).through;
    doubles[3u * p + 1u] = behind;
#if EXACT
    precise double covered = 0.0;
    for (uint i = offsets[p]; i < end; ++i)
        if (!is_foremost(p, i)) covered = covered + (1.0 - covered) * double(alphas[i]);
    doubles[3u * p + 2u] = covered;
#endif
}
#endif

#if PASS == FACTOR
#include "arrays/mean_opacity.glsl"

// What the fragments behind have for transmittance.
void factor(uint p) {
    real core = doubles[3u * p];
    real sum = doubles[3u * p + 1u];
    int n = int(offsets[p + 1u] - offsets[p] - foremost_of(p));
#if EXACT
    real covered = min(doubles[3u * p + 2u], sum);
#else
    real covered = n > 0 ? covered_in_the_mean(sum, double(n)) : K(0.0);
#endif
    real through = core * (1.0 - covered);
    real share = core * (covered / sum);
    set_total(p, through);
    factors[p] = SCALAR(sum > 0.0 ? share : core);
}
#endif

void load_ray(uint p) {}

number in_front(uint p, surface s) {
    foremost f = foremost_before(p, s.depth, s.place);
    return f.beyond ? number(factors[p]) : number(f.through);
}
#include "arrays/questions.glsl"
