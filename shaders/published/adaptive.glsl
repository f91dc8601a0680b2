#version 450
// What the published passes of adaptive transparency cost (Salvi, Montgomery, Lefohn 2011), written
// plainly from the paper: nodes of a visibility function, sorted; where there are too many, the one
// goes whose area is least. A yardstick: moit draws nothing with it.
//
// NODES : how many there are.

#include "published/fragments.glsl"

layout(std430, binding = 1) buffer a_state { vec2 nodes[]; }; // depth; what gets past it

#if PASS == 1
void main() {
    fragment at = this_fragment();
    uint first = gl_GlobalInvocationID.x * NODES;
    vec2 node[NODES + 1];
    for (int i = 0; i < NODES; ++i) node[i] = nodes[first + i];
    float past = 1.0 - at.alpha;

    // In front of the nodes that lie behind it, which get less
    vec2 placed = vec2(at.z, past);
    float before = 1.0;
    node[NODES] = vec2(3.4e38, 0.0);
    for (int i = 0; i < NODES; ++i) before = node[i].x < at.z ? node[i].y : before;
    placed.y *= before;
    for (int i = 0; i <= NODES; ++i) {
        bool behind = at.z < node[i].x;
        vec2 here = vec2(node[i].x, behind ? node[i].y * past : node[i].y);
        node[i] = behind ? placed : here;
        placed = behind ? here : placed;
    }

    // Rectangles between neighbours; the first node stays
    float least = 3.4e38;
    int gone = NODES;
    for (int i = 1; i <= NODES; ++i) {
        float area = (node[i].x - node[i - 1].x) * (node[i - 1].y - node[i].y);
        gone = area < least ? i : gone;
        least = min(least, area);
    }
    for (int i = 1; i <= NODES; ++i) {
        if (i == gone) node[i - 1].y = node[i].y;
        if (i > gone) node[i - 1] = node[i];
    }
    for (int i = 0; i < NODES; ++i) nodes[first + i] = node[i];
}
#else
void main() {
    fragment at = this_fragment();
    uint first = gl_GlobalInvocationID.x * NODES;
    float past = 1.0;
    for (int i = 0; i < NODES; ++i) {
        vec2 node = nodes[first + i];
        past = node.x < at.z ? node.y : past;
    }
    give(past);
}
#endif
