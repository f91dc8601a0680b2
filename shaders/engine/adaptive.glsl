// Adaptive transparency: Salvi, Montgomery and Lefohn, HPG 2011. A pixel keeps transmittance as a
// few steps, which its fragments change one after the other.
#include "engine/common.glsl"
#include "engine/dialect.glsl"
#include "kernels/adaptive.h"
#include "kernels/steps.h"

// Steps of a pixel, 2 to 32.
#ifndef NODES
#define NODES 4
#endif
// 1: a step is a word, depth in its upper half and what passes in its lower; 0: two words, floats.
#ifndef QUANTIZED
#define QUANTIZED 1
#endif
#ifndef WORDS
#define WORDS 4
#endif
// 1: the two steps merge whose merging harms the picture least; 0: the one of the least area goes.
#ifndef BY_ENERGY
#define BY_ENERGY 0
#endif
// 1: colours are scaled so that their weights sum to what is covered.
#ifndef NORMALIZE
#define NORMALIZE 0
#endif

// What a pixel keeps.
struct state { uint word[WORDS]; };
// The same unpacked, and a node that is never in use.
struct nodes { visibility at[NODES + 1]; };

#if QUANTIZED
// Depth of a fragment, z in [-1, 1] as `warped` has it, as a step holds it: the last word, 65535,
// says that a step is not in use.
float step_depth(float z) { return min(floor(z * 32767.5 + 32768.0), 65534.0); }

nodes unpacked(state held) {
    nodes o;
    for (int i = 0; i < NODES; ++i) {
        float depth = float(held.word[i] >> 16u);
        o.at[i].depth = depth == 65535.0 ? empty_depth() : depth;
        o.at[i].through = float(held.word[i] & 65535u) * (1.0 / 65535.0);
    }
    o.at[NODES].depth = empty_depth();
    o.at[NODES].through = 1.0;
    return o;
}

state packed(nodes n) {
    state o;
    for (int i = 0; i < NODES; ++i) {
        uint depth = uint(min(n.at[i].depth, 65535.0));
        o.word[i] = (depth << 16u) | uint(n.at[i].through * 65535.0 + 0.5);
    }
    return o;
}
#else
// z in [-1, 1] where steps merge by energy, else depth as it is.
float step_depth(float z) { return BY_ENERGY == 1 ? 0.5 * z + 0.5 : z; }

nodes unpacked(state held) {
    nodes o;
    for (int i = 0; i < NODES; ++i) {
        o.at[i].depth = uintBitsToFloat(held.word[2 * i]);
        o.at[i].through = uintBitsToFloat(held.word[2 * i + 1]);
    }
    o.at[NODES].depth = empty_depth();
    o.at[NODES].through = 1.0;
    return o;
}

state packed(nodes n) {
    state o;
    for (int i = 0; i < NODES; ++i) {
        o.word[2 * i] = floatBitsToUint(n.at[i].depth);
        o.word[2 * i + 1] = floatBitsToUint(n.at[i].through);
    }
    return o;
}
#endif

// What a pixel keeps once a fragment has come.
state inserted(state held, float z, float alpha) {
    nodes before = unpacked(held), more, kept;
    float depth = step_depth(z), passes = 1.0 - alpha;
    more.at[0] = node_shifted(visibility(depth, 1.0), before.at[0], depth, passes);
    for (int i = 1; i < NODES + 1; ++i) {
        more.at[i] = node_shifted(before.at[i - 1], before.at[i], depth, passes);
    }
#if BY_ENERGY
    float scale = QUANTIZED == 1 ? word_step() : 1.0;
    merging best = merging_of(1.0, more.at[0], more.at[1], 1.0, scale);
    for (int i = 2; i < NODES + 1; ++i) {
        float reaches = more.at[i - 2].through;
        best = or_merging(
            best, merging_of(reaches, more.at[i - 1], more.at[i], float(i), scale));
    }
    best = merging_needed(best, more.at[NODES - 1], more.at[NODES], float(NODES));
    float place = QUANTIZED == 1 ? floor(merged_depth(best) + 0.5) : merged_depth(best);
    for (int i = 0; i < NODES; ++i) {
        kept.at[i] = node_merged(more.at[i], more.at[i + 1], float(i), best.place, place);
    }
#else
    removal gone = removal(1.0, area_lost(more.at[0], more.at[1]));
    for (int i = 2; i < NODES; ++i) {
        gone = or_removal(gone, float(i), area_lost(more.at[i - 1], more.at[i]));
    }
    float place = place_left_out(gone, more.at[NODES], float(NODES));
    for (int i = 0; i < NODES; ++i) {
        kept.at[i] = node_kept(more.at[i], more.at[i + 1], float(i), place);
    }
#endif
    return packed(kept);
}

// What reaches a fragment: what the last step in front of it lets through.
#if QUANTIZED
float transmittance(state held, float z) {
    uint here = uint(step_depth(z)) << 16u, found = 65535u;
    for (int i = 0; i < NODES; ++i) found = held.word[i] < here ? held.word[i] : found;
    return float(found & 65535u) * (1.0 / 65535.0);
}
#else
float transmittance(state held, float z) {
    nodes n = unpacked(held);
    float through = 1.0, depth = step_depth(z);
    for (int i = 0; i < NODES; ++i) {
        through = behind_step(depth, n.at[i].depth, n.at[i].through, through);
    }
    return through;
}
#endif

// Premultiplied colour and coverage. Weights may sum to less than is covered, as steps come too
// early; where they sum to more, they are scaled to that.
vec4 resolve(vec4 shaded_sum, state held) {
    float coverage = 1.0 - unpacked(held).at[NODES - 1].through;
    float excess = shaded_sum.a - coverage;
    bool is_scaled = NORMALIZE == 1 ? shaded_sum.a > 0.0 : excess > 3.0517578125e-5;
    float scale = is_scaled ? coverage / shaded_sum.a : 1.0;
    return vec4(shaded_sum.rgb * scale, coverage);
}
