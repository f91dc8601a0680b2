/* Light on strokes, by the text that triangles are lit by. */
#define SCALAR double
#define LANES 2
#include "kernels/dialect.h"
#include "kernels/strokes.h"
#include "kernels/surface.h"

#include "core/strokes.h"

int moit_light_shares(const moit_stroke_raster *r, const moit_screen_stroke *s, double met_share,
                      double rank, double x, double y, double *share) {
    const moit_lights *lights = &r->camera.lights;
    const moit_stroke_sight *sight = &r->sight;
    stroke_balls balls;
    for (int k = 0; k < 6; ++k) balls.at[k] = K(s->at[k]);
    const stroke_point point = {.share = K(met_share), .rank = K(rank)};
    stroke_normal normal =
        normal_of_stroke(balls, point, K(sight->slope[0] + x * sight->slope_of_one[0]),
                         K(sight->slope[1] + y * sight->slope_of_one[1]));
    real light[3], right = K((2.0 * x / r->width - 1.0) / r->camera.scale[0]),
                   up = K((1.0 - 2.0 * y / r->height) / r->camera.scale[1]);
    for (int l = 0; l < lights->count; ++l) {
        for (int k = 0; k < 3; ++k) light[k] = K(lights->direction[l][k]);
        share[l] = facing_light(normal.along, right, up, light)[0];
    }
    if (!lights->count) share[0] = lambert(normal.along, right, up)[0];
    return lights->count ? lights->count : 1;
}

void moit_lit_color(const moit_stroke_raster *r, const double *share, double color[3]) {
    const moit_lights *lights = &r->camera.lights;
    for (int k = 0; k < 3; ++k) {
        double light = 0.0;
        for (int l = 0; l < lights->count; ++l) light += share[l] * lights->color[l][k];
        color[k] *= lights->count ? thrown_back(K(light))[0] : share[0];
    }
}
