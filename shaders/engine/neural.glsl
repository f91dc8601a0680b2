// Neural moment transparency: Tsopouridis, Vasilakis and Fudos, "Neural Moment Transparency",
// Eurographics Short Papers 2024. A network of 801 numbers, 7 - 32 - 16 - 1, reads transmittance
// off four moments of depth in [-1, 1] (equation 5, the scene's range), the absorbance, the number
// of fragments and their extent, which its pixel keeps. No factors: pass 2 reads the sums.
//
// A program may bring its own `NETWORK`, float[801]: layer by layer, output by output the weights
// of its inputs, then its bias; and define NETWORK_GIVEN. Let it be a buffer: compilers may take
// minutes for so many constants.
#include "engine/common.glsl"
#ifndef NETWORK_GIVEN
#include "engine/neural_network.glsl"
#endif

const float BLUR = 0.00048828125; // what half floats round extents by, at most

// Added up: moments times absorbance; absorbance, count. Of half floats the greatest: -z, z; they
// begin at -1.
struct sums { vec4 target0; vec2 target1; vec2 target2; };

sums accumulate(float z, float alpha) {
    float a = absorbance(alpha), z2 = z * z;
    sums o;
    o.target0 = vec4(z, z2, z2 * z, z2 * z2) * a;
    o.target1 = vec2(a, 1.0);
    o.target2 = vec2(-z, z);
    return o;
}

// Output j of the first layer, rectified; d: the fragment's feature, the others are its pixel's.
float first_layer(int j, float d, sums t) {
    int k = 8 * j;
    vec4 low = vec4(NETWORK[k], NETWORK[k + 1], NETWORK[k + 2], NETWORK[k + 7]);
    vec4 high = vec4(NETWORK[k + 3], NETWORK[k + 4], NETWORK[k + 5], NETWORK[k + 6]);
    return max(dot(low, vec4(d, t.target1.y, t.target1.x, 1.0)) + dot(high, t.target0), 0.0);
}

vec4 first_four(int j, float d, sums t) {
    return vec4(first_layer(j, d, t), first_layer(j + 1, d, t), first_layer(j + 2, d, t),
                first_layer(j + 3, d, t));
}

// Weights from k on.
vec4 weights_at(int k) {
    return vec4(NETWORK[k], NETWORK[k + 1], NETWORK[k + 2], NETWORK[k + 3]);
}

// Half of an output of the second layer: its weights from k on, sixteen outputs of the first.
float half_layer(int k, vec4 a, vec4 b, vec4 c, vec4 d) {
    return dot(weights_at(k), a) + dot(weights_at(k + 4), b)
           + (dot(weights_at(k + 8), c) + dot(weights_at(k + 12), d));
}

float transmittance_of_sums(sums t, float z, float alpha) {
    float nearest = -t.target2.x, farthest = t.target2.y;
    float least = exp2(-1.44269504 * (farthest - nearest));
    float power = exp2(1.44269504 * min(z - farthest, 0.0));
    float d = (power - least) / (1.0 - least);
    d = least < 1.0 ? clamp(d, 0.0, 1.0) : 0.0;
    vec4 a0 = first_four(0, d, t), a1 = first_four(4, d, t);
    vec4 a2 = first_four(8, d, t), a3 = first_four(12, d, t);
    vec4 a4 = first_four(16, d, t), a5 = first_four(20, d, t);
    vec4 a6 = first_four(24, d, t), a7 = first_four(28, d, t);
    float last = NETWORK[800];
    for (int j = 0; j < 16; ++j) {
        int k = 256 + 33 * j;
        float sum = half_layer(k, a0, a1, a2, a3) + half_layer(k + 16, a4, a5, a6, a7);
        last += NETWORK[784 + j] * max(sum + NETWORK[k + 32], 0.0);
    }
    float said = 1.0 / (1.0 + exp2(clamp(-1.44269504 * last, -115.0, 115.0)));
    // never less than what passes all fragments; that behind them all, and 1 in front of them
    float total = exp2(-1.44269504 * t.target1.x);
    float in_front = z < nearest - BLUR ? 1.0 : max(said, total);
    return z > farthest + BLUR ? total : in_front;
}

vec4 resolve(vec4 shaded_sum, sums t) { return covered(shaded_sum, t.target1.x); }
