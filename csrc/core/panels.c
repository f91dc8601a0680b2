/* With u the absorbance of all that is active in front of a depth, the light seen of a fragment
 * whose own is v is that which it emits, p v' / alpha each unit of depth (as boxes in
 * deep_volumes.c), times exp(-u), along the panel. Gauss' rule of five points, or in narrow panels
 * of three, gives the integral, and the collocation that belongs to it u; what is hidden is known
 * exactly, and light is scaled to that: one fragment alone has its colour to the last digit. */
#include "core/panels.h"
#include "core/elementary.h"
#include "core/parts.h"
#include "core/tile.h"

#include <math.h>

enum { MOST_POINTS = 5 };

typedef struct {
    int points;
    double at[MOST_POINTS], weight[MOST_POINTS];
    double integral_to[MOST_POINTS][MOST_POINTS]; /* of the polynomial through all, up to a point */
} rule;

static const rule few = {3,
                         {0.1127016653792583, 0.5, 0.8872983346207417},
                         {0.2777777777777778, 0.4444444444444444, 0.2777777777777778},
                         {{0.1388888888888889, -0.03597666752493894, 0.009789444015308318},
                          {0.3002631949808646, 0.2222222222222222, -0.022485417203086805},
                          {0.26798833376246944, 0.48042111196938336, 0.1388888888888889}}};
static const rule more = {
    5,
    {0.046910077030668004, 0.23076534494715845, 0.5, 0.76923465505284155, 0.953089922969332},
    {0.11846344252809454, 0.23931433524968323, 0.28444444444444444, 0.23931433524968323,
     0.11846344252809454},
    {
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
    }};

/* ---- What fills the depth -------------------------------------------------------------------- */

static void take_light(const moit_panels *panels, moit_filling *one, int c) {
    const moit_fragments *f = panels->f;
    int64_t i = one->fragment;
    double own = moit_opacity_of(f, i, c + 1);
    double glows = own == 1.0 ? 1.0 : own > 0.0 ? one->hides[c + 1] / own : 1.0;
    double color = 0.0, emission = 0.0;
    if (f->color)
        color = moit_opacity_of(f, i, 0)
                * (moit_number(f->precision, f->color, 3 * i + c) / panels->unit);
    if (f->emission) emission = moit_number(f->precision, f->emission, 3 * i + c) / panels->unit;
    one->light[0][c] = color * glows;
    one->light[1][c] = emission * glows;
}

void moit_panels_begin(moit_panels *panels, int64_t fragment, const moit_extent *extent) {
    moit_filling *one = &panels->filling[panels->count++];
    *one = (moit_filling){.fragment = fragment, .extent = *extent};
    for (int k = 0; k < 4; ++k) {
        double own = moit_opacity_of(panels->f, fragment, k);
        one->opaque[k] = own == 1.0;
        one->hides[k] = own == 1.0                      ? 0.0
                        : k && !panels->f->transmission ? one->hides[0]
                                                        : -moit_log1p(-own);
    }
    for (int c = 0; c < 3; ++c) take_light(panels, one, c);
}

void moit_panels_end(moit_panels *panels, int64_t fragment) {
    int64_t at = 0;
    while (panels->filling[at].fragment != fragment) ++at;
    panels->filling[at] = panels->filling[--panels->count];
}

/* ---- How wide a panel is --------------------------------------------------------------------- */

/* Beyond, a Gaussian's density is as flat over two deviations as it is nearer over one. */
#define FLAT_BEFORE (-5.0)
#define FLAT_BEHIND 3.0
#define SOFT 5.9

/* Rules of five points do well with so much in a panel. */
#define MOST_DEVIATIONS 1.0
#define MOST_ABSORBED 2.0

double moit_panel_reach(const moit_extent *e, double near) {
    if (!e->is_gaussian) return HUGE_VAL;
    double x = (0.25 * near - 0.25 * e->mean) / (0.25 * e->deviation);
    return near + (x < FLAT_BEFORE || x > FLAT_BEHIND ? 2.0 : 1.0) * MOST_DEVIATIONS * e->deviation;
}

/* Each unit of depth where the fragment is densest. */
static double densest(const moit_filling *one) {
    const moit_extent *e = &one->extent;
    if (!(one->hides[0] > 0.0)) return 0.0;
    return one->hides[0]
           * (e->is_gaussian ? 0.4 / e->deviation / e->mass : 1.0 / (e->back - e->front));
}

double moit_panels_reach(const moit_panels *panels, double near) {
    double reach = HUGE_VAL, density = 0.0;
    for (int64_t n = 0; n < panels->count; ++n) {
        density += densest(&panels->filling[n]);
        reach = fmin(reach, moit_panel_reach(&panels->filling[n].extent, near));
    }
    return reach < HUGE_VAL && density > 0.0 ? fmin(reach, near + MOST_ABSORBED / density) : reach;
}

