// The strongest fragments of a pixel occlude exactly, wherever they lie, ours. Of all others a
// pixel adds up six Chebyshev polynomials of their place in its own extent, in half floats; between
// the bounds that these moments prove a network decides.
//
// ANCHORS  how many are kept; NETWORK: float[169], as that of bounded6.glsl
#define OUTWARD_ENDS
#define SUMS_ARE_WITHIN
#include "engine/common.glsl"
#include "engine/kept_keys.glsl"
#include "engine/pairs.glsl"
#include "engine/storage.glsl"
#include "engine/roots.glsl"
#include "engine/rules3.glsl"

#define EACH 11
#include "engine/bounded_share.glsl"

// How much of a safe distribution outweighs rounding (MBOIT 4.1).
// Its even moments are V2, V4 and V6.
#ifndef BIAS
#define BIAS 1e-3
#endif

// What outweighs rounding to half floats by itself.
const float PUBLISHED_BIAS = 2e-3;

// Added up, of what is not kept: polynomials 1 to 6 times absorbance; absorbance.
struct sums { vec4 target0; vec2 target1; float target2; };

#include "engine/six_moments.glsl"
#include "engine/bounded6_factors.glsl"

own_extent extent_of(uint first) {
    uint begins = 65535u - load_words(first + uint(ANCHORS));
    return extent_of_words(float(begins), float(load_words(first + uint(ANCHORS + 1))));
}

// The opacity of a fragment among those that are not kept: of one that is none.
float rest_of(uint first, float z, float alpha) {
    return is_kept(key_of(z, alpha), KEY_AT(first, ANCHORS - 1)) ? 0.0 : alpha;
}

sums accumulate(uvec2 pixel, uvec2 size, float z, float alpha) {
    uint first = first_word(pixel, size);
    float a = absorbance(rest_of(first, z, alpha)), x = depth_within(extent_of(first), z);
    float t1 = a * x, t2 = 2.0 * (t1 * x) - a, t3 = 2.0 * (t2 * x) - t1;
    float t4 = 2.0 * (t3 * x) - t2, t5 = 2.0 * (t4 * x) - t3;
    sums o;
    o.target0 = vec4(t1, t2, t3, t4);
    o.target1 = vec2(t5, 2.0 * (t5 * x) - t4);
    o.target2 = a;
    return o;
}

// Sums of powers, from those of polynomials, which rounding may have made larger than absorbance.
sums powers_of_sums(sums t) {
    float b0 = t.target2;
    vec4 p = clamp(t.target0, vec4(-b0), vec4(b0));
    vec2 q = clamp(t.target1, vec2(-b0), vec2(b0));
    sums o;
    o.target0 = vec4(p.x, 0.5 * (p.y + b0), 0.25 * (p.z + 3.0 * p.x),
                     0.125 * (p.w + (4.0 * p.y + 3.0 * b0)));
    o.target1 = vec2(0.0625 * (q.x + (5.0 * p.z + 10.0 * p.x)),
                     0.03125 * (q.y + (6.0 * p.w + (15.0 * p.y + 10.0 * b0))));
    o.target2 = b0;
    return o;
}

factors factor(uvec2 pixel, uvec2 size, sums t) {
    own_extent e = extent_of(first_word(pixel, size));
    return factor_within(powers_of_sums(t), 0.5 * (e.farthest - e.nearest));
}

float transmittance(uvec2 pixel, uvec2 size, factors f, float z, float alpha) {
    uint first = first_word(pixel, size);
    float word = word_of(z), kept = 0.0, x = depth_within(extent_of(first), z);
    for (int k = 0; k < ANCHORS; ++k) {
        whole_key key = KEY_AT(first, k);
        kept = kept + (word_of_key(key) < word ? absorbance_of_key(key) : 0.0);
    }
    vec2 mass = mass3_at(f.factor0.xyz, f.factor1.xyz, f.factor1.w, x);
    float beside = ((x - f.factor4.x) - f.factor4.y) * f.factor4.z;
    float through = bounded_through(mass, f.factor0.w, beside, rest_of(first, z, alpha), f.factor2,
                                    f.factor3);
    return (f.factor0.w > 0.0 ? through : 1.0) * exponential(-kept);
}

// Both at once, for pixels of few fragments: no pass for factors.
float transmittance_of_sums(uvec2 pixel, uvec2 size, sums t, float z, float alpha) {
    return transmittance(pixel, size, factor(pixel, size, t), z, alpha);
}

#include "engine/multiplied_up.glsl"
