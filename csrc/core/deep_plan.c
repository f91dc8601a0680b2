/* Dynamic programming along a ray: the least number of samples whose curve stays within a corridor
 * around the true one. A surface leads to any plateau in the corridor of what it stands for, so
 * nothing is lost by keeping one end for each state: of surfaces alone the number is the least of
 * all. A volume begins where the way to it ends; from each state one end is tried, the truth. */
#include "core/deep_plan.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { NEAR_ENDS = 16 }; /* as many ends of a surface's reach are kept, and its last one */

void moit_free_plan(moit_plan *plan) {
    free(plan->ways);
    free(plan->values);
    free(plan->low);
    free(plan->stand_ins);
    moit_free_curve(&plan->slope);
    plan->ways = NULL;
    plan->values = plan->low = plan->high = NULL;
    plan->stand_ins = NULL;
    plan->room = 0;
}

static bool make_room(moit_plan *plan) {
    int64_t pieces = plan->truth->count;
    size_t width = (size_t)plan->truth->width;
    plan->slope.alphas = plan->truth->alphas;
    plan->slope.width = plan->truth->width;
    plan->slope.dimmed_by = plan->truth->dimmed_by;
    plan->slope.count = 1;
    if (pieces < plan->room) return true;
    moit_free_plan(plan);
    int64_t room = 2 * (pieces + 1);
    plan->ways = malloc((size_t)room * sizeof *plan->ways);
    plan->values = malloc((size_t)room * width * sizeof *plan->values);
    plan->low = malloc(2 * width * sizeof *plan->low);
    plan->high = plan->low ? plan->low + width : NULL;
    plan->stand_ins = malloc((size_t)room * sizeof *plan->stand_ins);
    if (!plan->ways || !plan->values || !plan->low || !plan->stand_ins
        || !moit_curve_room(&plan->slope, 1))
        return false;
    plan->room = room;
    return true;
}

static double *value_of(const moit_plan *plan, int64_t b) {
    return plan->values + b * plan->truth->width;
}

const double *moit_planned(const moit_plan *plan, int64_t b) { return value_of(plan, b); }

static bool is_volume(const moit_plan *plan, int64_t piece) {
    return plan->truth->far[piece] > plan->truth->near[piece];
}

/* Whether nothing is seen of what lies behind a state. */
static bool is_dark(const moit_plan *plan, int64_t b) {
    const double *state = moit_state(plan->truth, b);
    for (int k = 0; k < plan->truth->alphas; ++k)
        if (state[k] != 0.0) return false;
    return true;
}

static bool same_identity(const moit_plan *plan, int64_t a, int64_t b) {
    return !plan->identity || plan->identity[a] == plan->identity[b];
}

/* Takes a way to state b, with where it leads, if it is better than what was found. */
static void offer(moit_plan *plan, int64_t b, int64_t from, moit_step_kind kind,
                  const double *value) {
    const double *state = moit_state(plan->truth, b);
    moit_way way = {from, plan->ways[from].samples + (kind != MOIT_NOTHING), kind, 0.0};
    for (int v = 0; v < plan->truth->width; ++v)
        way.gap = fmax(way.gap, fabs(value[v] - state[v]) / plan->tolerance[v]);
    moit_way *held = &plan->ways[b];
    if (held->samples < way.samples || (held->samples == way.samples && held->gap <= way.gap))
        return;
    *held = way;
    memcpy(value_of(plan, b), value, (size_t)plan->truth->width * sizeof *value);
}

static void begin_corridor(moit_plan *plan) {
    for (int v = 0; v < plan->truth->width; ++v) {
        plan->low[v] = -HUGE_VAL;
        plan->high[v] = HUGE_VAL;
    }
}

/* Narrows it to the tolerance around a state. */
static bool narrow_corridor(moit_plan *plan, int64_t b) {
    const double *state = moit_state(plan->truth, b);
    bool open = true;
    for (int v = 0; v < plan->truth->width; ++v) {
        plan->low[v] = fmax(plan->low[v], state[v] - plan->tolerance[v]);
        plan->high[v] = fmin(plan->high[v], state[v] + plan->tolerance[v]);
        open &= plan->low[v] <= plan->high[v];
    }
    /* What ends opaque must get there. */
    for (int k = 0; k < plan->truth->alphas; ++k) open &= state[k] != 0.0 || plan->low[k] <= 0.0;
    return open;
}

bool moit_corridor(moit_plan *plan, int64_t begin, int64_t end) {
    begin_corridor(plan);
    for (int64_t b = begin; b <= end; ++b)
        if (!narrow_corridor(plan, b)) return false;
    return true;
}

/* Nothing stands for piece i: the plateau goes on. */
static void offer_nothing(moit_plan *plan, int64_t i) {
    const double *state = moit_state(plan->truth, i + 1), *value = value_of(plan, i);
    if (plan->identity && (i == 0 || !same_identity(plan, i - 1, i))) return;
    for (int v = 0; v < plan->truth->width; ++v) {
        if (!(fabs(value[v] - state[v]) <= plan->tolerance[v])) return;
        if (v < plan->truth->alphas && (state[v] == 0.0) != (value[v] == 0.0)) return;
    }
    offer(plan, i + 1, i, MOIT_NOTHING, value);
}

