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

static void sample_at(int count, int i, double at[2]) {
    int turned = 0;
    for (int bit = 0; bit < 6; ++bit) turned |= (i >> bit & 1) << (5 - bit);
    at[0] = count == 1 ? 0.5 : (i + 0.5) / MOIT_SAMPLES;
    at[1] = count == 1 ? 0.5 : (turned + 0.5) / MOIT_SAMPLES;
}

/* What is convex on the screen covers a pixel whose corners it does. */
static bool covers_corners(const moit_stroke_shape *s, double x, double y) {
    moit_stroke_point point;
    for (int k = 0; k < 4; ++k)
        if (!moit_meets_stroke(s, x + k % 2, y + k / 2, &point)) return false;
    return true;
}

static void widen(moit_stroke_layer *o, const moit_stroke_point *p) {
    double near = p->middle - p->thickness, far = p->middle + p->thickness;
    o->near = near < o->near ? near : o->near;
    o->far = far > o->far ? far : o->far;
}

/* Sums of what is at (x, y), for so many samples. */
static bool look_at(const moit_stroke_shape *s, double x, double y, int samples,
                    moit_stroke_layer *o) {
    const moit_stroke_raster *r = s->raster;
    const moit_stroke_end *end = s->part->end;
    moit_stroke_point p;
    if (!moit_meets_stroke(s, x, y, &p)) return false;
    widen(o, &p);
    o->depth = samples * p.depth;
    o->alpha = samples * ((double)end[0].alpha + p.share * (double)(end[1].alpha - end[0].alpha));
    for (int k = 0; k < 3; ++k)
        o->color[k] =
            samples
            * ((double)end[0].color[k] + p.share * (double)(end[1].color[k] - end[0].color[k]));
    if (!r->how.solid || !r->how.lit) return true;
    int lights = moit_light_shares(r, p.normal, x, y, o->share);
    for (int l = 0; l < lights; ++l) o->share[l] *= samples;
    return true;
}

bool moit_cover_by_stroke(const moit_stroke_shape *s, double x, double y, moit_stroke_layer *o) {
    int count = s->raster->how.samples;
    moit_stroke_point point;
    double share, middle = moit_away_from_stroke(s, x + 0.5, y + 0.5, &share);
    if (!s->everywhere && middle > CORNER) return false;
    memset(o, 0, offsetof(moit_stroke_layer, rank));
    o->place = s->part->place;
    o->opens = s->part->opens;
    o->near = HUGE_VAL;
    o->far = -HUGE_VAL;
    if (count > 1 && (s->raster->how.solid ? covers_corners(s, x, y) : middle < -CORNER)
        && moit_meets_stroke(s, x + 0.5, y + 0.5, &point)) {
        o->covered = ~(uint64_t)0;
        for (int i = 0; i < count; ++i) o->rank[i] = (float)point.rank;
        return look_at(s, x + 0.5, y + 0.5, count, o);
    }
    double at[2], sum[2] = {0.0, 0.0};
    for (int i = 0; i < count; ++i) {
        sample_at(count, i, at);
        if (!moit_meets_stroke(s, x + at[0], y + at[1], &point)) continue;
        o->covered |= (uint64_t)1 << i;
        o->rank[i] = (float)point.rank;
        widen(o, &point);
        for (int k = 0; k < 2; ++k) sum[k] += at[k];
    }
    int covered = bits_of(o->covered);
    if (!covered) return false;
    if (look_at(s, x + sum[0] / covered, y + sum[1] / covered, covered, o)) return true;
    /* between samples of what is cut off by near or far, or by rounding, nothing need be met */
    sample_at(count, __builtin_ctzll(o->covered), at);
    return look_at(s, x + at[0], y + at[1], covered, o);
}

bool moit_stroke_goes_on(const moit_stroke_layer *layer, const moit_stroke_layer *own,
                         const moit_stroke_shape *s, int end, double x, double y) {
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
