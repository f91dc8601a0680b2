#version 450
// From counts and keys to arrays of fragments, each pixel's in the order of triangles whatever
// order they came in.
//
//   DOUBLE      0
//   PASS        one of its own in arrays/bindings.glsl
//   SHADOWED    0 or 1, by the fragment
//   THICK       1: fragments have deviations; SHADE alone asks
//   WITH_SOLID  1: a pixel's first fragment is its opaque surface, if it has one
#include "arrays/bindings.glsl"
#include "kernels/dialect.glsl"

layout(local_size_x = GROUP) in;
uniform uint count; // of threads that have work

uint thread() {
    return gl_GlobalInvocationID.y * gl_NumWorkGroups.x * gl_WorkGroupSize.x
           + gl_GlobalInvocationID.x;
}

// The sum, or the greatest number where that is less.
uint sum_of(uint a, uint b) {
    uint sum = a + b;
    return sum < a ? ~0u : sum;
}

#if PASS == BEGIN || PASS == PLACE || PASS == OCCLUDER_FRAGMENTS \
    || PASS == SHADE || PASS == FARTHEST_OCCLUDER || PASS == OCCLUDER_DEPTHS
layout(binding = OCCLUDERS) uniform sampler2D occluders;
uniform float occluder_scale;
#if WITH_SOLID
uniform ivec2 listed_rows; // from the first to before the second
#endif
uint occluders_in(uint p, int width) {
#if WITH_SOLID
    ivec2 pixel = ivec2(int(p) % width, int(p) / width);
    if (pixel.y < listed_rows.x || pixel.y >= listed_rows.y) return 0u;
    return texelFetch(occluders, pixel, 0).x < 1.0 ? 1u : 0u;
#else
    return 0u;
#endif
}
#endif

#if PASS == BEGIN
uniform int width;
layout(std430, binding = OFFSETS) writeonly restrict buffer Counts { uint counts[]; }; // count
void main() {
    uint p = thread();
    if (p >= count) return;
    counts[p] = p + 1u < count ? occluders_in(p, width) : 0u; // one more than pixels
}

#elif PASS == SCAN
layout(std430, binding = RUN_NUMBERS) restrict buffer Numbers { uint numbers[]; };
layout(std430, binding = RUN_SUMS) writeonly restrict buffer Sums { uint sums[]; };
shared uint part[GROUP];
void main() {
    uint run = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    uint at = gl_LocalInvocationID.x, from = run * RUN + at * RUN_EACH, own = 0u;
    for (uint i = from; i < min(from + RUN_EACH, count); ++i) own = sum_of(own, numbers[i]);
    part[at] = own;
    barrier();
    uint before = 0u, all = 0u;
    for (uint k = 0u; k < GROUP; ++k) {
        if (k == at) before = all;
        all = sum_of(all, part[k]);
    }
    for (uint i = from; i < min(from + RUN_EACH, count); ++i) {
        uint number_here = numbers[i];
        numbers[i] = before;
        before = sum_of(before, number_here);
    }
    if (at == 0u && run * RUN < count) sums[run] = all;
}

#elif PASS == ADD
layout(std430, binding = RUN_NUMBERS) restrict buffer Numbers { uint numbers[]; };
layout(std430, binding = RUN_SUMS) readonly restrict buffer Sums { uint sums[]; };
void main() {
    uint i = thread();
    if (i >= count) return;
    numbers[i] = sum_of(numbers[i], sums[i / RUN]);
}

#elif PASS == PLACE
uniform int width;
layout(std430, binding = OFFSETS) readonly restrict buffer Offsets { uint offsets[]; };
layout(std430, binding = PLACES) writeonly restrict buffer Places { uint places[]; };
void main() {
    uint p = thread();
    if (p >= count) return;
    places[p] = offsets[p] + occluders_in(p, width);
}

