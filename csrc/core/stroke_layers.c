/* Coverage by samples: 64 points of a pixel, of which each has a row and a column of its own, and
 * each square of 8 x 8 one (Hammersley's points); so what parts of a line cover together is known
 * exactly as far as samples tell, whatever way they meet. */
#include "core/stroke_layers.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

/* Half of a pixel's diagonal: nothing of it is farther from its middle. */
static const double CORNER = 0.70711;

static int bits_of(uint64_t samples) { return __builtin_popcountll(samples); }

enum { CORNERS = 4, MIDDLE = CORNERS };

/* Where samples lie in their pixel (padded, as stages read them): of sample i (i + .5) / 64, and
 * the same of i with its six bits turned round, as stroke_layers.glsl computes it. */
static const double SAMPLE_X[MOIT_STROKE_ROOM] = {
    0.0078125, 0.0234375, 0.0390625, 0.0546875, 0.0703125, 0.0859375, 0.1015625, 0.1171875,
    0.1328125, 0.1484375, 0.1640625, 0.1796875, 0.1953125, 0.2109375, 0.2265625, 0.2421875,
    0.2578125, 0.2734375, 0.2890625, 0.3046875, 0.3203125, 0.3359375, 0.3515625, 0.3671875,
    0.3828125, 0.3984375, 0.4140625, 0.4296875, 0.4453125, 0.4609375, 0.4765625, 0.4921875,
    0.5078125, 0.5234375, 0.5390625, 0.5546875, 0.5703125, 0.5859375, 0.6015625, 0.6171875,
    0.6328125, 0.6484375, 0.6640625, 0.6796875, 0.6953125, 0.7109375, 0.7265625, 0.7421875,
    0.7578125, 0.7734375, 0.7890625, 0.8046875, 0.8203125, 0.8359375, 0.8515625, 0.8671875,
    0.8828125, 0.8984375, 0.9140625, 0.9296875, 0.9453125, 0.9609375, 0.9765625, 0.9921875};
static const double SAMPLE_Y[MOIT_STROKE_ROOM] = {
    0.0078125, 0.5078125, 0.2578125, 0.7578125, 0.1328125, 0.6328125, 0.3828125, 0.8828125,
    0.0703125, 0.5703125, 0.3203125, 0.8203125, 0.1953125, 0.6953125, 0.4453125, 0.9453125,
    0.0390625, 0.5390625, 0.2890625, 0.7890625, 0.1640625, 0.6640625, 0.4140625, 0.9140625,
    0.1015625, 0.6015625, 0.3515625, 0.8515625, 0.2265625, 0.7265625, 0.4765625, 0.9765625,
    0.0234375, 0.5234375, 0.2734375, 0.7734375, 0.1484375, 0.6484375, 0.3984375, 0.8984375,
    0.0859375, 0.5859375, 0.3359375, 0.8359375, 0.2109375, 0.7109375, 0.4609375, 0.9609375,
    0.0546875, 0.5546875, 0.3046875, 0.8046875, 0.1796875, 0.6796875, 0.4296875, 0.9296875,
    0.1171875, 0.6171875, 0.3671875, 0.8671875, 0.2421875, 0.7421875, 0.4921875, 0.9921875};

/* The corners of a pixel, and its middle. */
static const double CORNER_X[MOIT_STROKE_ROOM] = {0.0, 1.0, 0.0, 1.0, 0.5},
                    CORNER_Y[MOIT_STROKE_ROOM] = {0.0, 0.0, 1.0, 1.0, 0.5};

/* Pixels of a row. */
static const double ALONG_ROW[MOIT_STROKE_ROOM] = {0.0, 1.0, 2.0,  3.0,  4.0,  5.0,  6.0,  7.0,
                                                   8.0, 9.0, 10.0, 11.0, 12.0, 13.0, 14.0, 15.0},
                    NOWHERE[MOIT_STROKE_ROOM] = {0.0};

static void look(const moit_stroke_look *l, double x, double y, int n, const double *dx,
                 const double *dy, moit_stroke_points *out) {
    l->stages->stroke_points(l->stroke, &l->raster->sight, x, y, n, dx, dy, out);
}

