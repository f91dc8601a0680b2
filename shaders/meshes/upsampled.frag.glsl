#version 450
// What a smaller picture's targets hold, added to those of the whole picture: sums blend as "add",
// and so does a count, or products of what is let through as "multiply-complement".
//
//   DOUBLE       0
//   DEPTH_AWARE  0 or 1, of kernels/upsampling.h
//   MULTIPLIES   1: the second target multiplies up; 0: it adds up
#include "arrays/bindings.glsl"
#include "kernels/dialect.glsl"
#include "kernels/upsampling.h"

layout(binding = OCCLUDERS) uniform sampler2D occluders;              // their depth; 1: none
layout(binding = SMALL_OCCLUDERS) uniform sampler2D small_occluders; // of squares the farthest
layout(binding = SMALL_SHADE) uniform sampler2D small_shade;
layout(binding = SMALL_SECOND) uniform sampler2D small_second;

uniform ivec2 picture;      // pixels
uniform ivec2 blocks_there; // squares, each a pixel of the smaller picture
uniform int block_side;

layout(location = 0) out vec4 shade;
layout(location = 1) out vec4 second;

vec4 mean(sampler2D held, ivec2 low, ivec2 high, four_shares s) {
    vec4 upper = texelFetch(held, low, 0) * s.upper_left
                 + texelFetch(held, ivec2(high.x, low.y), 0) * s.upper_right;
    vec4 lower = texelFetch(held, ivec2(low.x, high.y), 0) * s.lower_left
                 + texelFetch(held, high, 0) * s.lower_right;
    return upper + lower;
}

float occluder_of(ivec2 square) { return texelFetch(small_occluders, square, 0).x; }

void main() {
    // as core/mixed_resolution.c has it: in half pixels from the middle of the first square
    ivec2 pixel = ivec2(gl_FragCoord.xy), beyond = blocks_there * block_side - picture;
    ivec2 twice = 2 * pixel + 1 + beyond - block_side, from = max(twice, 0);
    ivec2 low = from / (2 * block_side);
    vec2 share = vec2(from - 2 * block_side * low) / float(2 * block_side);
    ivec2 high = low + ivec2(twice.x < 0 ? 0 : 1, twice.y < 0 ? 0 : 1);
    low = min(low, blocks_there - 1);
    high = min(high, blocks_there - 1);
    four_shares s = bilinear_shares(share.x, share.y);
#if DEPTH_AWARE
    s = depth_aware_shares(s, texelFetch(occluders, pixel, 0).x, occluder_of(low),
                           occluder_of(ivec2(high.x, low.y)), occluder_of(ivec2(low.x, high.y)),
                           occluder_of(high));
#endif
    shade = mean(small_shade, low, high, s);
    second = mean(small_second, low, high, s);
#if MULTIPLIES
    second = 1.0 - second;
#endif
}
