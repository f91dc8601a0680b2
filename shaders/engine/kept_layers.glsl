// The nearest fragments of a pixel as they are, which its fragments change one after the other; of
// each that is one too many the farthest leaves, of equals the last to arrive.

// Fragments of a pixel, 1 to 32.
#ifndef LAYERS
#define LAYERS 4
#endif
#ifndef WORDS
#define WORDS 20
#endif
// 1: what has less alpha than CORE_ALPHA never is one of them.
#ifndef HAS_CORE
#define HAS_CORE 0
#endif
#if HAS_CORE
// Fainter fragments go to the tail, however near (Hahlbohm et al. 2025 have 0.05).
#ifndef CORE_ALPHA
#define CORE_ALPHA 0.05
#endif
#endif
#define NO_DEPTH 3.40282346638528859812e38

// What a pixel keeps: floats, the depth of each layer, its colour and its opacity.
struct state { uint word[WORDS]; };
// The same unpacked; layers that are not in use lie behind all others.
struct layer { float depth; vec4 color; };
struct layers { layer at[LAYERS]; };
// What a pixel keeps once a fragment has come, and what leaves it for the targets of the tail.
struct insertion { state held; sums leaves; };

layers unpacked(state held) {
    layers o;
    for (int i = 0; i < LAYERS; ++i) {
        o.at[i].depth = uintBitsToFloat(held.word[5 * i]);
        o.at[i].color = vec4(uintBitsToFloat(held.word[5 * i + 1]),
                             uintBitsToFloat(held.word[5 * i + 2]),
                             uintBitsToFloat(held.word[5 * i + 3]),
                             uintBitsToFloat(held.word[5 * i + 4]));
    }
    return o;
}

state packed(layers l) {
    state o;
    for (int i = 0; i < LAYERS; ++i) {
        o.word[5 * i] = floatBitsToUint(l.at[i].depth);
        o.word[5 * i + 1] = floatBitsToUint(l.at[i].color.r);
        o.word[5 * i + 2] = floatBitsToUint(l.at[i].color.g);
        o.word[5 * i + 3] = floatBitsToUint(l.at[i].color.b);
        o.word[5 * i + 4] = floatBitsToUint(l.at[i].color.a);
    }
    return o;
}

insertion inserted(state held, float depth, float alpha, vec3 color) {
    layers l = unpacked(held);
    layer coming;
    coming.depth = depth;
    coming.color = vec4(color, alpha);
    bool in_front = false; // behind equals at first; then all move on, equals too
    for (int i = 0; i < LAYERS; ++i) {
        layer here = l.at[i];
#if HAS_CORE
        in_front = in_front || (alpha >= CORE_ALPHA && depth < here.depth);
#else
        in_front = in_front || depth < here.depth;
#endif
        l.at[i].depth = in_front ? coming.depth : here.depth;
        l.at[i].color = in_front ? coming.color : here.color;
        coming.depth = in_front ? here.depth : coming.depth;
        coming.color = in_front ? here.color : coming.color;
    }
    insertion o;
    o.held = packed(l);
    o.leaves = into_the_tail(coming.color, coming.depth == NO_DEPTH);
    return o;
}

// The layers, one over the other: premultiplied colour, and what passes.
vec4 blended(state held) {
    layers l = unpacked(held);
    vec4 sum = vec4(0.0, 0.0, 0.0, 1.0);
    for (int i = 0; i < LAYERS; ++i) {
        vec4 c = l.at[i].color;
        sum = vec4(c.rgb * (c.a * sum.a) + sum.rgb, sum.a * (1.0 - c.a));
    }
    return sum;
}
