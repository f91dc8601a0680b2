// What a triangle is in a pixel: how far, how opaque, and its colour in the light. In double, as in
// core/stages/raster.h, whatever `number` is.
//
// What this text has passes call, of any kind of primitive (moit.gpu.primitives):
// pixel_of_triangle,
// covered_by, alpha_of, lit_color, asked_pixel, and the uniforms picture, block_side, blocks_there.
//
//   SHADOWED   0 or 1: what is drawn knows what of each light comes there
#include "kernels/options.h"
#include "meshes/triangles.glsl"
#include "arrays/begin_double.glsl"
#include "kernels/surface.h" // in double
#if TEXTURED
layout(binding = TEXELS) uniform sampler2D texels; // of all images, in rows of MOST_SIDE
vec4 texel_of(int at) { return texelFetch(texels, ivec2(at % MOST_SIDE, at / MOST_SIDE), 0); }
#define TEXEL_NUMBER(from, at, channel) double(texel_of((from) + int(at))[channel])
#include "kernels/texture.h" // in double
#endif
#include "arrays/end_double.glsl"

uniform double nearest;  // z of what is seen
uniform double farthest;
uniform dvec4 view;      // a pixel's direction: (x, y) view.xz + view.yw
uniform int lights;      // how many there are; 0: one that kernels/surface.h has
uniform double light_numbers[6 * MOST_LIGHTS]; // of each where it travels and its colour

#if SHADOWED
// (.., lights)
layout(std430, binding = REACHED) readonly restrict buffer Reached { double reached[]; };
#endif

struct edge_rule {
    double dx;
    double dy;
    double at; // of the middle of pixel (0, 0), with the bias
    double bias;
};

edge_rule edge_of(int i, int from, int to) {
    int whole_x = triangles[i].x[to] - triangles[i].x[from];
    int whole_y = triangles[i].y[to] - triangles[i].y[from];
    precise edge_rule e;
    e.bias = whole_y < 0 || (whole_y == 0 && whole_x > 0) ? 0.0lf : -1.0lf;
    precise double dx = double(whole_x), dy = double(whole_y);
    e.dx = dx * 256.0lf;
    e.dy = dy * 256.0lf;
    e.at = dx * double(128 - triangles[i].y[from]) - dy * double(128 - triangles[i].x[from]) + e.bias;
    return e;
}

double value_of(edge_rule e, ivec2 pixel) {
    precise double value = (e.at + e.dx * double(pixel.y)) - double(pixel.x) * e.dy;
    return value;
}

#if TEXTURED
// What the image is there, and in alpha that of the corners, too: sample_stage of
// core/stages/raster.h.
texel image_at(int i, surface_point p) {
    precise double area = double(triangles[i].x[1] - triangles[i].x[0])
                              * double(triangles[i].y[2] - triangles[i].y[0])
                          - double(triangles[i].y[1] - triangles[i].y[0])
                                * double(triangles[i].x[2] - triangles[i].x[0]);
    precise double pixel = 256.0lf / area;
    double columns = double(triangles[i].columns), rows = double(triangles[i].rows);
    precise double u[3], v[3], inverse_z[3];
    for (int k = 0; k < 3; ++k) {
        u[k] = triangles[i].u[k];
        v[k] = triangles[i].v[k];
        inverse_z[k] = triangles[i].inverse_z[k];
    }
    precise double across =
        square_of_span(p, inverse_z, double(triangles[i].y[2] - triangles[i].y[0]) * pixel,
                       double(triangles[i].y[0] - triangles[i].y[1]) * pixel, u, v, columns, rows);
    precise double along =
        square_of_span(p, inverse_z, double(triangles[i].x[0] - triangles[i].x[2]) * pixel,
                       double(triangles[i].x[1] - triangles[i].x[0]) * pixel, u, v, columns, rows);
    precise texel o =
        texel_at(triangles[i].first, triangles[i].filtering, triangles[i].wrap_u,
                 triangles[i].wrap_v, columns, rows, interpolated(p, u[0], u[1], u[2]),
                 interpolated(p, v[0], v[1], v[2]), max(across, along));
    precise double a = interpolated(p, triangles[i].alpha[0], triangles[i].alpha[1],
                                    triangles[i].alpha[2]);
    o.channel[3] = clamp(clamp(a, 0.0lf, 1.0lf) * o.channel[3], 0.0lf, 1.0lf);
    return o;
}
#endif

