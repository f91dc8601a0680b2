// Neural moment transparency: Tsopouridis, Vasilakis and Fudos, "Neural Moment Transparency",
// Eurographics Short Papers 2024. A network of 801 numbers, 7 - 32 - 16 - 1, reads transmittance
// off four moments of depth in [-1, 1] (equation 5, the scene's range), the absorbance, the number
// of fragments and their extent, which its pixel keeps. No factors: pass 2 reads the sums.
//
// A program brings its weights as `NETWORK`, 201 vec4 of a buffer: constants take compilers half a
// minute. A row has what one input counts in four outputs, or what these begin with.
#include "engine/common.glsl"

// 1: moments are of each pixel's own range, whose ends are words of 16 bits that a pass before all
// others finds; 0: of the scene's range, with extents of half floats beside them.
#ifndef OWN_RANGE
#define OWN_RANGE 0
#endif
#if OWN_RANGE == 0
// What half floats round extents by, at most.
const float BLUR = 0.00048828125;

// Added up: moments times absorbance; absorbance, count. Of half floats the greatest: -z, z; they
// begin at -1.
struct sums { vec4 target0; vec2 target1; vec2 target2; };
#else
// Twice what words of 16 bits round ends of [-1, 1] by, at most.
const float BLUR = 3.0517578e-5;

// Added up: moments times absorbance; absorbance, count.
struct sums { vec4 target0; vec2 target1; };

// Of words of 16 bits the greatest: how far z is from 1, and from -1, of 2.
struct extents { vec2 extent; };

// Rounded once: so a lone surface has one word for both.
extents extents_of(float depth) {
    float word = floor(32767.5 * warped(depth) + 32768.0);
    extents o;
    o.extent = vec2(65535.0 - word, word) / 65535.0;
    return o;
}

// From -1 to 1 between the ends of a pixel's fragments, 0 where these are one; -2 in front of them
// all, 2 behind.
float warped_within(extents e, float depth) {
    float z = warped(depth), nearest = 1.0 - 2.0 * e.extent.x, farthest = 2.0 * e.extent.y - 1.0;
    float whole = farthest - nearest, beside = (z - nearest) - (farthest - z);
    // ends of one word are apart by what rounds in floats
    float within = whole > 1.5e-5 ? clamp(beside / whole, -1.0, 1.0) : 0.0;
    float behind = z > farthest + BLUR ? 2.0 : within;
    return z < nearest - BLUR ? -2.0 : behind;
}
#endif

sums accumulate(float z, float alpha) {
    float a = absorbance(alpha), z2 = z * z;
    sums o;
    o.target0 = vec4(z, z2, z2 * z, z2 * z2) * a;
    o.target1 = vec2(a, 1.0);
#if OWN_RANGE == 0
    o.target2 = vec2(-z, z);
#endif
    return o;
}

// Four outputs, of which `o` is known, and what four inputs add by the weights from k on.
vec4 with_four(vec4 o, int k, vec4 a) {
    return NETWORK[k + 3] * a.w + (NETWORK[k + 2] * a.z
           + (NETWORK[k + 1] * a.y + (NETWORK[k] * a.x + o)));
}

// Four outputs of the first layer, rectified; seen: the fragment's feature, count, absorbance.
vec4 first_layer(int k, vec3 seen, vec4 moments) {
    vec4 o = NETWORK[k + 2] * seen.z + NETWORK[k + 3];
    o = NETWORK[k] * seen.x + (NETWORK[k + 1] * seen.y + o);
    return max(with_four(o, k + 4, moments), vec4(0.0));
}

float transmittance_of_sums(sums t, float z, float alpha) {
#if OWN_RANGE
    // ends are one where no fragment has a z but 0
    float nearest = -1.0, farthest = t.target0.y > 0.0 ? 1.0 : -1.0;
#else
    float nearest = -t.target2.x, farthest = t.target2.y;
#endif
    float least = exp2(-1.44269504 * (farthest - nearest));
    float power = exp2(1.44269504 * min(z - farthest, 0.0));
    float d = (power - least) / (1.0 - least);
    d = least < 1.0 ? clamp(d, 0.0, 1.0) : 0.0;
    vec3 seen = vec3(d, t.target1.y, t.target1.x);
    vec4 m = t.target0;
    vec4 a0 = first_layer(0, seen, m), a1 = first_layer(8, seen, m);
    vec4 a2 = first_layer(16, seen, m), a3 = first_layer(24, seen, m);
    vec4 a4 = first_layer(32, seen, m), a5 = first_layer(40, seen, m);
    vec4 a6 = first_layer(48, seen, m), a7 = first_layer(56, seen, m);
    float last = NETWORK[200].x;
    for (int j = 0; j < 4; ++j) {
        int k = 64 + 34 * j;
        vec4 low = with_four(with_four(NETWORK[k + 32], k, a0), k + 4, a1);
        vec4 half_way = with_four(with_four(low, k + 8, a2), k + 12, a3);
        vec4 high = with_four(with_four(half_way, k + 16, a4), k + 20, a5);
        vec4 o = with_four(with_four(high, k + 24, a6), k + 28, a7);
        last += dot(NETWORK[k + 33], max(o, vec4(0.0)));
    }
    float said = 1.0 / (1.0 + exp2(clamp(-1.44269504 * last, -115.0, 115.0)));
    // never less than what passes all fragments; that behind them all, and 1 in front of them
    float total = exp2(-1.44269504 * t.target1.x);
#if OWN_RANGE
    float in_front = z < -1.0 ? 1.0 : max(said, total);
    return z > 1.0 ? total : in_front;
#else
    float in_front = z < nearest - BLUR ? 1.0 : max(said, total);
    return z > farthest + BLUR ? total : in_front;
#endif
}

vec4 resolve(vec4 shaded_sum, sums t) { return covered(shaded_sum, t.target1.x); }
