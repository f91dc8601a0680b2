#version 450
// The exact composite: fragments front to back (Carpenter 1984).
//
//   SCALAR, DOUBLE, PASS   arrays/fragments.glsl
#include "kernels/dialect.glsl"
#include "arrays/fragments.glsl"
#include "arrays/order.glsl"

#if PASS == CAPTURE
void capture(uint p) {
    precise double through = 1.0;
    for (uint i = offsets[p]; i < offsets[p + 1u]; ++i) through *= 1.0 - double(alphas[i]);
    set_total(p, through);
}
#endif

void load_ray(uint p) {}

number in_front(uint p, surface s) { return number(nearer_let_through(p, s.depth, s.place)); }

#define RESOLVES
contribution resolved(uint p) {
    precise contribution sum;
    sum.color = double[3](0.0, 0.0, 0.0);
    sum.covers = 0.0;
    precise double through = 1.0;
    uint last = NOWHERE;
    for (bool more = true; more;) {
        nearest_few next = nearest_behind(p, last == NOWHERE ? K(0.0) : number(depths[last]), last);
        for (uint k = 0u; k < ROUND; ++k) {
            uint i = next.place[k];
            more = i != NOWHERE;
            if (!more) break;
            precise double T = double(number(through));
            precise double emits = double(emissions[i]) * T;
            for (uint c = 0u; c < 3u; ++c) sum.color[c] += emits * double(colors[3u * i + c]);
            sum.covers += double(alphas[i]) * T;
            through *= 1.0 - double(alphas[i]);
            last = i;
        }
    }
    return sum;
}
#include "arrays/questions.glsl"
