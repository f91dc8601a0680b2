// The nearest fragments of a pixel exactly, ours; behind them what moments of all fragments say
// once the nearest are taken out of their sums. Functions of moments end with _tail.
//
// LAYERS      how many are kept; WORDS of a pixel are what each brings, the nearest first
// SMALL_KEYS  1: a word, of 20 bits of depth and 12 of the root of 1 - alpha; 0: two words, of
//             depth and of alpha as they are
// NUMBERS     of moments: 2, 4, 6 or 8
// COVERING    the least bias of floats of which nothing is taken out
#include "engine/pixel_words.glsl"

#if SMALL_KEYS
uint key_of(float z, float alpha) {
    float word = floor((0.5 * z + 0.5) * 1048575.0 + 0.5);
    float root = floor(4095.0 * sqrt(1.0 - alpha) + 0.5);
    return (uint(1048575.0 - word) << 12) | uint(4095.0 - root);
}

float place_of_key(uint key) { return 2.0 * (1.0 - float(key >> 12) / 1048575.0) - 1.0; }

float alpha_of_key(uint key) {
    float root = float(4095u - (key & 4095u)) / 4095.0;
    return 1.0 - root * root;
}

// The nearest keys of a pixel are the greatest; a key goes where a lesser one is, which goes on.
void keep(uvec2 pixel, uvec2 size, float z, float alpha) {
    uint first = first_word(pixel, size), key = key_of(z, alpha);
    for (int k = 0; k < LAYERS; ++k) {
        uint held = max_words(first + uint(k), key);
        key = min(held, key);
    }
}

sums accumulate(float z, float alpha) {
    uint key = key_of(z, alpha);
    return accumulate_tail(place_of_key(key), alpha_of_key(key));
}

bool is_nearer(uvec2 key, uvec2 than) { return key.x > than.x; }
uvec2 key_at(uint first, int k) { return uvec2(load_words(first + uint(k)), 0u); }
uvec2 whole_key(float depth, float alpha) { return uvec2(key_of(warped(depth), alpha), 0u); }
float depth_within_key(uvec2 key) { return place_of_key(key.x); }
float alpha_within_key(uvec2 key) { return alpha_of_key(key.x); }
#else
// Nearness: depth's bits, turned so that what is nearer is the greater whole number. 0: none.
uint nearness(float depth) {
    uint bits = floatBitsToUint(depth);
    return (bits >> 31) == 1u ? bits : ~bits & 2147483647u;
}

// The nearest of a pixel are the greatest; one goes where a lesser one is, which goes on.
void keep(uvec2 pixel, uvec2 size, float depth) {
    uint first = first_word(pixel, size), nearest = nearness(depth);
    for (int k = 0; k < LAYERS; ++k) {
        uint held = max_words(first + uint(k), nearest);
        nearest = min(held, nearest);
    }
}

// Their opacities, each where its depth is kept: of several at one depth the greatest first.
void keep_rest(uvec2 pixel, uvec2 size, float depth, float alpha) {
    uint first = first_word(pixel, size), nearest = nearness(depth), rest = floatBitsToUint(alpha);
    for (int k = 0; k < LAYERS; ++k) {
        if (load_words(first + uint(k)) == nearest) {
            uint held = max_words(first + uint(LAYERS + k), rest);
            rest = min(held, rest);
        }
    }
}

sums accumulate(float z, float alpha) { return accumulate_tail(z, alpha); }

bool is_nearer(uvec2 key, uvec2 than) {
    return key.x > than.x || (key.x == than.x && key.y > than.y);
}
uvec2 key_at(uint first, int k) {
    return uvec2(load_words(first + uint(k)), load_words(first + uint(LAYERS + k)));
}
uvec2 whole_key(float depth, float alpha) {
    return uvec2(nearness(depth), floatBitsToUint(alpha));
}
float depth_within_key(uvec2 key) {
    return warped(uintBitsToFloat((key.x >> 31) == 1u ? key.x : ~key.x & 2147483647u));
}
float alpha_within_key(uvec2 key) { return uintBitsToFloat(key.y); }
#endif

// A part of a pixel's sums.
sums less(sums t, sums part) {
    sums o;
    o.target0 = t.target0 - part.target0;
    o.target1 = t.target1 - part.target1;
#if NUMBERS > 4
    o.target2 = t.target2 - part.target2;
#endif
    return o;
}

#if NUMBERS > 4
float absorbed_in(sums t) { return t.target2; }
#else
float absorbed_in(sums t) { return t.target1; }
#endif

