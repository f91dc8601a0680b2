#version 450
// Over, each fragment in front of those that arrived before it (Porter and Duff 1984).
//
//   SCALAR, DOUBLE, PASS   arrays/fragments.glsl
#include "meshes/extensions.glsl"
#include "kernels/dialect.glsl"
#include "arrays/fragments.glsl"

#if DRAWN
// Blending does it.
void load_ray(uint p) {}
number in_front(uint p, surface s) { return K(1.0); }

#elif PASS == RESOLVE
#define RESOLVES_DRAWN
contribution resolved_drawn(uint p, vec4 held, vec4 second) {
    set_total(p, 1.0 - double(held.a));
    return contribution(double[3](double(held.r), double(held.g), double(held.b)), double(held.a));
}

#else
// What arrived later than fragment i, or with ~0u than none, lets through.
double later_let_through(uint p, uint i) {
    precise double through = 1.0;
    for (uint k = offsets[p + 1u]; k-- > (i == ~0u ? offsets[p] : i + 1u);)
        through *= 1.0 - double(alphas[k]);
    return through;
}

#if PASS == CAPTURE
void capture(uint p) { set_total(p, later_let_through(p, ~0u)); }
#endif

void load_ray(uint p) {}

number in_front(uint p, surface s) { return number(later_let_through(p, s.place)); }

#define RESOLVES
contribution resolved(uint p) {
    precise contribution sum;
    sum.color = double[3](0.0, 0.0, 0.0);
    sum.covers = 0.0;
    precise double through = 1.0;
    for (uint i = offsets[p + 1u]; i-- > offsets[p];) {
        precise double T = double(number(through));
        precise double emits = double(emissions[i]) * T;
        for (uint c = 0u; c < 3u; ++c) sum.color[c] += emits * double(colors[3u * i + c]);
        sum.covers += double(alphas[i]) * T;
        through *= 1.0 - double(alphas[i]);
    }
    return sum;
}
#endif
#include "arrays/questions.glsl"
