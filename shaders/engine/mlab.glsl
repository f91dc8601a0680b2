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
// 1: the two layers blend whose blending harms the picture least; 0: the two farthest.
#ifndef BY_ENERGY
#define BY_ENERGY 0
#endif
// Fragments of a lesser opacity are skipped.
#ifndef LEAST_ALPHA
#define LEAST_ALPHA 0.001
#endif

// What a pixel keeps: red, green and blue with what passes of each layer, then depths, two a word.
struct state { uint word[WORDS]; };
// The same unpacked.
struct layers { layer at[LAYERS]; };

#if BY_ENERGY
struct more_layers { layer at[LAYERS + 1]; };

// Of layers from front to back, one too many, the two blend whose blending does least.
layers fewer(more_layers more) {
    float reaches = 1.0;
    blending best = blending_of(reaches, more.at[0], more.at[1], 1.0);
    for (int i = 2; i < LAYERS + 1; ++i) {
        reaches = reaches * more.at[i - 2].through;
        best = or_blending(best, blending_of(reaches, more.at[i - 1], more.at[i], float(i)));
    }
    best = blending_needed(best, more.at[LAYERS], float(LAYERS));
    layer front = more.at[0], behind = more.at[1];
    for (int i = 2; i < LAYERS + 1; ++i) {
        bool here = best.place == float(i);
        front = layer_chosen(here, more.at[i - 1], front);
        behind = layer_chosen(here, more.at[i], behind);
    }
    layer merged = layers_merged(front, behind, best);
    layers o;
    for (int i = 0; i < LAYERS; ++i) {
        layer later = layer_chosen(float(i) < best.place, merged, more.at[i + 1]);
        o.at[i] = layer_chosen(float(i) < best.place - 1.0, more.at[i], later);
    }
    return o;
}
#endif

#if QUANTIZED
layer unpacked(uint depth, uint red_green, uint blue_through) {
    vec2 front = unpackHalf2x16(red_green), rest = unpackHalf2x16(blue_through);
    layer o;
    o.depth = depth == 65535u ? empty_layer().depth : float(depth);
    o.red = front.x;
    o.green = front.y;
    o.blue = rest.x;
    o.through = rest.y;
    return o;
}

uint depth_of(state held, int i) {
    uint both = held.word[2 * LAYERS + i / 2];
    return i % 2 == 0 ? both & 65535u : both >> 16u;
}

// What a pixel keeps once a fragment has come, its z in [-1, 1] as `warped` has it. Walks over the
// layers from the front, which stay packed; what comes out behind the last blends with it. Of
// depths the last word, 65535, says that a layer is not in use.
state inserted(state held, float z, float alpha, vec3 color) {
    bool is_seen = alpha >= LEAST_ALPHA;
    float opacity = is_seen ? alpha : 0.0;
    vec3 own = min(color * opacity, vec3(65504.0, 65504.0, 65504.0));
    uint depth = is_seen ? uint(min(z * 32767.5 + 32768.0, 65534.0)) : 65535u;
    uint red_green = packHalf2x16(own.rg);
    uint blue_through = packHalf2x16(vec2(own.b, 1.0 - opacity));
#if BY_ENERGY
    state o;
    more_layers more;
    for (int i = 0; i < LAYERS; ++i) {
        uint there = depth_of(held, i), a = held.word[2 * i], b = held.word[2 * i + 1];
        bool front = depth <= there;
        more.at[i] = unpacked(front ? depth : there, front ? red_green : a,
                              front ? blue_through : b);
        depth = front ? there : depth;
        red_green = front ? a : red_green;
        blue_through = front ? b : blue_through;
    }
    more.at[LAYERS] = unpacked(depth, red_green, blue_through);
    layers l = fewer(more);
    uint depths[LAYERS];
    for (int i = 0; i < LAYERS; ++i) {
        depths[i] = uint(min(l.at[i].depth, 65535.0));
        vec2 seen = min(vec2(l.at[i].red, l.at[i].green), vec2(65504.0, 65504.0));
        o.word[2 * i] = packHalf2x16(seen);
        o.word[2 * i + 1] = packHalf2x16(vec2(min(l.at[i].blue, 65504.0), l.at[i].through));
    }
#else
    state o;
    uint depths[LAYERS];
    for (int i = 0; i < LAYERS; ++i) {
        uint there = depth_of(held, i), a = held.word[2 * i], b = held.word[2 * i + 1];
        bool front = depth <= there;
        depths[i] = front ? depth : there;
        o.word[2 * i] = front ? red_green : a;
        o.word[2 * i + 1] = front ? blue_through : b;
        depth = front ? there : depth;
        red_green = front ? a : red_green;
        blue_through = front ? b : blue_through;
    }
    layer last = unpacked(0u, o.word[2 * LAYERS - 2], o.word[2 * LAYERS - 1]);
    layer l = layers_blended(last, unpacked(0u, red_green, blue_through));
    o.word[2 * LAYERS - 2] = packHalf2x16(min(vec2(l.red, l.green), vec2(65504.0, 65504.0)));
    o.word[2 * LAYERS - 1] = packHalf2x16(vec2(min(l.blue, 65504.0), l.through));
#endif
    for (int i = 0; i < LAYERS / 2; ++i) {
        o.word[2 * LAYERS + i] = depths[2 * i] | (depths[2 * i + 1] << 16u);
    }
#if LAYERS & 1
    o.word[2 * LAYERS + LAYERS / 2] = depths[LAYERS - 1];
#endif
    return o;
}

layers all_of(state held) {
    layers o;
    for (int i = 0; i < LAYERS; ++i) {
        o.at[i] = unpacked(0u, held.word[2 * i], held.word[2 * i + 1]);
    }
    return o;
}
#else
layers all_of(state held) {
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

// What a pixel keeps once a fragment has come, z its depth as it is. Walks over the layers from the
// front; what comes out behind the last blends with it.
state inserted(state held, float z, float alpha, vec3 color) {
    layers l = all_of(held);
    float depth = BY_ENERGY == 1 ? 0.5 * z + 0.5 : z;
    layer coming = layer_of(depth, alpha, color.r, color.g, color.b, LEAST_ALPHA);
    for (int i = 0; i < LAYERS; ++i) {
        layer_pair both = layers_passed(l.at[i], coming);
        l.at[i] = both.front;
        coming = both.behind;
    }
#if BY_ENERGY
    more_layers more;
    for (int i = 0; i < LAYERS; ++i) more.at[i] = l.at[i];
    more.at[LAYERS] = coming;
    return packed(fewer(more));
#else
    l.at[LAYERS - 1] = layers_blended(l.at[LAYERS - 1], coming);
    return packed(l);
#endif
}
#endif

// Premultiplied colour and coverage: one layer over the other.
vec4 resolve_layers(state held) {
    layers l = all_of(held);
    vec4 sum = vec4(0.0, 0.0, 0.0, 1.0);
    for (int i = 0; i < LAYERS; ++i) {
        sum = vec4(vec3(l.at[i].red, l.at[i].green, l.at[i].blue) * sum.a + sum.rgb,
                   sum.a * l.at[i].through);
    }
    return vec4(sum.rgb, 1.0 - sum.a);
}
