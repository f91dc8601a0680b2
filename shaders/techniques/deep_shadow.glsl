#version 450
// Deep shadow maps: Lokovic and Veach, 2000. A pixel of n fragments has room for 3 n + 3 nodes, of
// each its depth and transmittance, and in `doubles` how many they are. All is computed in double.
//
//   SCALAR, DOUBLE, PASS   arrays/fragments.glsl
#include "kernels/dialect.glsl"
#include "kernels/deep_shadow.h"
#include "arrays/fragments.glsl"
#include "arrays/ranks.glsl"

uint first_of(uint p) { return 6u * (offsets[p] + p); }

// Depth as maps have it: differences of the largest are finite when both are a quarter.
number place_of(real depth) { return depth * 0.25; }

#if PASS == CAPTURE
uniform number tolerance;

uint next; // place of the next node
uint first;

void add_node(real depth, real T) {
    SCALAR z = SCALAR(depth);
    SCALAR through = SCALAR(T);
    bool twin = next > first && state[next - 2u] == z && state[next - 1u] == through;
    if (!twin) {
        state[next] = z;
        state[next + 1u] = through;
        next += 2u;
    }
}

bool is_lost(shadow_segment s) { return s.steepest > s.flattest; }

void capture(uint p) {
    uint begin = offsets[p];
    uint end = offsets[p + 1u];
    first = first_of(p);
    next = first;
    real total = K(1.0);
    for (uint at = begin; at < end; ++at) {
        real through = 1.0 - double(alphas[indices[at]]);
        total = total * through;
    }
    real last = begin < end ? double(depths[indices[begin]]) : K(0.0);
    shadow_segment segment = shadow_segment_from(place_of(last), K(1.0));
    if (begin < end) add_node(last, K(1.0));
    real behind = K(1.0);
    for (uint at = begin; at < end;) {
        real depth = double(depths[indices[at]]);
        real before = behind;
        do {
            real through = 1.0 - double(alphas[indices[at]]);
            behind = behind * through;
            ++at;
        } while (at < end && double(depths[indices[at]]) == depth);
        real z = place_of(depth);

        shadow_segment front = shadow_segment_through(segment, z, before, total, tolerance);
        if (is_lost(front)) {
            real T = shadow_segment_at(segment, place_of(last));
            add_node(last, T);
            segment = shadow_segment_from(place_of(last), T);
            front = shadow_segment_through(segment, z, before, total, tolerance);
        }
        segment = shadow_segment_through(front, z, behind, total, tolerance);
        last = depth;
        if (is_lost(segment)) {
            add_node(last, shadow_segment_at(front, z));
            add_node(last, behind);
            segment = shadow_segment_from(z, behind);
        }
    }
    if (begin < end) {
        add_node(last, shadow_segment_at(segment, place_of(last)));
        add_node(last, total);
    }
    doubles[p] = double((next - first) / 2u);
    set_total(p, total);
}
#endif

#if PASS == TRANSMITTANCE || PASS == CURVE || PASS == COMPOSITE
void load_ray(uint p) {}

number in_front(uint p, surface s) {
    uint start = first_of(p);
    uint nodes = uint(doubles[p]);
    uint node = 0u;
    uint end = nodes;
    while (node < end) { // the first that is not in front of it
        uint middle = (node + end) / 2u;
        if (double(state[start + 2u * middle]) < s.depth) node = middle + 1u;
        else end = middle;
    }
    uint at = start + 2u * node;
    number found = K(1.0);
    if (node == nodes && nodes > 0u) found = double(state[at - 1u]);
    if (node > 0u && node < nodes)
        found = shadow_between(place_of(state[at - 2u]), double(state[at - 1u]), place_of(state[at]),
                               double(state[at + 1u]), place_of(s.depth));
    return double(SCALAR(found));
}
#endif
#include "arrays/questions.glsl"