// Sums whose moments lie within bounds, moved toward those of a safe distribution by a share.
sums made_safe(sums t, float b0, float share) {
    float safe = share * b0;
    sums o;
#if TRIGONOMETRIC
    o.target0 = clamp(t.target0, vec4(-b0), vec4(b0)) * (1.0 - share);
#elif NUMBERS == 2
    o.target0 = clamp(t.target0, vec2(-b0), vec2(b0)) * (1.0 - share) + vec2(0.0, V2) * safe;
#else
    o.target0 = clamp(t.target0, vec4(-b0), vec4(b0)) * (1.0 - share)
        + vec4(0.0, V2, 0.0, V4) * safe;
#endif
#if NUMBERS < 6
    o.target1 = b0;
#else
    o.target2 = b0;
#if TRIGONOMETRIC && NUMBERS == 6
    o.target1 = clamp(t.target1, vec2(-b0), vec2(b0)) * (1.0 - share);
#elif TRIGONOMETRIC
    o.target1 = clamp(t.target1, vec4(-b0), vec4(b0)) * (1.0 - share);
#elif NUMBERS == 6
    o.target1 = clamp(t.target1, vec2(-b0), vec2(b0)) * (1.0 - share) + vec2(0.0, V6) * safe;
#else
    o.target1 = clamp(t.target1, vec4(-b0), vec4(b0)) * (1.0 - share)
        + vec4(0.0, V6, 0.0, V8) * safe;
#endif
#endif
    return o;
}

// What is made once a pixel of sums over all: the nearest are taken out. What rounding leaves of
// them a bias outweighs, which grows as the rest is less of the whole. Less than a
// millionth is none.
factors factor(uvec2 pixel, uvec2 size, sums t) {
    uint first = first_word(pixel, size);
    float all = absorbed_in(t);
    sums rest = t;
    for (int k = 0; k < LAYERS; ++k) {
        uvec2 key = key_at(first, k);
        float alpha = key.x > 0u ? alpha_within_key(key) : 0.0;
        sums part = accumulate_tail(depth_within_key(key), alpha);
        rest = less(rest, part);
    }
    float left = absorbed_in(rest), b0 = left > 9.5367432e-7 * all ? left : 0.0;
    float bias = min(max(COVERING * all / max(b0, 1e-30), BIAS), 0.2);
    return factor_tail(made_safe(rest, b0, (bias - BIAS) / (1.0 - BIAS)));
}

// What reaches a fragment: of one that is kept in x, of any other in y; the other is 0. Those of
// one key are seen alike, as if in each order once.
vec2 transmittance(uvec2 pixel, uvec2 size, factors f, float depth, float alpha) {
    uint first = first_word(pixel, size);
    uvec2 own = whole_key(depth, alpha);
    bool is_behind = is_nearer(key_at(first, LAYERS - 1), own);
    float through = 1.0, alike = 1.0, some = 0.0, most = 0.0;
    for (int k = 0; k < LAYERS; ++k) {
        uvec2 key = key_at(first, k);
        bool same = key.x == own.x && key.y == own.y;
        float lets = key.x > 0u ? 1.0 - alpha_within_key(key) : 1.0;
        through = through * (is_behind || is_nearer(key, own) ? lets : 1.0);
        most = most + (same ? alike : 0.0);
        some = some + (same ? 1.0 : 0.0);
        alike = alike * (same ? lets : 1.0);
    }
    float tail = transmittance_tail(f, depth_within_key(own), alpha_within_key(own));
    return is_behind ? vec2(0.0, through * tail) : vec2(through * (most / max(some, 1.0)), 0.0);
}

// Both at once, for pixels of few fragments: no pass for factors.
vec2 transmittance_of_sums(uvec2 pixel, uvec2 size, sums t, float depth, float alpha) {
    return transmittance(pixel, size, factor(pixel, size, t), depth, alpha);
}

// The nearest count as they are; weights of all others are made to sum to what is left.
vec4 resolve(vec4 kept_sum, vec4 rest_sum, sums t) {
    float coverage = 1.0 - exp2(absorbed_in(t) * -1.44269504);
#if NORMALIZE
    float rest = max(coverage - kept_sum.a, 0.0) / max(rest_sum.a, 1e-30);
    return vec4(kept_sum.rgb + rest_sum.rgb * rest, max(coverage, kept_sum.a));
#else
    return vec4(kept_sum.rgb + rest_sum.rgb, max(coverage, kept_sum.a));
#endif
}