/* A surface where piece i begins; returns the last state that it reaches. */
static int64_t offer_surfaces(moit_plan *plan, int64_t i) {
    const moit_ray_curve *truth = plan->truth;
    /* Two surfaces at one depth would be mixed. */
    if (is_volume(plan, i) && i > 0 && truth->near[i - 1] == truth->near[i]) return i;
    double plateau[64]; /* as wide as a simplified ray may be */
    begin_corridor(plan);
    bool open = !is_volume(plan, i) || narrow_corridor(plan, i);
    int64_t reach = i;
    for (int64_t b = i + 1; open && b <= truth->count; ++b) {
        if (!same_identity(plan, i, b - 1)) break;
        open = narrow_corridor(plan, b);
        if (!open) break;
        reach = b;
        bool next = b < truth->count && same_identity(plan, i, b);
        if (b > i + NEAR_ENDS && next) {
            /* Only the last one is offered: it is known when the next is not open. */
            double low[64], high[64];
            size_t bytes = (size_t)truth->width * sizeof *low;
            memcpy(low, plan->low, bytes);
            memcpy(high, plan->high, bytes);
            bool goes_on = narrow_corridor(plan, b + 1);
            memcpy(plan->low, low, bytes);
            memcpy(plan->high, high, bytes);
            if (goes_on) continue;
        }
        const double *state = moit_state(truth, b), *from = value_of(plan, i);
        for (int v = 0; v < truth->width; ++v) {
            plateau[v] = fmin(fmax(state[v], plan->low[v]), plan->high[v]);
            if (v < truth->alphas) plateau[v] = state[v] == 0.0 ? 0.0 : fmin(plateau[v], from[v]);
        }
        offer(plan, b, i, MOIT_SURFACE, plateau);
    }
    return reach;
}

/* A volume from where piece i begins to where piece j - 1 ends, which leads to the truth. */
static bool offer_volume(moit_plan *plan, int64_t i, int64_t j) {
    const moit_ray_curve *truth = plan->truth;
    moit_ray_curve *slope = &plan->slope;
    const double *from = value_of(plan, i), *to = moit_state(truth, j);
    if (!(truth->far[j - 1] > truth->near[i])) return false;
    for (int64_t b = i + 1; b < j; ++b)
        if (!same_identity(plan, i, b)) return false;
    slope->near[0] = truth->near[i];
    slope->far[0] = truth->far[j - 1];
    memcpy(moit_state(slope, 0), from, (size_t)truth->width * sizeof *from);
    for (int v = 0; v < truth->width; ++v) {
        if (v < truth->alphas && to[v] == 0.0) return false; /* no slope ends opaque */
        moit_state(slope, 1)[v] = v < truth->alphas ? fmin(to[v], from[v]) : to[v];
    }
    double off = moit_curves_differ(truth, i, j, slope, plan->tolerance, NULL);
    if (off > 1.0 - plan->room_for_numbers) return false;
    offer(plan, j, i, MOIT_VOLUME, moit_state(slope, 1));
    return true;
}

static void offer_volumes(moit_plan *plan, int64_t i, int64_t reach) {
    int64_t pieces = plan->truth->count, j = i + 2, step = 1;
    if (is_volume(plan, i)) offer_volume(plan, i, i + 1);
    else if (reach + 1 > j) j = reach + 1; /* nearer ones a surface reaches */
    if (!plan->volumes) return;
    /* Farther and farther until it fails, and then between. */
    int64_t fits = 0;
    for (; j <= pieces && offer_volume(plan, i, j); step *= 2) {
        fits = j;
        if (j == pieces) return;
        j = j + step < pieces ? j + step : pieces;
    }
    for (; fits && step > 0; step /= 2)
        if (fits + step <= pieces && offer_volume(plan, i, fits + step)) fits += step;
}

moit_status moit_make_plan(moit_plan *plan) {
    if (!make_room(plan)) return MOIT_NO_MEMORY;
    int64_t pieces = plan->truth->count, ahead = 0;
    for (int64_t b = 0; b <= pieces; ++b) plan->ways[b] = (moit_way){-1, INT64_MAX, 0, HUGE_VAL};
    plan->ways[0] = (moit_way){-1, 0, MOIT_NOTHING, 0.0};
    memcpy(value_of(plan, 0), moit_state(plan->truth, 0),
           (size_t)plan->truth->width * sizeof(double));
    for (int64_t i = 0; i < pieces; ++i) {
        if (plan->ways[i].samples == INT64_MAX) continue;
        if (is_dark(plan, i)) { /* nothing is seen of the rest */
            offer(plan, pieces, i, MOIT_NOTHING, value_of(plan, i));
            break;
        }
        /* A way that is behind another that leads farther with less is of no use. */
        if (ahead > i && plan->ways[ahead].samples < plan->ways[i].samples) continue;
        offer_nothing(plan, i);
        int64_t reach = offer_surfaces(plan, i);
        offer_volumes(plan, i, reach);
        if (reach > ahead) ahead = reach;
    }
    plan->count = -1;
    if (plan->ways[pieces].samples == INT64_MAX) return MOIT_OK;
    int64_t at = plan->count = plan->ways[pieces].samples;
    for (int64_t b = pieces; b > 0; b = plan->ways[b].from) {
        moit_way way = plan->ways[b];
        if (way.kind != MOIT_NOTHING)
            plan->stand_ins[--at] = (moit_stand_in){way.from, b, way.kind};
    }
    return MOIT_OK;
}