// A triangle in a pixel.
struct pixel_of_triangle {
    bool there; // it covers the pixel's middle, and is neither too near nor too far
    surface_point at;
};

// asks: whether it may not cover the pixel.
pixel_of_triangle covered_by(int i, ivec2 pixel, bool asks) {
    edge_rule second = edge_of(i, 2, 0), third = edge_of(i, 0, 1);
    precise double second_value = value_of(second, pixel), third_value = value_of(third, pixel);
    precise pixel_of_triangle c;
    c.there = true;
    if (asks) {
        double first_value = value_of(edge_of(i, 1, 2), pixel);
        c.there = first_value >= 0.0lf && second_value >= 0.0lf && third_value >= 0.0lf;
    }
    precise double area = double(triangles[i].x[1] - triangles[i].x[0])
                              * double(triangles[i].y[2] - triangles[i].y[0])
                          - double(triangles[i].y[1] - triangles[i].y[0])
                                * double(triangles[i].x[2] - triangles[i].x[0]);
    precise double scale = 1.0lf / area;
    c.at = point_of_surface((second_value - second.bias) * scale,
                            (third_value - third.bias) * scale, triangles[i].inverse_z);
    c.there = c.there && c.at.z >= nearest && c.at.z <= farthest;
#if TEXTURED
    if (c.there && triangles[i].masked == 1)
        c.there = image_at(i, c.at).channel[3] >= triangles[i].cutoff;
#endif
    return c;
}

float alpha_of(int i, surface_point p) {
#if TEXTURED
    return triangles[i].masked == 1 ? 1.0 : float(image_at(i, p).channel[3]);
#endif
    precise double a = interpolated(p, triangles[i].alpha[0], triangles[i].alpha[1],
                                    triangles[i].alpha[2]);
    return float(clamp(a, 0.0lf, 1.0lf));
}

// at: its row of `reached`.
vec3 lit_color(int i, surface_point p, ivec2 pixel, uint at) {
    double normal[3];
    for (int k = 0; k < 3; ++k)
        normal[k] = interpolated(p, triangles[i].normal[k], triangles[i].normal[3 + k],
                                 triangles[i].normal[6 + k]);
    precise double right = (double(pixel.x) + 0.5lf) * view.x + view.y;
    precise double up = (double(pixel.y) + 0.5lf) * view.z + view.w;
    precise double light[3], all = lambert(normal, right, up);
    for (int k = 0; k < 3; ++k) light[k] = lights > 0 ? 0.0lf : all;
    for (int light_index = 0; light_index < lights; ++light_index) {
        double along[3];
        for (int k = 0; k < 3; ++k) along[k] = light_numbers[6 * light_index + k];
        precise double share = facing_light(normal, right, up, along);
#if SHADOWED
        share = share * reached[at * uint(lights) + uint(light_index)];
#endif
        for (int k = 0; k < 3; ++k) light[k] += share * light_numbers[6 * light_index + 3 + k];
    }
    for (int k = 0; k < 3 && lights > 0; ++k) light[k] = thrown_back(light[k]);
    precise double lit[3];
    for (int k = 0; k < 3; ++k)
        lit[k] = light[k] * interpolated(p, triangles[i].color[k], triangles[i].color[3 + k],
                                      triangles[i].color[6 + k]);
#if TEXTURED
    texel image = image_at(i, p);
    for (int k = 0; k < 3; ++k) {
        if (triangles[i].lit == 0)
            lit[k] = interpolated(p, triangles[i].color[k], triangles[i].color[3 + k],
                                  triangles[i].color[6 + k]);
        lit[k] = lit[k] * image.channel[k];
    }
#endif
    return vec3(lit[0], lit[1], lit[2]);
}
