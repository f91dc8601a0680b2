// Multi-layer alpha blending: Salvi and Vaidyanathan, I3D 2014. A pixel keeps a few layers, which
// its fragments change one after the other: of each that is one too many the two farthest blend.
#include "engine/common.glsl"
#include "engine/dialect.glsl"
#include "kernels/mlab.h"

// Layers of a pixel, 1 to 32.
#ifndef LAYERS
#define LAYERS 4
#endif
// 1: a layer is four half floats, and half a word of depth; 0: five words, floats.
#ifndef QUANTIZED
#define QUANTIZED 1
#endif
#ifndef WORDS
#define WORDS 10
#endif
// Fragments of a lesser opacity are skipped.
#ifndef LEAST_ALPHA
#define LEAST_ALPHA 0.001
#endif

// What a pixel keeps: red, green and blue with what passes of each layer, then depths, two a word.
struct state { uint word[WORDS]; };
// The same unpacked.
struct layers { layer at[LAYERS]; };

#if QUANTIZED
// Depth as layers hold it: the last word, 65535, says that a layer is not in use.
float layer_depth(float depth) { return min(floor(warped(depth) * 32767.5 + 32768.0), 65534.0); }

layers unpacked(state held) {
    layers o;
    for (int i = 0; i < LAYERS; ++i) {
        vec2 front = unpackHalf2x16(held.word[2 * i]), rest = unpackHalf2x16(held.word[2 * i + 1]);
        uint both = held.word[2 * LAYERS + i / 2];
        float depth = float(i % 2 == 0 ? both & 65535u : both >> 16u);
        o.at[i].depth = depth == 65535.0 ? empty_layer().depth : depth;
        o.at[i].red = front.x;
        o.at[i].green = front.y;
        o.at[i].blue = rest.x;
        o.at[i].through = rest.y;
    }
    return o;
}

state packed(layers l) {
    state o;
    for (int i = 0; i < (LAYERS + 1) / 2; ++i) o.word[2 * LAYERS + i] = 0u;
    for (int i = 0; i < LAYERS; ++i) {
        layer held = held_layer(l.at[i]);
        o.word[2 * i] = packHalf2x16(vec2(held.red, held.green));
        o.word[2 * i + 1] = packHalf2x16(vec2(held.blue, held.through));
        uint depth = uint(min(held.depth, 65535.0)), shifted = i % 2 == 0 ? depth : depth << 16u;
        o.word[2 * LAYERS + i / 2] = o.word[2 * LAYERS + i / 2] | shifted;
    }
    return o;
}
#else
float layer_depth(float depth) { return depth; }

layers unpacked(state held) {
    layers o;
    for (int i = 0; i < LAYERS; ++i) {
        o.at[i].depth = uintBitsToFloat(held.word[5 * i]);
        o.at[i].red = uintBitsToFloat(held.word[5 * i + 1]);
        o.at[i].green = uintBitsToFloat(held.word[5 * i + 2]);
        o.at[i].blue = uintBitsToFloat(held.word[5 * i + 3]);
        o.at[i].through = uintBitsToFloat(held.word[5 * i + 4]);
    }
    return o;
}

state packed(layers l) {
    state o;
    for (int i = 0; i < LAYERS; ++i) {
        o.word[5 * i] = floatBitsToUint(l.at[i].depth);
        o.word[5 * i + 1] = floatBitsToUint(l.at[i].red);
        o.word[5 * i + 2] = floatBitsToUint(l.at[i].green);
        o.word[5 * i + 3] = floatBitsToUint(l.at[i].blue);
        o.word[5 * i + 4] = floatBitsToUint(l.at[i].through);
    }
    return o;
}
#endif

// What a pixel keeps once a fragment has come. Walks over the layers from the front; what comes out
// behind the last blends with it.
state inserted(state held, float depth, float alpha, vec3 color) {
    layers l = unpacked(held);
    layer made = layer_of(layer_depth(depth), alpha, color.r, color.g, color.b, LEAST_ALPHA);
#if QUANTIZED
    layer coming = held_layer(made);
#else
    layer coming = made;
#endif
    for (int i = 0; i < LAYERS; ++i) {
        layer_pair both = layers_passed(l.at[i], coming);
        l.at[i] = both.front;
        coming = both.behind;
    }
    l.at[LAYERS - 1] = layers_blended(l.at[LAYERS - 1], coming);
    return packed(l);
}

// Premultiplied colour and coverage: one layer over the other.
vec4 resolve_layers(state held) {
    layers l = unpacked(held);
    vec4 sum = vec4(0.0, 0.0, 0.0, 1.0);
    for (int i = 0; i < LAYERS; ++i) {
        sum = vec4(vec3(l.at[i].red, l.at[i].green, l.at[i].blue) * sum.a + sum.rgb,
                   sum.a * l.at[i].through);
    }
    return vec4(sum.rgb, 1.0 - sum.a);
}
