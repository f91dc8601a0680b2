// Targets of blocks of RESOLUTION by RESOLUTION pixels, a texel each. Between the middles of blocks
// pixels read the four around them, bilinearly; beyond the outermost middles the nearest ones.
//
// A side of blocks in pixels.
#ifndef RESOLUTION
#define RESOLUTION 8
#endif

// How far a pixel's middle is from that of the first block, across and down, in halves of pixels.
vec2 beyond_first(vec2 pixel) {
    return max(2.0 * pixel + 1.0 - float(RESOLUTION), vec2(0.0));
}

// The texel above and to the left of where a pixel lies.
vec2 texel_before(vec2 pixel) { return floor(beyond_first(pixel) / (2.0 * float(RESOLUTION))); }

// Shares of that texel and of those to its right, below it, and below to its right.
vec4 shares_of_texels(vec2 pixel) {
    vec2 from_it = beyond_first(pixel) - 2.0 * float(RESOLUTION) * texel_before(pixel);
    vec2 s = from_it / (2.0 * float(RESOLUTION)), r = 1.0 - s;
    return vec4(r.x * r.y, s.x * r.y, r.x * s.y, s.x * s.y);
}

// Of four texels in that order.
vec4 four_weighed(vec4 a, vec4 b, vec4 c, vec4 d, vec4 share) {
    return a * share.x + b * share.y + c * share.z + d * share.w;
}
