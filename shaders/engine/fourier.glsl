// The circle of Fourier opacity maps: Jansen and Bavoil, "Fourier Opacity Mapping", I3D 2010.
// Absorbances A at depths d in [0, 1] are a density along the ray; its series is cut off:
//   -ln T(d) = a_0 d + sum over k of a_k sin(2 pi k d) / (pi k) + b_k (1 - cos(2 pi k d)) / (pi k)
// with a_k, b_k the sums of A cos(2 pi k d), A sin(2 pi k d). No factors: pass 2 reads the sums.
#include "engine/turns.glsl"

vec2 on_the_circle(float z) {
    float angle = 3.14159265 * (z + 1.0);
    return vec2(cos(angle), sin(angle));
}

// k pi times what a harmonic of order k adds.
float harmonic(vec2 ab, vec2 p) { return ab.x * p.y + ab.y * (1.0 - p.x); }

// What is let through to d in [0, 1], by the sums of harmonics and of those of one surface there.
// A series cut off overshoots at steps: what is in front is kept within what there is.
float transmittance_by(float total, float waves, float own_waves, float d, float alpha) {
    float own = EXCLUDE_SELF == 1 ? absorbance(alpha) : 0.0, own_share = 0.31830989 * own_waves + d;
    float in_front = total * d + 0.31830989 * waves - own * own_share;
    return exp2(-1.44269504 * clamp(in_front, 0.0, max(total - own, 0.0)));
}