/* Sums of what point i, seen at (x, y), has: for so many samples. */
static void take(const moit_stroke_look *l, const moit_stroke_points *p, int i, double x, double y,
                 int samples, moit_stroke_layer *o) {
    const moit_stroking *how = &l->raster->how;
    const moit_screen_stroke *s = l->stroke;
    double share = p->share[i], middle = p->middle[i],
           thickness = s->size[0] + share * (s->size[1] - s->size[0]);
    o->near = middle - thickness < o->near ? middle - thickness : o->near;
    o->far = middle + thickness > o->far ? middle + thickness : o->far;
    o->depth = samples * (how->solid && !how->pixels ? p->rank[i] : middle);
    if (l->depth_only) return;
    o->alpha = samples * ((double)s->opacity[0] + share * (double)(s->opacity[1] - s->opacity[0]));
    for (int k = 0; k < 3; ++k)
        o->color[k] =
            samples * ((double)s->color[k] + share * (double)(s->color[3 + k] - s->color[k]));
    if (!how->solid || !how->lit) return;
    int lights = moit_light_shares(l->raster, s, share, p->rank[i], x, y, o->share);
    for (int k = 0; k < lights; ++k) o->share[k] *= samples;
}

void moit_look_at_row(const moit_stroke_look *l, int left, int top, int n, moit_stroke_row *row) {
    row->left = left;
    row->top = top;
    if (!l->stroke->everywhere) l->stages->stroke_away(l->stroke, left, top, n, row->away);
    if (l->raster->how.samples == 1)
        look(l, left + 0.5, top + 0.5, n, ALONG_ROW, NOWHERE, &row->points);
}

/* Whether all of the pixel is covered; then what its middle has is told by point MIDDLE. */
static bool covers_all(const moit_stroke_look *l, double x, double y, double away,
                       moit_stroke_points *points) {
    if (l->raster->how.solid) { /* what is convex covers a pixel whose corners it does */
        if (away > CORNER / 2) return false;
        look(l, x, y, CORNERS + 1, CORNER_X, CORNER_Y, points);
        return points->met == (1 << (CORNERS + 1)) - 1;
    }
    if (!(away < -CORNER)) return false;
    look(l, x, y, CORNERS + 1, CORNER_X, CORNER_Y, points);
    return points->met >> MIDDLE & 1;
}

/* The middle of what samples are covered, as far as they tell. */
static void find_middle(uint64_t covered, double at[2]) {
    double sum[2] = {0.0, 0.0};
    int count = bits_of(covered);
    for (; covered; covered &= covered - 1) {
        int i = __builtin_ctzll(covered);
        sum[0] += SAMPLE_X[i];
        sum[1] += SAMPLE_Y[i];
    }
    for (int k = 0; k < 2; ++k) at[k] = sum[k] / count;
}

/* What samples of a pixel meet; whether any do. */
static bool meets_samples(const moit_stroke_look *l, double x, double y, moit_stroke_points *o) {
    if (!l->alone) {
        look(l, x, y, MOIT_SAMPLES, SAMPLE_X, SAMPLE_Y, o);
        return o->met;
    }
    o->met = l->stages->stroke_met(l->stroke, &l->raster->sight, x, y, SAMPLE_X, SAMPLE_Y,
                                   l->exists_only);
    o->near = HUGE_VAL; /* nobody asks */
    o->far = -HUGE_VAL;
    return o->met;
}