#elif PASS == SHADE
#include "PRIMITIVE"
layout(std430, binding = OFFSETS) readonly restrict buffer Offsets { uint offsets[]; };
layout(std430, binding = DEPTHS) writeonly restrict buffer Depths { float depths[]; };
layout(std430, binding = ALPHAS) writeonly restrict buffer Alphas { float alphas[]; };
layout(std430, binding = COLORS) writeonly restrict buffer Colors { float colors[]; };
layout(std430, binding = RAYS) writeonly restrict buffer Rays { uint rays[]; }; // the pixel of each
layout(std430, binding = KEYS) readonly restrict buffer Keys { uvec2 keys[]; };
#if THICK
layout(std430, binding = DEVIATIONS) writeonly restrict buffer Deviations { float deviations[]; };
#endif
uniform uint first; // the triangles in the buffer: `held` from this one
uniform uint held;
void main() {
    uint i = thread();
    if (i >= count) return;
    uint key = keys[i].x, p = keys[i].y;
    // none where an opaque surface goes, and as yet none of another buffer's triangles
    if (key < first || key - first >= held) return;
    uint begin = offsets[p] + occluders_in(p, picture.x), end = offsets[p + 1u], to = begin;
    for (uint other = begin; other < end; ++other)
        if (keys[other].x < key) ++to;
    int drawn = int(key - first);
    ivec2 pixel = ivec2(int(p) % picture.x, int(p) / picture.x);
    pixel_of_triangle c = covered_by(drawn, pixel, false);
    vec3 color = lit_color(drawn, c.at, pixel, to);
    rays[to] = p;
    depths[to] = float(c.at.z);
    alphas[to] = alpha_of(drawn, c.at);
    colors[3u * to] = color.x;
    colors[3u * to + 1u] = color.y;
    colors[3u * to + 2u] = color.z;
#if THICK
    deviations[to] = deviation_of(drawn, pixel);
#endif
}

#else
uniform int width;
layout(binding = OCCLUDER_COLORS) uniform sampler2D occluder_colors;
#if PASS == FARTHEST_OCCLUDER
uniform ivec2 picture;
uniform int block_side;
uniform ivec2 blocks_there;
uniform ivec2 before; // pixels that the first block has beyond the picture, to the left and above
uniform int alternates; // 1: the nearest, where column and row add up to an odd number
layout(r32f, binding = BLOCK_OCCLUDERS) writeonly uniform image2D farthest;
#elif PASS == OCCLUDER_FRAGMENTS
layout(std430, binding = OFFSETS) readonly restrict buffer Offsets { uint offsets[]; };
layout(std430, binding = DEPTHS) writeonly restrict buffer Depths { float depths[]; };
layout(std430, binding = ALPHAS) writeonly restrict buffer Alphas { float alphas[]; };
layout(std430, binding = COLORS) writeonly restrict buffer Colors { float colors[]; };
layout(std430, binding = RAYS) writeonly restrict buffer Rays { uint rays[]; };
#elif PASS == BEHIND
layout(std430, binding = ASKED) writeonly restrict buffer Behind { double behind[]; };
#else
layout(std430, binding = ANSWERS) writeonly restrict buffer Answers { float answers[]; };
#endif
void main() {
    uint p = thread();
    if (p >= count) return;
#if PASS == FARTHEST_OCCLUDER
    ivec2 block = ivec2(int(p) % blocks_there.x, int(p) / blocks_there.x);
    ivec2 begin = max(block_side * block - before, 0);
    ivec2 end = min(block_side * (block + 1) - before, picture);
    float least = 1.0, most = 0.0;
    for (int y = begin.y; y < end.y; ++y)
        for (int x = begin.x; x < end.x; ++x) {
            float depth = texelFetch(occluders, ivec2(x, y), 0).x;
            least = min(least, depth);
            most = max(most, depth);
        }
    bool odd = ((block.x + block.y) & 1) == 1;
    imageStore(farthest, block, vec4(alternates == 1 && odd ? least : most));
#else
#if PASS == OCCLUDER_DEPTHS
    float away = texelFetch(occluders, ivec2(int(p) % width, int(p) / width), 0).x;
    answers[p] = away < 1.0 ? away / occluder_scale : 0.0;
    return;
#endif
    vec4 color = texelFetch(occluder_colors, ivec2(int(p) % width, int(p) / width), 0);
#if PASS == OCCLUDER_FRAGMENTS
    if (occluders_in(p, width) == 0u) return;
    uint to = offsets[p];
    rays[to] = p;
    depths[to] = texelFetch(occluders, ivec2(int(p) % width, int(p) / width), 0).x / occluder_scale;
    alphas[to] = 1.0;
    for (uint c = 0u; c < 3u; ++c) colors[3u * to + c] = color[c];
#elif PASS == BEHIND
    for (uint c = 0u; c < 3u; ++c) behind[3u * p + c] = double(color[c]);
#else
    if (color.a > 0.0) answers[4u * p + 3u] = 1.0;
#endif
#endif
}
#endif
