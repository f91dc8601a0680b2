#version 450
// What of a light reaches points: a shadow map's sums between texels become a technique's state, a
// point a pixel, of which its own passes then make factors and transmittance.
//
//   DOUBLE     1
//   PASS       READ_MAP or REACH
//   NUMBERS    that a texel has
//   HARMONICS  of Fourier opacity; 0: moments
//   OPAQUE     0 or 1: texels hold moments of opaque casters' depth, without their sum
#include "arrays/bindings.glsl"
#include "kernels/dialect.glsl"
#include "kernels/elementary.h"
#if HARMONICS > 0
#include "kernels/fourier_opacity.h"
#endif

layout(local_size_x = GROUP) in;
uniform uint count;
uint thread() {
    return gl_GlobalInvocationID.y * gl_NumWorkGroups.x * gl_WorkGroupSize.x
           + gl_GlobalInvocationID.x;
}

uniform uint first_point;
uniform uint of_pixels;        // 1: points are pixels, in their order
uniform ivec2 picture;
uniform dvec4 view;            // as in meshes/surface.glsl
uniform double to_map[16];     // from where the eye sees a point: column, row, depth, what divides
uniform dvec2 bias;            // how far points are moved: this, and this times depth
uniform ivec2 texels;          // width and height of the map
uniform double map_near;
uniform double map_far;
layout(std430, binding = POINT_DEPTHS) readonly restrict buffer PointDepths { float point_depths[]; };
layout(std430, binding = POINT_RAYS) readonly restrict buffer PointRays { uint point_rays[]; };

// Column, row and depth on the map; column -1 where it does not show the point.
dvec3 place_of(uint i) {
    uint p = of_pixels == 1u ? i : point_rays[i];
    precise double z = double(point_depths[i]);
    precise double x = ((double(int(p) % picture.x) + 0.5) * view.x + view.y) * z;
    precise double y = ((double(int(p) / picture.x) + 0.5) * view.z + view.w) * z;
    precise double at[4];
    for (int k = 0; k < 4; ++k)
        at[k] = ((to_map[4 * k] * x + to_map[4 * k + 1] * y) + to_map[4 * k + 2] * z)
                + to_map[4 * k + 3];
    if (!(at[3] > 0.0)) return dvec3(-1.0, 0.0, 0.0);
    return dvec3(at[0] / at[3], at[1] / at[3], at[2] - (bias.x + bias.y * at[2]));
}

bool shown(dvec3 place) {
    return place.x >= 0.0 && place.y >= 0.0 && place.x <= double(texels.x)
           && place.y <= double(texels.y);
}

#if PASS == READ_MAP
layout(std430, binding = MAP_SUMS) readonly restrict buffer Sums { float sums[]; };
layout(std430, binding = POINT_ALPHAS) readonly restrict buffer PointAlphas { float point_alphas[]; };
layout(std430, binding = DEPTHS) writeonly restrict buffer Depths { double depths[]; };
layout(std430, binding = ALPHAS) writeonly restrict buffer Alphas { double alphas[]; };
layout(std430, binding = STATE) writeonly restrict buffer State { double state[]; };
layout(std430, binding = FACTORS) writeonly restrict buffer Factors { double factors[]; };
layout(std430, binding = ASKED) writeonly restrict buffer Rays { uint ray_of[]; };

void main() {
    uint at = thread();
    if (at >= count) return;
    dvec3 place = place_of(first_point + at);
    bool there = shown(place);
    float alpha = of_pixels == 1u ? float(1) : point_alphas[first_point + at];
    ray_of[at] = at;
    depths[at] = clamp(place.z, map_near, map_far);
    alphas[at] = alpha == float(1) ? 0.0 : double(alpha); // opaque ones are not on the map
    precise double held[NUMBERS];
    for (int k = 0; k < NUMBERS; ++k) held[k] = 0.0;
    if (there) {
        precise double left = floor(place.x - 0.5), top = floor(place.y - 0.5);
        precise double across = place.x - 0.5 - left, along = place.y - 0.5 - top;
        for (int corner = 0; corner < 4; ++corner) {
            int right = corner & 1, below = corner >> 1;
            precise double weight =
                (right == 1 ? across : 1.0 - across) * (below == 1 ? along : 1.0 - along);
            int column = clamp(int(left) + right, 0, texels.x - 1);
            int row = clamp(int(top) + below, 0, texels.y - 1);
            uint from = uint(row * texels.x + column) * uint(NUMBERS);
            for (int k = 0; k < NUMBERS; ++k) held[k] += weight * double(sums[from + uint(k)]);
        }
    }
#if HARMONICS > 0
    fourier_series s;
    s.mean = held[0];
    for (int k = 0; k < HARMONICS; ++k) {
        s.cosine[k] = held[1 + 2 * k];
        s.sine[k] = held[2 + 2 * k];
    }
    s = integrated(HARMONICS, s);
    state[uint(NUMBERS) * at] = held[0];
    factors[uint(NUMBERS) * at] = s.mean;
    for (int k = 0; k < HARMONICS; ++k) {
        factors[uint(NUMBERS) * at + uint(1 + 2 * k)] = s.cosine[k];
        factors[uint(NUMBERS) * at + uint(2 + 2 * k)] = s.sine[k];
    }
#elif OPAQUE
    for (int k = 0; k < NUMBERS; ++k) state[uint(NUMBERS + 1) * at + uint(k)] = held[k];
    state[uint(NUMBERS + 1) * at + uint(NUMBERS)] = there ? 1.0 : 0.0;
#else
    bool any = held[0] > 7.8886090522101181e-31; // 2^-100
    for (int k = 1; k < NUMBERS; ++k)
        state[uint(NUMBERS) * at + uint(k - 1)] = any ? held[k] / held[0] : 0.0;
    state[uint(NUMBERS) * at + uint(NUMBERS - 1)] = any ? held[0] : 0.0;
#endif
}

#else
layout(std430, binding = TOTALS) readonly restrict buffer Totals { double totals[]; };
layout(std430, binding = ANSWERS) readonly restrict buffer Seen { double seen[]; };
layout(std430, binding = REACHED) restrict buffer Reached { double reached[]; };
uniform int lights;
uniform int light_index;

void main() {
    uint at = thread();
    if (at >= count) return;
    dvec3 place = place_of(first_point + at);
    precise double T = seen[at];
#if OPAQUE
    T = clamp(1.0 - absorbance(1.0 - T), 0.0, 1.0); // exp(-share) to 1 - share
#else
    if (place.z > map_far) T = totals[4u * at];
#endif
    if (!shown(place) || place.z <= map_near) T = 1.0;
    uint to = (first_point + at) * uint(lights) + uint(light_index);
    reached[to] = reached[to] * T;
}
#endif