bool moit_cover_by_stroke(const moit_stroke_look *l, const moit_stroke_row *row, int i,
                          moit_stroke_layer *o) {
    double away = l->stroke->everywhere ? 0.0 : row->away[i], x = row->left + i, y = row->top,
           at[2];
    int count = l->raster->how.samples;
    if (away > CORNER) return false;
    if (count == 1 && !(row->points.met >> i & 1)) return false;
    if (count == 1 && l->exists_only) return true;
    memset(o, 0, offsetof(moit_stroke_layer, rank));
    o->place = l->stroke->place;
    o->opens = l->stroke->opens;
    o->near = HUGE_VAL;
    o->far = -HUGE_VAL;
    if (count == 1) {
        o->covered = 1;
        o->rank[0] = (float)row->points.rank[i];
        take(l, &row->points, i, x + 0.5, y + 0.5, 1, o);
        return true;
    }
    moit_stroke_points points;
    if (covers_all(l, x, y, away, &points)) {
        o->covered = ~(uint64_t)0;
        if (l->exists_only) return true;
        for (int k = 0; k < count && !l->alone; ++k) o->rank[k] = (float)points.rank[MIDDLE];
        take(l, &points, MIDDLE, x + 0.5, y + 0.5, count, o);
        return true;
    }
    if (!meets_samples(l, x, y, &points)) return false;
    o->covered = points.met;
    if (l->exists_only) return true;
    o->near = points.near;
    o->far = points.far;
    for (int k = 0; k < count && !l->alone; ++k) o->rank[k] = (float)points.rank[k];
    int covered = bits_of(o->covered);
    find_middle(o->covered, at);
    moit_stroke_points middle;
    look(l, x + at[0], y + at[1], 1, NOWHERE, NOWHERE, &middle);
    if (middle.met) {
        take(l, &middle, 0, x + at[0], y + at[1], covered, o);
        return true;
    }
    /* between samples of what is cut off by near or far, or by rounding, nothing need be met */
    int first = __builtin_ctzll(o->covered);
    x += SAMPLE_X[first];
    y += SAMPLE_Y[first];
    look(l, x, y, 1, NOWHERE, NOWHERE, &points);
    take(l, &points, 0, x, y, covered, o);
    return true;
}

bool moit_stroke_goes_on(const moit_stroke_layer *layer, const moit_stroke_layer *own,
                         const moit_screen_stroke *s, int end, double x, double y) {
    if (layer->near <= own->far && own->near <= layer->far) return true;
    double dx = s->x[end] - x - 0.5, dy = s->y[end] - y - 0.5, reach = s->radius[end] + CORNER;
    return dx * dx + dy * dy <= reach * reach;
}

static void scale(moit_stroke_layer *o, double by) {
    o->depth *= by;
    o->alpha *= by;
    for (int k = 0; k < 3; ++k) o->color[k] *= by;
    for (int l = 0; l < MOIT_MOST_LIGHTS; ++l) o->share[l] *= by;
}

void moit_join_strokes(moit_stroke_layer *layer, const moit_stroke_layer *own) {
    uint64_t won = own->covered & ~layer->covered;
    for (uint64_t both = own->covered & layer->covered; both; both &= both - 1) {
        int i = __builtin_ctzll(both);
        if (own->rank[i] < layer->rank[i]) won |= (uint64_t)1 << i;
    }
    int before = bits_of(layer->covered), lost = bits_of(layer->covered & won),
        total = bits_of(own->covered);
    moit_stroke_layer gained = *own;
    if (lost) scale(layer, (double)(before - lost) / before);
    scale(&gained, (double)bits_of(won) / total);
    layer->depth += gained.depth;
    layer->alpha += gained.alpha;
    for (int k = 0; k < 3; ++k) layer->color[k] += gained.color[k];
    for (int l = 0; l < MOIT_MOST_LIGHTS; ++l) layer->share[l] += gained.share[l];
    layer->covered |= own->covered;
    for (; won; won &= won - 1) {
        int i = __builtin_ctzll(won);
        layer->rank[i] = own->rank[i];
    }
    layer->near = fmin(layer->near, own->near);
    layer->far = fmax(layer->far, own->far);
    layer->place = own->place;
    layer->opens |= own->opens;
    layer->closes |= own->closes;
}

moit_stroke_fragment moit_fragment_of_stroke(const moit_stroke_raster *r,
                                             const moit_stroke_layer *layer,
                                             const double *reached) {
    moit_stroke_fragment o;
    int covered = bits_of(layer->covered), lights = r->camera.lights.count;
    double color[3], share[MOIT_MOST_LIGHTS];
    o.depth = (float)(layer->depth / covered);
    o.alpha = (float)fmin(layer->alpha / r->how.samples, 1.0);
    for (int k = 0; k < 3; ++k) color[k] = layer->color[k] / covered;
    for (int l = 0; l < (lights ? lights : 1); ++l)
        share[l] = layer->share[l] / covered * (reached && lights ? reached[l] : 1.0);
    if (r->how.solid && r->how.lit) moit_lit_color(r, share, color);
    for (int k = 0; k < 3; ++k) o.color[k] = (float)color[k];
    return o;
}
