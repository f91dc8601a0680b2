/* Strokes as the eye sees them: their parts, and what each covers. */
#include "core/strokes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static double dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* Pixels that a length 1 at distance 1 takes, up and down the picture and so to the right. */
static double pixels_of_one(const moit_stroke_raster *r) {
    return r->camera.scale[1] * r->height / 2.0;
}

/* ---- Parts ----------------------------------------------------------------------------------- */

static moit_stroke_end seen(const moit_stroke_raster *r, const moit_strokes *s, int64_t node) {
    moit_stroke_end o = {.radius = (double)s->radius[node], .alpha = s->alpha[node]};
    double from_eye[3];
    for (int k = 0; k < 3; ++k) {
        from_eye[k] = s->position[3 * node + k] - r->camera.eye[k];
        o.color[k] = s->color[3 * node + k];
    }
    o.at[0] = dot(r->camera.right, from_eye);
    o.at[1] = dot(r->camera.up, from_eye);
    o.at[2] = dot(r->camera.forward, from_eye);
    /* linear in the distance, as what spans the same pixels everywhere is */
    if (r->how.pixels) o.radius *= o.at[2] / pixels_of_one(r);
    return o;
}

static moit_stroke_end between(const moit_stroke_end *a, const moit_stroke_end *b, double t) {
    moit_stroke_end o;
    for (int k = 0; k < 3; ++k) {
        o.at[k] = a->at[k] + t * (b->at[k] - a->at[k]);
        o.color[k] = (float)((double)a->color[k] + t * (double)(b->color[k] - a->color[k]));
    }
    o.radius = a->radius + t * (b->radius - a->radius);
    o.alpha = (float)((double)a->alpha + t * (double)(b->alpha - a->alpha));
    return o;
}

/* What of a part lies between near and far; false: nothing. *cut: which of its ends moved. */
static bool within_view(const moit_stroke_raster *r, moit_stroke_end end[2], bool cut[2]) {
    cut[0] = cut[1] = false;
    for (int plane = 0; plane < 2; ++plane) {
        double limit = plane ? r->camera.far : r->camera.near, sign = plane ? -1.0 : 1.0;
        double inside[2] = {sign * (end[0].at[2] - limit), sign * (end[1].at[2] - limit)};
        if (!(inside[0] >= 0.0 || inside[1] >= 0.0)) return false;
        for (int k = 0; k < 2; ++k) {
            if (inside[k] >= 0.0) continue;
            end[k] = between(&end[k], &end[1 - k], inside[k] / (inside[k] - inside[1 - k]));
            end[k].at[2] = limit;
            cut[k] = true;
        }
    }
    return true;
}

static int64_t parts_of_stroke(const moit_strokes *s, int64_t i) {
    int64_t nodes = s->first[i + 1] - s->first[i];
    return nodes > 1 ? nodes - 1 : nodes;
}

moit_status moit_stroke_parts(moit_stroke_raster *r, const moit_strokes *s) {
    int64_t most = 0;
    for (int64_t i = 0; i < s->count; ++i) most += parts_of_stroke(s, i);
    if (most >= INT32_MAX || s->count >= INT32_MAX) return MOIT_NO_MEMORY;
    r->parts = malloc((size_t)(most + 1) * sizeof *r->parts);
    if (!r->parts) return MOIT_NO_MEMORY;
    for (int64_t i = 0; i < s->count; ++i) {
        int64_t from = s->first[i], to = s->first[i + 1], parts = parts_of_stroke(s, i);
        bool point = to - from == 1;
        bool closed =
            parts > 2
            && !memcmp(s->position + 3 * from, s->position + 3 * (to - 1), 3 * sizeof *s->position);
        int32_t place = 0;
        bool follows = false; /* the one before ends where this one begins */
        for (int64_t k = 0; k < parts; ++k) {
            moit_stroke_part p = {.stroke = (int32_t)i};
            bool cut[2];
            p.end[0] = seen(r, s, from + k);
            p.end[1] = point ? p.end[0] : seen(r, s, from + k + 1);
            if (!within_view(r, p.end, cut)) {
                follows = false;
                continue;
            }
            place += follows && !cut[0] ? 1 : 2;
            p.place = place;
            p.opens = closed && k == 0 && !cut[0];
            p.closes = closed && k == parts - 1 && !cut[1];
            follows = !cut[1];
            r->parts[r->count++] = p;
        }
    }
    return MOIT_OK;
}

/* ---- On the screen --------------------------------------------------------------------------- */

