/* Stages of strokes, in double only: places of nodes are. */

#ifdef RULES
#include "core/strokes.h"
#include "kernels/strokes.h"

static stroke_outline outline_of(const moit_screen_stroke *s) {
    stroke_outline o = {.apart = K(s->apart), .lean = K(s->lean), .upright = K(s->upright)};
    for (int k = 0; k < 2; ++k) {
        o.x[k] = K(s->x[k]);
        o.y[k] = K(s->y[k]);
        o.radius[k] = K(s->radius[k]);
        o.along[k] = K(s->along[k]);
    }
    return o;
}

static stroke_balls balls_of(const moit_screen_stroke *s, const moit_stroke_sight *sight) {
    stroke_balls o = {.over = K(s->over),
                      .per_over = K(s->per_over),
                      .start = K(s->start),
                      .beyond = K(s->beyond),
                      .near = K(sight->near),
                      .far = K(sight->far)};
    for (int k = 0; k < 6; ++k) o.at[k] = K(s->at[k]);
    for (int k = 0; k < 2; ++k) o.outside[k] = K(s->outside[k]);
    return o;
}

/* A bit for each lane where t holds. */
static uint64_t bits_where(truth t) {
    uint64_t found = 0;
    for (int k = 0; k < LANES; ++k) found |= (uint64_t)(t[k] & 1) << k;
    return found;
}

static bool is_point(const moit_screen_stroke *s) {
    return s->at[0] == s->at[3] && s->at[1] == s->at[4] && s->at[2] == s->at[5]
           && s->size[0] == s->size[1];
}

/* Whether no plane of the view cuts a ball, whatever rounding makes of where rays meet it. */
static bool is_whole(const moit_screen_stroke *s, const moit_stroke_sight *sight) {
    double rounding = 1e-9 * (s->at[2] + s->size[0]);
    return s->at[2] - s->size[0] - rounding > sight->near
           && s->at[2] + s->size[0] + rounding < sight->far;
}

static uint64_t stroke_met_stage(const moit_screen_stroke *s, const moit_stroke_sight *sight,
                                 double x, double y, const double *dx, const double *dy, bool any) {
    uint64_t met = 0;
    if (!sight->solid) {
        const stroke_outline outline = outline_of(s);
        for (int i = 0; i < MOIT_SAMPLES && !(any && met); i += LANES)
            met |= bits_where(away_from_outline(outline, K(x) + load(dx + i), K(y) + load(dy + i),
                                                s->holder)
                                  .away
                              <= 0.0)
                   << i;
        return met;
    }
    const stroke_balls balls = balls_of(s, sight);
    const bool one = is_point(s), simple = one && is_whole(s, sight);
    for (int i = 0; i < MOIT_SAMPLES && !(any && met); i += LANES) {
        real right = K(sight->slope[0]) + (K(x) + load(dx + i)) * K(sight->slope_of_one[0]),
             up = K(sight->slope[1]) + (K(y) + load(dy + i)) * K(sight->slope_of_one[1]);
        truth t = simple ? first_ball_is_met(balls, right, up)
                         : solid_stroke_at(balls, right, up, one).met;
        met |= bits_where(t) << i;
    }
    return met;
}

static void stroke_points_stage(const moit_screen_stroke *s, const moit_stroke_sight *sight,
                                double x, double y, int n, const double *dx, const double *dy,
                                moit_stroke_points *out) {
    const bool solid = sight->solid, one = is_point(s);
    const stroke_outline outline = outline_of(s);
    const stroke_balls balls = balls_of(s, sight);
    const real thick = K(s->size[0]), thicker = K(s->size[1] - s->size[0]);
    real near = K(__builtin_inf()), far = K(-__builtin_inf()), lane;
    for (int k = 0; k < LANES; ++k) lane[k] = k;
    out->met = 0;
    for (int i = 0; i < n; i += LANES) {
        const real column = K(x) + load(dx + i), row = K(y) + load(dy + i);
        stroke_point p;
        if (solid)
            p = solid_stroke_at(balls, K(sight->slope[0]) + column * K(sight->slope_of_one[0]),
                                K(sight->slope[1]) + row * K(sight->slope_of_one[1]), one);
        else p = flat_stroke_at(outline, K(s->at[2]), K(s->at[5]), column, row, s->holder);
        truth met = BOTH(p.met, lane + K(i) < K(n));
        real thickness = thick + p.share * thicker;
        near = select(met, min(p.middle - thickness, near), near);
        far = select(met, max(p.middle + thickness, far), far);
        out->met |= bits_where(met) << i;
        store(out->share + i, p.share);
        store(out->rank + i, p.rank);
        store(out->middle + i, p.middle);
    }
    out->near = near[0];
    out->far = far[0];
    for (int k = 1; k < LANES; ++k) {
        out->near = near[k] < out->near ? near[k] : out->near;
        out->far = far[k] > out->far ? far[k] : out->far;
    }
}

static void stroke_away_stage(const moit_screen_stroke *s, int left, int top, int n, double *away) {
    const stroke_outline outline = outline_of(s);
    const real row = K(top + 0.5);
    real lane;
    for (int k = 0; k < LANES; ++k) lane[k] = k;
    for (int i = 0; i < n; i += LANES)
        store(away + i, away_from_outline(outline, K(left + 0.5 + i) + lane, row, s->holder).away);
}
#define STROKE_POINTS_STAGE stroke_points_stage
#define STROKE_MET_STAGE stroke_met_stage
#define STROKE_AWAY_STAGE stroke_away_stage
#else
#define STROKE_POINTS_STAGE NULL
#define STROKE_MET_STAGE NULL
#define STROKE_AWAY_STAGE NULL
#endif
