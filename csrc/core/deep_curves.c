/* Two rays' curves against one another, exactly: along an interval in which both are constant,
 * exponential or straight, their difference has at most one extremum, which is known. */
#include "core/deep_curves.h"
#include "core/elementary.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

bool moit_curve_room(moit_ray_curve *c, int64_t count) {
    if (count <= c->room) return true;
    free(c->near);
    free(c->state);
    c->room = 0;
    int64_t room = 2 * count;
    c->near = malloc((size_t)(2 * room) * sizeof *c->near);
    c->state = malloc((size_t)((room + 1) * c->width) * sizeof *c->state);
    c->far = c->near ? c->near + room : NULL;
    if (!c->near || !c->state) return false;
    c->room = room;
    return true;
}

void moit_free_curve(moit_ray_curve *c) {
    free(c->near);
    free(c->state);
    c->near = c->far = c->state = NULL;
    c->room = 0;
}

double *moit_state(const moit_ray_curve *c, int64_t b) { return c->state + b * c->width; }

void moit_add_piece(moit_ray_curve *c, int64_t b, double near, double far, const double *alpha,
                    const double *light) {
    c->near[b] = near;
    c->far[b] = far;
    const double *from = moit_state(c, b);
    double *to = moit_state(c, b + 1);
    for (int k = 0; k < c->alphas; ++k) to[k] = from[k] * (1.0 - alpha[k]);
    for (int l = c->alphas; l < c->width; ++l)
        to[l] = from[l] + from[c->dimmed_by[l - c->alphas]] * light[l - c->alphas];
}

/* c + q exp(-s t), or with `straight` c + q t; `left` is exp(-s t) where the interval ends. */
typedef struct {
    double c, q, s, left;
    bool straight;
} form;

static double at(const form *f, double t) {
    if (f->straight) return f->c + f->q * t;
    return f->q == 0.0 ? f->c : f->c + f->q * moit_exp(-f->s * t);
}

static double at_start(const form *f) { return f->straight ? f->c : f->c + f->q; }

static double at_end(const form *f, double length) {
    if (f->straight) return f->c + f->q * length;
    return f->q == 0.0 ? f->c : f->c + f->q * f->left;
}

/* Where the derivative of f - g is zero; NaN where nowhere. */
static double level(const form *f, const form *g) {
    if (f->straight && g->straight) return (double)NAN;
    if (g->straight) return level(g, f);
    if (f->straight) /* f->q + g->q g->s exp(-g->s t) = 0 */
        return -moit_log(-f->q / (g->q * g->s)) / g->s;
    return moit_log(f->q * f->s / (g->q * g->s)) / (f->s - g->s);
}

static double greatest_difference(const form *f, const form *g, double length) {
    double worst = fabs(at_start(f) - at_start(g));
    bool moves = f->q != 0.0 || g->q != 0.0;
    if (!moves) return worst;
    worst = fmax(worst, fabs(at_end(f, length) - at_end(g, length)));
    if (f->q == 0.0 || g->q == 0.0) return worst; /* one is constant, the other monotone */
    double t = level(f, g);
    if (t > 0.0 && t < length) worst = fmax(worst, fabs(at(f, t) - at(g, t)));
    return worst;
}

/* A place on a curve: within piece b, or in front of it. */
typedef struct {
    const moit_ray_curve *curve;
    int64_t b, end;
    bool within;
    int known;               /* of which transmittance the rest is, -1 of none */
    double rate, here, left; /* s, how much there is, and exp(-s length) of the interval */
} walker;

static double next_depth(const walker *w) {
    if (w->b == w->end) return HUGE_VAL;
    return w->within ? w->curve->far[w->b] : w->curve->near[w->b];
}

/* Past all that happens at a depth. */
static void pass(walker *w, double depth) {
    while (w->b < w->end) {
        if (w->within) {
            if (w->curve->far[w->b] > depth) return;
            w->within = false;
            ++w->b;
        } else {
            if (w->curve->near[w->b] > depth) return;
            if (w->curve->far[w->b] > w->curve->near[w->b]) w->within = true;
            else ++w->b;
        }
    }
}

/* How transmittance k falls within a medium, from a depth on. Lights that it dims ask the same. */
static void look_at(walker *w, int k, double depth, double length) {
    if (k == w->known) return;
    const moit_ray_curve *c = w->curve;
    double first = moit_state(c, w->b)[k], last = moit_state(c, w->b + 1)[k];
    double past = depth - c->near[w->b];
    w->known = k;
    w->rate = moit_log(first / last) / (c->far[w->b] - c->near[w->b]);
    w->here = past > 0.0 ? first * moit_exp(-w->rate * past) : first;
    w->left = moit_exp(-w->rate * length);
}

/* A number of a curve from a depth on, up to where anything next happens to it. */
static form form_of(walker *w, int v, double depth, double length) {
    const moit_ray_curve *c = w->curve;
    const double *from = moit_state(c, w->b), *to = from + c->width;
    if (!w->within || from[v] == to[v]) return (form){.c = from[v]};
    int k = v < c->alphas ? v : c->dimmed_by[v - c->alphas];
    double first = from[k], fall = first - to[k], rise = to[v] - from[v];
    if (v >= c->alphas && !(fall > 1e-9 * first)) {
        double whole = c->far[w->b] - c->near[w->b], x = (depth - c->near[w->b]) / whole;
        return (form){.c = from[v] + rise * x, .q = rise / whole, .straight = true};
    }
    look_at(w, k, depth, length);
    form f = {.q = w->here, .s = w->rate, .left = w->left};
    if (v < c->alphas) return f;
    double slope = rise / fall;
    f.c = from[v] + slope * first;
    f.q = -slope * w->here;
    return f;
}

double moit_curves_differ(const moit_ray_curve *f, int64_t begin, int64_t end,
                          const moit_ray_curve *g, const double *tolerance, double worst[2]) {
    walker of_f = {.curve = f, .b = begin, .end = end}, of_g = {.curve = g, .end = g->count};
    double found[2] = {0.0, 0.0}, depth = 0.0;
    for (;;) {
        double next = fmin(next_depth(&of_f), next_depth(&of_g));
        double length = of_f.within || of_g.within ? next - depth : 0.0;
        of_f.known = of_g.known = -1;
        for (int v = 0; v < f->width; ++v) {
            form a = form_of(&of_f, v, depth, length), b = form_of(&of_g, v, depth, length);
            double own = greatest_difference(&a, &b, length) / tolerance[v];
            int half = v >= f->alphas;
            if (!(own <= found[half])) found[half] = own; /* NaN too */
        }
        if (!worst && !(found[0] <= 1.0 && found[1] <= 1.0)) break;
        if (next == HUGE_VAL) break;
        depth = next;
        pass(&of_f, depth);
        pass(&of_g, depth);
    }
    if (worst) {
        worst[0] = found[0];
        worst[1] = found[1];
    }
    return found[0] <= 1.0 && found[1] <= 1.0 ? fmax(found[0], found[1])
                                              : fmax(2.0, fmax(found[0], found[1]));
}