/* The circle that holds what is seen of an end; false where that is no circle. */
static bool circle_of(const moit_stroke_raster *r, const moit_stroke_end *e, double *x, double *y,
                      double *radius) {
    double z = e->at[2], one = pixels_of_one(r);
    *x = (r->camera.scale[0] * e->at[0] / z + 1.0) * r->width / 2.0;
    *y = (1.0 - r->camera.scale[1] * e->at[1] / z) * r->height / 2.0;
    *radius = e->radius / z * one;
    if (!r->how.solid) return true;
    /* a ball's outline reaches farthest away from the middle of the picture */
    double square = dot(e->at, e->at) - e->radius * e->radius;
    if (!(square > 0.0)) return false;
    double slope = sqrt(e->at[0] * e->at[0] + e->at[1] * e->at[1]) / z,
           width = e->radius / sqrt(square), rest = 1.0 - slope * width;
    if (!(rest > 0.0)) return false;
    *radius = (slope + width) / rest * one - slope * one;
    return true;
}

/* The ball at a share s of the way holds q, seen from the first end, where |q - s ba|^2 is no more
 * than (r0 - s less)^2: a square in s, whose least value says whether any ball does. Where that is
 * 0, the ray enters what all balls cover together. */
static void prepare_balls(const moit_stroke_part *p, moit_screen_stroke *o) {
    const moit_stroke_end *a = &p->end[0], *b = &p->end[1];
    double ba[3], less = a->radius - b->radius;
    for (int k = 0; k < 3; ++k) ba[k] = b->at[k] - a->at[k];
    for (int k = 0; k < 2; ++k)
        o->outside[k] = dot(p->end[k].at, p->end[k].at) - p->end[k].radius * p->end[k].radius;
    o->over = dot(ba, ba) - less * less;
    o->per_over = 1.0 / o->over;
    o->start = -dot(ba, a->at) - a->radius * less;
    o->beyond = o->over * o->outside[0] - o->start * o->start;
}

static int limited(double value, int most) {
    return value > 0.0 ? (value < most ? (int)value : most) : 0;
}

/* Pixels, along one axis, that two circles may touch. */
static void touched(const double at[2], const double radius[2], int size, int32_t *first,
                    int32_t *end) {
    *first = limited(floor(fmin(at[0] - radius[0], at[1] - radius[1])), size);
    *end = limited(floor(fmax(at[0] + radius[0], at[1] + radius[1])) + 1.0, size);
}

static void find_outline(const moit_stroke_raster *r, const moit_stroke_part *p,
                         moit_screen_stroke *o) {
    for (int k = 0; k < 2; ++k)
        if (!circle_of(r, &p->end[k], &o->x[k], &o->y[k], &o->radius[k])) o->everywhere = 1;
    double dx = o->x[1] - o->x[0], dy = o->y[1] - o->y[0], less = o->radius[0] - o->radius[1];
    o->apart = sqrt(dx * dx + dy * dy);
    if (!(o->apart > fabs(less))) {
        o->holder = o->radius[1] > o->radius[0];
        return;
    }
    o->along[0] = dx / o->apart;
    o->along[1] = dy / o->apart;
    o->lean = less / o->apart;
    o->upright = sqrt(1.0 - o->lean * o->lean);
}

moit_screen_stroke moit_screen_stroke_of(const moit_stroke_raster *r, const moit_stroke_part *p) {
    moit_screen_stroke o = {
        .holder = -1,
        .right = r->width,
        .bottom = r->height,
        .stroke = p->stroke,
        .place = p->place,
        .opens = p->opens,
        .closes = p->closes,
        .other = -1,
        .how = (r->how.solid ? STROKE_SOLID : 0) | (r->how.pixels ? STROKE_PIXELS : 0)
               | (r->how.lit ? STROKE_LIT : 0) | (r->how.samples > 1 ? STROKE_SAMPLED : 0)};
    for (int k = 0; k < 2; ++k) {
        const moit_stroke_end *e = &p->end[k];
        for (int c = 0; c < 3; ++c) {
            o.at[3 * k + c] = e->at[c];
            o.color[3 * k + c] = e->color[c];
        }
        o.size[k] = e->radius;
        o.opacity[k] = e->alpha;
    }
    o.alpha = fmaxf(o.opacity[0], o.opacity[1]);
    if (r->how.solid) prepare_balls(p, &o);
    find_outline(r, p, &o);
    if (o.everywhere) return o;
    touched(o.x, o.radius, r->width, &o.left, &o.right);
    touched(o.y, o.radius, r->height, &o.top, &o.bottom);
    return o;
}

moit_stroke_raster moit_stroke_raster_of(const moit_stroking *how, const moit_camera *camera,
                                         int width, int height) {
    moit_stroke_raster r = {
        .how = *how,
        .camera = *camera,
        .width = width,
        .height = height,
        .sight = {.near = camera->near, .far = camera->far, .solid = how->solid}};
    for (int k = 0; k < 2; ++k) {
        double one = (k ? -1.0 : 1.0) / camera->scale[k];
        r.sight.slope[k] = -one;
        r.sight.slope_of_one[k] = 2.0 * one / (k ? height : width);
    }
    return r;
}