bool moit_begins_softly(const moit_extent *e) {
    return e->is_gaussian && e->mean - e->front >= SOFT * e->deviation;
}

bool moit_ends_softly(const moit_extent *e) {
    return e->is_gaussian && e->back - e->mean >= SOFT * e->deviation;
}

/* ---- Mixing ---------------------------------------------------------------------------------- */

/* Of one channel, or of all together: what hides, and light in two kinds. */
typedef struct {
    double hides, opaque;        /* absorbance in all; how many are opaque */
    double density[MOST_POINTS]; /* of absorbance, over the panel */
    double light[2][MOST_POINTS], of_opaque[2];
} channel;

static void add(channel *to, const moit_filling *one, int k, double share, const double *density,
                int points) {
    to->opaque += one->opaque[k];
    to->hides += one->hides[k] * share;
    for (int j = 0; j < points; ++j) to->density[j] += one->hides[k] * density[j];
}

static void add_light(channel *to, const moit_filling *one, int c, int kind, const double *density,
                      int points) {
    double light = one->light[kind][c];
    if (one->opaque[c + 1]) to->of_opaque[kind] += light;
    else
        for (int j = 0; j < points; ++j) to->light[kind][j] += light * density[j];
}

static double alpha_of(const channel *c) { return c->opaque > 0.0 ? 1.0 : -moit_expm1(-c->hides); }

/* What reaches a rule's points, by their weight, and how much more is hidden than they say. */
static double reaching(const channel *c, const rule *r, double *through) {
    double hidden = 0.0;
    for (int j = 0; j < r->points; ++j) {
        double u = 0.0;
        for (int k = 0; k < r->points; ++k) u += r->integral_to[j][k] * c->density[k];
        through[j] = -fmax(u, 0.0);
    }
    moit_exps(r->points, through, through);
    for (int j = 0; j < r->points; ++j) {
        through[j] *= r->weight[j];
        hidden += through[j] * c->density[j];
    }
    return hidden > 0.0 ? alpha_of(c) / hidden : 1.0;
}

/* The light of each kind that is seen. */
static void see(const channel *c, const rule *r, const double *through, double exactly,
                double seen[2]) {
    for (int k = 0; k < 2; ++k) {
        double sum = 0.0;
        for (int j = 0; j < r->points; ++j) sum += through[j] * c->light[k][j];
        seen[k] = c->opaque > 0.0 ? c->of_opaque[k] / c->opaque : sum * exactly;
    }
}

/* Three points do for a third of what five do for. */
static const rule *rule_of(const moit_panels *panels, double near, double far) {
    double density = 0.0, length = far - near;
    for (int64_t n = 0; n < panels->count; ++n) {
        const moit_extent *e = &panels->filling[n].extent;
        if (e->is_gaussian && !(length <= MOST_DEVIATIONS / 3.0 * e->deviation)) return &more;
        density += densest(&panels->filling[n]);
    }
    return density * length <= MOST_ABSORBED / 3.0 ? &few : &more;
}

moit_mixture moit_mix_panel(moit_panels *panels, double near, double far) {
    const moit_fragments *f = panels->f;
    const rule *r = rule_of(panels, near, far);
    channel all = {0}, each[3] = {{0}};
    double at[MOST_POINTS], density[MOST_POINTS], through[MOST_POINTS], seen[2];
    for (int j = 0; j < r->points; ++j) at[j] = near * (1.0 - r->at[j]) + far * r->at[j];
    for (int64_t n = 0; n < panels->count; ++n) {
        moit_filling *one = &panels->filling[n];
        const moit_extent *e = &one->extent;
        double share = moit_share_passed(e, fmax(near, e->front), fmin(far, e->back), &one->passed);
        moit_shares_at(e, r->points, at, near, far, density);
        add(&all, one, 0, share, density, r->points);
        for (int c = 0; c < 3; ++c) {
            if (f->transmission) add(&each[c], one, c + 1, share, density, r->points);
            if (f->color) add_light(&each[c], one, c, 0, density, r->points);
            if (f->emission) add_light(&each[c], one, c, 1, density, r->points);
        }
    }
    moit_mixture mixed = {.alpha = alpha_of(&all)};
    double exactly = reaching(&all, r, through);
    for (int c = 0; c < 3; ++c) {
        channel *own = &each[c];
        if (f->transmission) exactly = reaching(own, r, through);
        else own->opaque = all.opaque;
        see(own, r, through, exactly, seen);
        mixed.opacity[c] = f->transmission ? alpha_of(own) : mixed.alpha;
        mixed.color[c] = panels->unit * seen[0];
        mixed.emission[c] = panels->unit * seen[1];
    }
    return mixed;
}
