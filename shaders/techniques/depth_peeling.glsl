#version 450
// Depth peeling: Everitt, 2001. The foremost fragments of a pixel; what is behind them is not seen.
//
//   SCALAR, DOUBLE, PASS   arrays/fragments.glsl
//   LAYERS                 1 to 32, of a pixel
#include "kernels/dialect.glsl"
#include "arrays/fragments.glsl"
#include "arrays/ranks.glsl"
#include "arrays/foremost.glsl"

#if PASS == CAPTURE
void capture(uint p) { set_total(p, foremost_before(p, K(0.0), ~1u).through); }
#endif

void load_ray(uint p) {}

number in_front(uint p, surface s) {
    foremost f = foremost_before(p, s.depth, s.place);
#if PASS == COMPOSITE
    return f.beyond ? K(0.0) : number(f.through);
#else
    return number(f.through);
#endif
}
#include "arrays/questions.glsl"
