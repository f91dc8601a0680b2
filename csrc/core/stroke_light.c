/* Light on strokes, by the text that triangles are lit by. */
#define SCALAR double
#define LANES 2
#include "kernels/dialect.h"
#include "kernels/surface.h"

#include "core/strokes.h"

int moit_light_shares(const moit_stroke_raster *r, const double normal[3], double x, double y,
                      double *share) {
    const moit_lights *lights = &r->camera.lights;
    real n[3], light[3], right = K((2.0 * x / r->width - 1.0) / r->camera.scale[0]),
                         up = K((1.0 - 2.0 * y / r->height) / r->camera.scale[1]);
    for (int k = 0; k < 3; ++k) n[k] = K(normal[k]);
    for (int l = 0; l < lights->count; ++l) {
        for (int k = 0; k < 3; ++k) light[k] = K(lights->direction[l][k]);
        share[l] = facing_light(n, right, up, light)[0];
    }
    if (!lights->count) share[0] = lambert(n, right, up)[0];
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
