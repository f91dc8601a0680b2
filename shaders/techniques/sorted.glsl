#version 450
// The exact composite: fragments front to back (Carpenter 1984). What reaches each is in `state`.
//
//   SCALAR, DOUBLE, PASS   arrays/fragments.glsl
#include "kernels/dialect.glsl"
#include "arrays/fragments.glsl"
#include "arrays/ranks.glsl"
#include "arrays/front_to_back.glsl"

#if PASS == CAPTURE
void capture(uint p) { go_through(p); }
#endif

void load_ray(uint p) {}

#if PASS == CURVE
// A curve counts what is strictly nearer.
number in_front(uint p, surface s) {
    precise double through = 1.0;
    uint end = offsets[p + 1u];
    for (uint i = offsets[p]; i < end; ++i) {
        bool nearer = number(depths[i]) < s.depth;
        through = through * (nearer ? 1.0 - double(alphas[i]) : 1.0);
    }
    return number(through);
}
#elif PASS == TRANSMITTANCE || PASS == COMPOSITE
number in_front(uint p, surface s) { return number(state[s.place]); }
#endif
#include "arrays/questions.glsl"
