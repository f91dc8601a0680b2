#version 450
// The k-buffer: Bavoil et al., 2007. The nearest fragments in order, in front of all others in the
// order in which they had to go: the pass that captures leaves this order in `indices`, from the
// front, and the next what reaches each fragment in `state`.
//
//   SCALAR, DOUBLE, PASS   arrays/fragments.glsl
//   LAYERS                 1 to 32, of a pixel
#include "kernels/dialect.glsl"
#include "arrays/fragments.glsl"
#include "arrays/front_to_back.glsl"

#define NONE (~0u)

#if PASS == CAPTURE
void capture(uint p) {
    number held_depth[LAYERS];
    uint held[LAYERS];
    for (int k = 0; k < LAYERS; ++k) {
        held_depth[k] = K(0.0);
        held[k] = NONE;
    }
    uint first = offsets[p];
    uint end = offsets[p + 1u];
    uint last = end; // the places behind it are taken
    for (uint i = first; i < end; ++i) {
        number depth = number(depths[i]);
        uint place = i;
        bool front = false; // behind equals at first; then all move on, equals too
        for (int k = 0; k < LAYERS; ++k) {
            number other = held_depth[k];
            uint other_place = held[k];
            front = front || other_place == NONE || depth < other;
            held_depth[k] = front ? depth : other;
            held[k] = front ? place : other_place;
            depth = front ? other : depth;
            place = front ? other_place : place;
        }
        if (place != NONE) {
            --last;
            indices[last] = place;
        }
    }
    for (uint k = 0u; k < LAYERS; ++k)
        if (held[k] != NONE) indices[first + k] = held[k];
}
#endif

#if PASS == FACTOR
void factor(uint p) { go_through(p); }
#endif

void load_ray(uint p) {}

number in_front(uint p, surface s) { return number(state[s.place]); }
#include "arrays/questions.glsl"
