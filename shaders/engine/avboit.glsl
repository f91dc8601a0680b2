// Adaptive voxels: Drobot, "Adaptive Voxel-Based Order-Independent Transparency", SIGGRAPH 2025.
// Blocks of pixels add up optical depth in slices that stand where anything is, by atomics; summed
// up from front to back that becomes the light behind each slice, in steps of 1 / 255.
//
// CODE_MOST  the largest code of a fragment in a slice; CODE_SCALE: how many are optical depth 1
// OF_MIDDLE  1: what a block adds up is drawn at its middle, to targets of blocks; 0: by all pixels
// CUBIC      1: light is a B-spline of 4 slices, and of 4 by 4 blocks where these have MANY pixels
#include "engine/common.glsl"
#include "engine/slice_places.glsl"
#include "engine/low_resolution.glsl"

// Fragments read light by so many slices nearer, so that what they added does not dim them.
#ifndef SLICE_BIAS
#define SLICE_BIAS 2.0
#endif

// Added up while fragments are shaded: colours; what is let through, which starts at 1 and is
// multiplied by 1 - target1.
struct sums { vec4 target0; float target1; };

uint blocks_across(uvec2 size) { return sides_in(size.x, uint(RESOLUTION)); }
uint blocks_down(uvec2 size) { return sides_in(size.y, uint(RESOLUTION)); }

// What a fragment adds to its block, as drawn at a place of targets.
void deposit(uvec2 place, uvec2 size, float z, float alpha) {
#if OF_MIDDLE
    uint block = place.y * blocks_across(size) + place.x;
#else
    uint block = place.y / uint(RESOLUTION) * blocks_across(size) + place.x / uint(RESOLUTION);
#endif
    stand s = stand_at(0u, place_of(z));
    float absorbed = absorbance(alpha);
    uint here = uint(voxel_code(absorbed * (1.0 - s.inside), CODE_SCALE, CODE_MOST));
    uint behind = uint(voxel_code(absorbed * s.inside, CODE_SCALE, CODE_MOST));
    uint at = block * uint(SLOTS) + s.slot;
    if (s.any && here > 0u) add_words(at, here);
    if (s.any && behind > 0u) add_words(at + 1u, behind);
}

// For each block, row by row. A slice with more than its bits hold lets nothing through.
void integrate(uint index, uvec2 size) {
    uint across = blocks_across(size);
    if (index < across * blocks_down(size)) {
        uint first = index * uint(SLOTS), sum = 0u, pixels = 1u;
        bool full = false;
#if !OF_MIDDLE
        uint left = index % across * uint(RESOLUTION), top = index / across * uint(RESOLUTION);
        pixels = min(uint(RESOLUTION), size.x - left) * min(uint(RESOLUTION), size.y - top);
#endif
        for (int k = 0; k < int(SLOTS); ++k) {
            uint kept = (load_words(first + uint(k)) + pixels / 2u) / pixels;
            sum = sum + kept;
            full = full || kept > uint(CODE_MOST);
            float light = floor(exp2(float(sum) * (-1.44269504 / CODE_SCALE)) * 255.0 + 0.5);
            store_words(first + uint(k), full ? 0u : uint(light));
        }
    }
}

float light_at(uint block, uint slot) {
    return float(load_words(block * uint(SLOTS) + min(slot, uint(SLOTS - 1))));
}

#if CUBIC
// What is dark in front of z.
float dark_at(uint block, uint slot, float z) {
    return z < 0.0 ? 0.0 : 255.0 - light_at(block, slot);
}

float read_at(uint block, stand s, float z) {
    float before = dark_at(block, max(s.slot, 1u) - 1u, z), here = dark_at(block, s.slot, z);
    float next = dark_at(block, s.slot + 1u, z), last = dark_at(block, s.slot + 2u, z);
    return voxel_cubic_light(1.0, before, here, next, last, s.any ? s.inside : 0.0);
}
#else
float read_at(uint block, stand s, float z) {
    float here = light_at(block, s.slot), next = light_at(block, s.any ? s.slot + 1u : s.slot);
    return voxel_light(z, here, next, s.inside);
}
#endif

#if CUBIC && MANY
// Of four blocks along a row or a column, with a place between the second and the third.
float spline_share(int k, float inside) {
    float rest = 1.0 - inside, outer = k == 0 ? rest : inside;
    float x = k == 1 ? inside : rest;
    return (k == 0 || k == 3 ? outer * outer * outer : 4.0 - x * x * (6.0 - 3.0 * x)) / 6.0;
}
#endif

// Of a pixel of the picture.
float transmittance(uvec2 pixel, uvec2 size, float z) {
    float place = 0.5 * z + 0.5 - SLICE_BIAS / float(load_places(uint(TRIALS)));
    stand s = stand_at(0u, slice_place_of(place, float(CELLS)));
    uint across = blocks_across(size), down = blocks_down(size);
#if CUBIC && MANY
    vec2 beyond = 2.0 * vec2(pixel) + 1.0 - float(RESOLUTION);
    vec2 low = floor(beyond / (2.0 * float(RESOLUTION)));
    vec2 inside = beyond / (2.0 * float(RESOLUTION)) - low;
    float dark = 0.0;
    for (int i = 0; i < 16; ++i) {
        int x = clamp(int(low.x) + i % 4 - 1, 0, int(across) - 1);
        int y = clamp(int(low.y) + i / 4 - 1, 0, int(down) - 1);
        float weight = spline_share(i % 4, inside.x) * spline_share(i / 4, inside.y);
        dark = read_at(uint(y) * across + uint(x), s, place) * weight + dark;
    }
    return max(1.0 - dark, 0.0);
#else
    vec2 low = texel_before(vec2(pixel));
    vec4 share = shares_of_texels(vec2(pixel));
    float sum = 0.0;
    for (int i = 0; i < 4; ++i) {
        uint x = min(uint(low.x) + (uint(i) & 1u), across - 1u);
        uint y = min(uint(low.y) + (uint(i) >> 1u), down - 1u);
        sum = sum + share[i] * read_at(y * across + x, s, place);
    }
#if CUBIC
    return max(1.0 - sum, 0.0);
#else
    return sum;
#endif
#endif
}

#include "engine/let_through.glsl"
