#version 450
// Depth peeling: Everitt, 2001. The foremost fragments of a pixel; what is behind them is not seen.
//
//   SCALAR, DOUBLE, PASS   arrays/fragments.glsl
//   LAYERS                 1 to 32, of a pixel
//   EXACT                  0 or 1: what all let through is known, and the foremost stand for all
#include "kernels/dialect.glsl"
#include "arrays/fragments.glsl"
#include "arrays/ranks.glsl"
#include "arrays/foremost.glsl"
#include "arrays/let_through.glsl"

#if PASS == CAPTURE
void capture(uint p) {
    precise double through = foremost_before(p, K(0.0), ~1u).through;
#if EXACT
    through = through < 1.0 ? let_through(p) : through;
#endif
    set_total(p, through);
}
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
