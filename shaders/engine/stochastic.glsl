// Stochastic transparency: Enderton, Sintorn, Shirley and Luebke, TVCG 17(8), 2011. Fragments cover
// samples of a pixel at random; samples keep the depth of the nearest that covers them, and
// fragments are added where they are no farther.
#include "engine/dialect.glsl"
#include "kernels/hashing.h"
#include "kernels/stochastic.h"

// Samples of a pixel.
#ifndef SAMPLES
#define SAMPLES 8
#endif
// 1: a fragment covers its share of samples, rounded up or down by chance; 0: each by itself.
#ifndef STRATIFIED
#define STRATIFIED 1
#endif
// 1: colours are scaled so that their weights sum to what is covered.
#ifndef NORMALIZE
#define NORMALIZE 1
#endif

// What is let through, which starts at 1 and is multiplied by 1 - target0.
struct sums { float target0; };

#include "engine/covered_samples.glsl"

sums accumulate(float depth, float alpha) {
    sums o;
    o.target0 = alpha;
    return o;
}

// What is added to each sample that a fragment is no farther than, in the mean over samples.
vec4 shaded(vec3 color, float alpha, float through) {
    float weight = alpha * through;
    return vec4(color * weight, weight);
}

// Premultiplied colour and coverage, of the mean over samples.
vec4 resolve(vec4 shaded_sum, sums t) {
    float covers = 1.0 - t.target0;
    float scale = NORMALIZE == 1 ? covers / max(shaded_sum.a, 1e-30) : 1.0;
    return vec4(shaded_sum.rgb * scale, covers);
}
