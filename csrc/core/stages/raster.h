/* Stages of the rasteriser, in double only: edges are exact integers there. */

#ifdef RULES
#include "core/raster.h"
#include "kernels/surface.h"
#include "kernels/texture.h"

/* An edge from (x0, y0) to (x1, y1) is positive on its right-hand side (y points down). What lies
 * on it belongs to the triangle for a top or left edge only: so each pixel of a mesh is drawn
 * once. */
typedef struct {
    double dx, dy, at; /* at: in the middle of pixel (0, 0), with the rule's bias */
    double bias;
} edge;

static edge edge_of(const moit_projected_triangle *t, int from, int to) {
    double dx = t->x[to] - t->x[from], dy = t->y[to] - t->y[from];
    double middle = MOIT_SUBPIXELS / 2, bias = dy < 0.0 || (dy == 0.0 && dx > 0.0) ? 0.0 : -1.0;
    return (edge){.dx = dx * MOIT_SUBPIXELS,
                  .dy = dy * MOIT_SUBPIXELS,
                  .at = dx * (middle - t->y[from]) - dy * (middle - t->x[from]) + bias,
                  .bias = bias};
}

/* A bit for each lane, from the first. */
FN unsigned lanes_where(truth t) {
    unsigned found = 0;
    for (int k = 0; k < LANES; ++k) found |= (unsigned)(t[k] & 1) << k;
    return found;
}

static int cover_stage(const moit_projected_triangle *t, int left, int top, int right, int bottom,
                       moit_covered *out) {
    edge e[3] = {edge_of(t, 1, 2), edge_of(t, 2, 0), edge_of(t, 0, 1)};
    double area = (double)(t->x[1] - t->x[0]) * (t->y[2] - t->y[0])
                  - (double)(t->y[1] - t->y[0]) * (t->x[2] - t->x[0]);
    const real scale = K(1.0 / area);
    real inverse_z[3], lane;
    for (int k = 0; k < 3; ++k) inverse_z[k] = K(t->inverse_z[k]);
    int_lanes at_lane;
    for (int k = 0; k < LANES; ++k) lane[k] = at_lane[k] = k;
    int count = 0;
    for (int y = top; y < bottom; ++y) {
        real row[3];
        for (int k = 0; k < 3; ++k) row[k] = K(e[k].at + e[k].dx * y);
        for (int x = left; x < right;) {
            real column = K(x) + lane, value[3];
            for (int k = 0; k < 3; ++k) value[k] = row[k] - column * K(e[k].dy);
            unsigned in = lanes_where(BOTH(BOTH(value[0] >= 0.0, value[1] >= 0.0),
                                           BOTH(value[2] >= 0.0, column < K(right))));
            if (!in) {
                x += LANES;
                continue;
            }
            int first = __builtin_ctz(in);
            if (first) { /* what a row covers are neighbours: now they begin with the first lane */
                x += first;
                continue;
            }
            surface_point p = point_of_surface((value[1] - K(e[1].bias)) * scale,
                                               (value[2] - K(e[2].bias)) * scale, inverse_z);
            store(out->x + count, column);
            store(out->y + count, K(y));
            store(out->second + count, p.second);
            store(out->third + count, p.third);
            store(out->z + count, p.z);
            int_lanes place =
                at_lane + ((y % MOIT_RASTER_TILE) * MOIT_RASTER_TILE + x % MOIT_RASTER_TILE);
            memcpy(out->place + count, &place, sizeof place);
            int those = __builtin_ctz(~in);
            count += those;
            if (those < LANES) break;
            x += LANES;
        }
    }
    return count;
}

static void shade_stage(int n, const moit_corners *c, const moit_covered *at, const double view[4],
                        const moit_lights *lights, const double *reached, double *color,
                        double *alpha) {
    for (int i = 0; i < n; i += LANES) {
        surface_point p = {load(at->second + i), load(at->third + i), load(at->z + i)};
        real normal[3], right = (load(at->x + i) + 0.5) * K(view[0]) + K(view[1]),
                        up = (load(at->y + i) + 0.5) * K(view[2]) + K(view[3]);
        for (int k = 0; k < 3; ++k)
            normal[k] = interpolated(p, K(c->normal[0][k]), K(c->normal[1][k]), K(c->normal[2][k]));
        real light[3], all = lambert(normal, right, up);
        for (int k = 0; k < 3; ++k) light[k] = lights->count ? K(0.0) : all;
        for (int light_index = 0; light_index < lights->count; ++light_index) {
            real along[3];
            for (int k = 0; k < 3; ++k) along[k] = K(lights->direction[light_index][k]);
            real share = facing_light(normal, right, up, along);
            if (reached) share = share * load(reached + light_index * MOIT_REACHED + i);
            for (int k = 0; k < 3; ++k)
                light[k] = light[k] + share * K(lights->color[light_index][k]);
        }
        for (int k = 0; k < 3 && lights->count; ++k) light[k] = thrown_back(light[k]);
        real a = interpolated(p, K(c->alpha[0]), K(c->alpha[1]), K(c->alpha[2]));
        store(alpha + i, clamp(a, K(0.0), K(1.0)));
        for (int k = 0; k < 3; ++k) {
            real own = interpolated(p, K(c->color[0][k]), K(c->color[1][k]), K(c->color[2][k]));
            store(color + k * MOIT_REACHED + i, own * light[k]);
        }
    }
}

static void sample_stage(int n, const moit_corners *c, const moit_covered *at,
                         const moit_sampling *s, double *color, double *alpha) {
    const moit_material *m = s->material;
    const real columns = K(m->width), rows = K(m->height);
    const bool plain = m->width == 1 && m->height == 1; /* one texel, however it is read */
    real inverse_z[3], u[3], v[3];
    for (int k = 0; k < 3; ++k) {
        inverse_z[k] = K(s->inverse_z[k]);
        u[k] = K(s->u[k]);
        v[k] = K(s->v[k]);
    }
    for (int i = 0; i < n; i += LANES) {
        surface_point p = {load_at_most(at->second + i, n - i), load_at_most(at->third + i, n - i),
                           load_at_most(at->z + i, n - i)};
        texel found;
        if (plain) {
            for (int k = 0; k < 4; ++k) found.channel[k] = K(s->texels[k]);
        } else {
            real across = square_of_span(p, inverse_z, K(s->step[0][0]), K(s->step[0][1]), u, v,
                                         columns, rows);
            real along = square_of_span(p, inverse_z, K(s->step[1][0]), K(s->step[1][1]), u, v,
                                        columns, rows);
            found = texel_at(s->texels, m->filtering, m->wrap_u, m->wrap_v, columns, rows,
                             interpolated(p, u[0], u[1], u[2]), interpolated(p, v[0], v[1], v[2]),
                             max(across, along));
        }
        real a = interpolated(p, K(c->alpha[0]), K(c->alpha[1]), K(c->alpha[2]));
        store(alpha + i, clamp(clamp(a, K(0.0), K(1.0)) * found.channel[3], K(0.0), K(1.0)));
        for (int k = 0; k < 3; ++k) {
            real own = interpolated(p, K(c->color[0][k]), K(c->color[1][k]), K(c->color[2][k]));
            real factor = m->painted ? found.channel[k] : K(1.0);
            store(color + k * MOIT_REACHED + i, m->lit ? factor : own * factor);
        }
    }
}
#define COVER_STAGE cover_stage
#define SHADE_STAGE shade_stage
#define SAMPLE_STAGE sample_stage
#else
#define COVER_STAGE NULL
#define SHADE_STAGE NULL
#define SAMPLE_STAGE NULL
#endif
