/* With u the absorbance of all that is active in front of a depth, the light seen of a fragment
 * whose own is v is that which it emits, p v' / alpha each unit of depth (as boxes in
 * deep_volumes.c), times exp(-u), along the panel. Gauss' rule of five points gives the integral,
 * and the collocation that belongs to it u; what is hidden is known exactly, and light is scaled to
 * that: one fragment alone has its colour to the last digit. */
#include "core/panels.h"
#include "core/parts.h"
#include "core/tile.h"

#include <math.h>

enum { POINTS = 5 };

static const double point_at[POINTS] = {0.046910077030668004, 0.23076534494715845, 0.5,
                                        0.76923465505284155, 0.953089922969332};
static const double weight_of[POINTS] = {0.11846344252809454, 0.23931433524968323,
                                         0.28444444444444444, 0.23931433524968323,
                                         0.11846344252809454};
/* The integral from 0 to a point of the polynomial through all of them. */
static const double integral_to[POINTS][POINTS] = {
    {0.059231721264047272, -0.019570364359076037, 0.011254400818642956, -0.0055937936608121849,
     0.0015881129678659985},
    {0.12815100567004528, 0.11965716762484162, -0.0245921146196422, 0.010318280670683357,
     -0.002768994398769603},
    {0.1137762880042246, 0.26000465168064152, 0.14222222222222222, -0.020690316430958285,
     0.0046871545238699412},
    {0.12123243692686415, 0.22899605457899988, 0.30903655906408664, 0.11965716762484162,
     -0.0096875631419507397},
    {0.11687532956022855, 0.24490812891049542, 0.27319004362580149, 0.25888469960875927,
     0.059231721264047272},
};

/* Of one channel, or of all together: what hides, and light in two kinds. */
typedef struct {
    double hides, opaque;   /* absorbance in all; how many are opaque */
    double density[POINTS]; /* of absorbance, over the panel */
    double light[2][POINTS], of_opaque[2];
} channel;

static void add(channel *to, double own, double share, const double density[POINTS],
                const double light[2]) {
    double absorbs = own == 1.0 ? 0.0 : -log1p(-own), glows = own > 0.0 ? absorbs / own : 1.0;
    to->opaque += own == 1.0;
    to->hides += absorbs * share;
    for (int j = 0; j < POINTS; ++j) to->density[j] += absorbs * density[j];
    for (int k = 0; k < 2; ++k) {
        if (own == 1.0) to->of_opaque[k] += light[k];
        else
            for (int j = 0; j < POINTS; ++j) to->light[k][j] += light[k] * glows * density[j];
    }
}

static double alpha_of(const channel *c) { return c->opaque > 0.0 ? 1.0 : -expm1(-c->hides); }

/* The light of each kind that is seen. */
static void see(const channel *c, double seen[2]) {
    double hidden = 0.0, through[POINTS];
    for (int j = 0; j < POINTS; ++j) {
        double u = 0.0;
        for (int k = 0; k < POINTS; ++k) u += integral_to[j][k] * c->density[k];
        through[j] = weight_of[j] * exp(-fmax(u, 0.0));
        hidden += through[j] * c->density[j];
    }
    double exactly = hidden > 0.0 ? alpha_of(c) / hidden : 1.0;
    for (int k = 0; k < 2; ++k) {
        double sum = 0.0;
        for (int j = 0; j < POINTS; ++j) sum += through[j] * c->light[k][j];
        seen[k] = c->opaque > 0.0 ? c->of_opaque[k] / c->opaque : sum * exactly;
    }
}

moit_mixture moit_mix_panel(const moit_fragments *f, const int64_t *active,
                            const moit_extent *extents, int64_t count, double near, double far,
                            double unit) {
    channel all = {0}, each[3] = {0};
    double at[POINTS];
    for (int j = 0; j < POINTS; ++j) at[j] = near * (1.0 - point_at[j]) + far * point_at[j];
    for (int64_t n = 0; n < count; ++n) {
        int64_t i = active[n];
        const moit_extent *e = &extents[n];
        double share = moit_share_between(e, near, far), density[POINTS];
        for (int j = 0; j < POINTS; ++j) density[j] = moit_share_at(e, at[j], near, far);
        double alpha = moit_opacity_of(f, i, 0);
        add(&all, alpha, share, density, (const double[2]){0.0, 0.0});
        for (int c = 0; c < 3; ++c) {
            double light[2] = {0.0, 0.0};
            if (f->color)
                light[0] = alpha * (moit_number(f->precision, f->color, 3 * i + c) / unit);
            if (f->emission) light[1] = moit_number(f->precision, f->emission, 3 * i + c) / unit;
            add(&each[c], moit_opacity_of(f, i, c + 1), share, density, light);
        }
    }
    moit_mixture mixed = {.alpha = alpha_of(&all)};
    for (int c = 0; c < 3; ++c) {
        double seen[2];
        see(&each[c], seen);
        mixed.opacity[c] = alpha_of(&each[c]);
        mixed.color[c] = unit * seen[0];
        mixed.emission[c] = unit * seen[1];
    }
    return mixed;
}
