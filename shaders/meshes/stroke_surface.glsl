// What meshes/surface.glsl has of triangles, of strokes: a layer is drawn by the part it begins
// with.
#include "meshes/stroke_layers.glsl"

#if SHADOWED
// (.., lights)
layout(std430, binding = REACHED) readonly restrict buffer Reached { double reached[]; };
#endif

struct layer_point {
    double z;
    float alpha;
    double color[3];
    double share[MOST_LIGHTS];
};

struct pixel_of_triangle {
    bool there;
    layer_point at;
};

pixel_of_triangle covered_by(int i, ivec2 pixel, bool asks) {
    stroke_layer o;
    pixel_of_triangle c;
    c.there = layer_of(i, pixel, o);
    precise double covered = double(bits_of(o.covered));
    precise double samples = has(i, STROKE_SAMPLED) ? double(MOST_SAMPLES) : 1.0lf;
    precise double depth = o.depth / covered, alpha = o.alpha / samples;
    c.at.z = depth;
    c.at.alpha = float(min(alpha, 1.0lf));
    for (int k = 0; k < 3; ++k) {
        precise double shade = o.color[k] / covered;
        c.at.color[k] = shade;
    }
    for (int k = 0; k < MOST_LIGHTS; ++k) {
        precise double share = o.share[k] / covered;
        c.at.share[k] = share;
    }
    return c;
}

float alpha_of(int i, layer_point p) { return p.alpha; }

// at: its row of `reached`.
vec3 lit_color(int i, layer_point p, ivec2 pixel, uint at) {
    precise double lit[3];
    for (int k = 0; k < 3; ++k) {
        lit[k] = p.color[k];
        if (!has(i, STROKE_SOLID) || !has(i, STROKE_LIT)) continue;
        precise double light = 0.0lf;
        for (int l = 0; l < lights; ++l) {
            precise double share = p.share[l];
#if SHADOWED
            share = share * reached[at * uint(lights) + uint(l)];
#endif
            light += share * light_numbers[6 * l + 3 + k];
        }
        lit[k] *= lights > 0 ? thrown_back(light) : p.share[0];
    }
    return vec3(lit[0], lit[1], lit[2]);
}
