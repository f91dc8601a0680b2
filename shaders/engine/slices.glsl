// Slices of optical depth, ours: pixels, or blocks of them, add up whole numbers by atomics in
// slices that stand where anything is. What is in front of a fragment is read in the middle of
// slices, and its own share, known exactly, is taken out; transmittance is the same in any order.
//
// CODE_MOST   the most of a slice; CODE_SCALE: how many steps are optical depth 1
// OF_BLOCKS   1: blocks of pixels share slices; 0: pixels have their own
// OWN_TOTAL   1, of blocks: what is read of them is scaled to each pixel's own total; 0: it is not
#include "engine/common.glsl"
#include "engine/slice_places.glsl"
#include "engine/low_resolution.glsl"

#if OWN_TOTAL
// Added up as fragments are: absorbance of a pixel.
struct sums { float target0; };

sums accumulate(float z, float alpha) {
    sums o;
    o.target0 = absorbance(alpha);
    return o;
}
#else
// Added up while fragments are shaded: colours; what is let through, which starts at 1 and is
// multiplied by 1 - target1.
struct sums { vec4 target0; float target1; };
#endif

uint blocks_across(uvec2 size) { return sides_in(size.x, uint(RESOLUTION)); }
uint blocks_down(uvec2 size) { return sides_in(size.y, uint(RESOLUTION)); }

// Whole steps of a fragment, of which those of thin layers count right in the mean of pixels.
float code_of(uvec2 pixel, slice_place p, float alpha) {
    float threshold = slice_threshold(pixel.y, pixel.x, p.cell);
    return slice_code(absorbance(alpha), CODE_SCALE, CODE_MOST, threshold);
}

// What a fragment adds to its pixel, or to its block.
void deposit(uvec2 pixel, uvec2 size, float z, float alpha) {
    slice_place p = place_of(z);
    stand s = stand_at(square_of(pixel, size), p);
    float code = code_of(pixel, p, alpha), here = slice_near(code, s.inside);
    uint block = pixel.y / uint(RESOLUTION) * blocks_across(size) + pixel.x / uint(RESOLUTION);
    uint at = block * uint(SLOTS) + s.slot;
    if (s.any && here > 0.0) add_words(at, uint(here));
    if (s.any && code > here) add_words(at + 1u, uint(code - here));
}

// For each pixel or block, row by row: sums up to each slice, of which none has more than its most.
void integrate(uint index, uvec2 size) {
    uint across = blocks_across(size);
    if (index < across * blocks_down(size)) {
        uint first = index * uint(SLOTS), sum = 0u, pixels = 1u;
#if OF_BLOCKS
        uint left = index % across * uint(RESOLUTION), top = index / across * uint(RESOLUTION);
        pixels = min(uint(RESOLUTION), size.x - left) * min(uint(RESOLUTION), size.y - top);
#endif
        for (int k = 0; k < int(SLOTS); ++k) {
            uint kept = (load_words(first + uint(k)) + pixels / 2u) / pixels;
            sum = sum + min(kept, uint(CODE_MOST));
            store_words(first + uint(k), sum);
        }
    }
}

// What is in slices before the k-th.
float sum_before(uint block, uint k) {
    float sum = float(load_words(block * uint(SLOTS) + max(k, 1u) - 1u));
    return k == 0u ? 0.0 : sum;
}

// Twice what is in front of a place of a block, in steps.
float twice_in_front(uint block, stand s) {
    uint more = s.any ? 1u : 0u;
    return slice_depth(sum_before(block, s.slot), sum_before(block, s.slot + more),
                       sum_before(block, s.slot + more + more), s.inside);
}

#if OF_BLOCKS
#if OWN_TOTAL
// Those blocks count more whose totals are as the pixel's own.
float as_near(float total, float own) {
    float apart = 8.0 * (total - own) / (max(total, own) + 0.0009765625);
    return 1.0 / (1.0 + apart * apart) + 0.0009765625;
}

float transmittance(uvec2 pixel, uvec2 size, float z, float alpha, sums held) {
#else
float transmittance(uvec2 pixel, uvec2 size, float z, float alpha) {
#endif
    slice_place p = place_of(z);
#if SQUARE == 0
    stand s = stand_at(0u, p);
#endif
    vec2 low = texel_before(vec2(pixel));
    vec4 share = shares_of_texels(vec2(pixel));
    uint across = blocks_across(size), down = blocks_down(size);
    float twice = 0.0, total = 0.0, all = 0.0;
    for (int i = 0; i < 4; ++i) {
        uint x = min(uint(low.x) + (uint(i) & 1u), across - 1u);
        uint y = min(uint(low.y) + (uint(i) >> 1u), down - 1u), block = y * across + x;
#if SQUARE > 0
        stand s = stand_at(square_of(uvec2(x * uint(RESOLUTION), y * uint(RESOLUTION)), size), p);
#endif
        float of_block = sum_before(block, uint(SLOTS)) / CODE_SCALE, weight = share[i];
#if OWN_TOTAL
        weight = weight * as_near(of_block, held.target0);
#endif
        total = total + weight * of_block;
        twice = twice + weight * twice_in_front(block, s);
        all = all + weight;
    }
#if OWN_TOTAL
    float own = held.target0;
#else
    float own = total / all;
#endif
    return exponential(-block_absorbance(twice / all, 0.5 / CODE_SCALE, total / all, own,
                                         absorbance(alpha)));
}
#else
float transmittance(uvec2 pixel, uvec2 size, float z, float alpha) {
    slice_place p = place_of(z);
    stand s = stand_at(square_of(pixel, size), p);
    float code = code_of(pixel, p, alpha), here = slice_near(code, s.inside);
    float twice = twice_in_front(pixel.y * size.x + pixel.x, s);
    float own = slice_own(here, code, s.inside);
    return exponential(-slice_absorbance(twice, own, 0.5 / CODE_SCALE));
}
#endif

#if OWN_TOTAL
vec4 resolve(vec4 shaded_sum, sums t) { return covered(shaded_sum, t.target0); }
#else
#include "engine/let_through.glsl"
#endif
