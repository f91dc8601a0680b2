/* Fewer samples of a deep image, whose numbers are chosen so that a file's rounding of them stays
 * within the error. What each is chosen from hangs on what those in front of it became, so errors
 * do not add up. */
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/deep_plan.h"
#include "core/elementary.h"
#include "core/threads.h"

enum { BLOCK = 256 }; /* pixels that a thread takes at once */

/* The corridor is a little narrower than what is checked, lest rounding of double decides. */
static const double margin = 1.0 - 1e-6;

typedef struct {
    const moit_deep *samples;
    const moit_simplifying *how;
    const moit_simplified *out;
} simplify_job;

/* Of the tolerance, how far numbers may lead from a plan with volumes, where 2 is anywhere in the
 * corridor, and what the plan's volumes leave them: tried one after the other. */
enum { ATTEMPTS = 3 };
static const struct {
    double freedom, room;
} attempts[ATTEMPTS] = {{2.0, 0.0}, {0.5, 0.4}, {0.1, 0.1}};

/* What one thread works with. */
typedef struct {
    const simplify_job *job;
    moit_grouping groups;
    moit_ray_curve truth, made;
    moit_plan plan;
    double tolerance[MOIT_MOST_ALPHAS + MOIT_MOST_DEEP_LIGHTS];
    double scale;
    double freedom; /* how far numbers may lead from the plan, by the tolerance */
    int64_t *identity;
    int64_t identity_room;
} workshop;

static int64_t all_samples(const simplify_job *job) {
    return job->samples->offsets[job->samples->pixels];
}

/* ---- Numbers as files hold them -------------------------------------------------------------- */

static double rounded(double x, bool half) {
    if (!half) return (double)(float)x;
    int exponent; /* binary16: 11 digits, the last of them at least 2^-24 */
    frexp(x, &exponent);
    double step = ldexp(1.0, exponent > -13 ? exponent - 11 : -24), found = rint(x / step) * step;
    return fabs(found) > 65504.0 ? copysign(HUGE_VAL, x) : found;
}

/* The number of fewest binary digits in [low, high] that a file can hold, the nearest to `best` of
 * those; where none is there, `best` as a file holds it. */
static double shortest(double low, double high, double best, bool half) {
    if (low <= 0.0 && high >= 0.0) return 0.0;
    if (high < 0.0) return -shortest(-high, -low, -best, half);
    int exponent, least = half ? -24 : -149, digits = half ? 11 : 24;
    frexp(high, &exponent); /* high is in [2^(exponent - 1), 2^exponent) */
    for (int d = 1; d <= digits; ++d) {
        int place = exponent - d > least ? exponent - d : least;
        double step = ldexp(1.0, place), found = rint(best / step) * step;
        if (!(found >= low && found <= high)) found = ceil(low / step) * step;
        if (found >= low && found <= high && rounded(found, half) == found) return found;
    }
    return rounded(best, half);
}

/* ---- The true ray ---------------------------------------------------------------------------- */

typedef struct {
    double absorbance, seen;
    int64_t opaque;
} mixture;

static mixture mixture_of(const workshop *w, const moit_group *group, int k) {
    mixture mix = {0.0, 1.0, 0};
    for (int64_t m = group->begin; m < group->end; ++m) {
        const moit_member *one = &w->groups.members[m];
        double part = moit_part_of(moit_alpha_of(w->job->samples, one->sample, k), one->share);
        if (part == 1.0) ++mix.opaque;
        else mix.absorbance -= moit_log1p(-part);
    }
    if (mix.absorbance > 0.0) mix.seen = -moit_expm1(-mix.absorbance) / mix.absorbance;
    return mix;
}

/* What is seen of a light of a group without anything in front. */
static double light_of(const workshop *w, const moit_group *group, int l, const mixture *mixes) {
    const moit_simplifying *how = w->job->how;
    int k = how->dimmed_by[l];
    double sum = 0.0;
    for (int64_t m = group->begin; m < group->end; ++m) {
        const moit_member *one = &w->groups.members[m];
        double alpha = moit_alpha_of(w->job->samples, one->sample, k);
        double part = moit_part_of(alpha, one->share);
        double light = (double)how->light[l * all_samples(w->job) + one->sample]
                       * moit_light_of_part(alpha, one->share);
        if (group->end - group->begin == 1) sum += light;
        else if (mixes[k].opaque) sum += part == 1.0 ? light / (double)mixes[k].opaque : 0.0;
        else sum += light * (part > 0.0 ? -moit_log1p(-part) / part : 1.0) * mixes[k].seen;
    }
    return sum;
}

/* Adds a group as a piece. false: it cannot be one. */
static bool add_group(workshop *w, int64_t b) {
    const moit_group *group = &w->groups.groups[b];
    const int alphas = w->job->samples->alphas;
    mixture mixes[MOIT_MOST_ALPHAS];
    double alpha[MOIT_MOST_ALPHAS], light[MOIT_MOST_DEEP_LIGHTS], far = group->far;
    int opaque = 0;
    for (int k = 0; k < alphas; ++k) {
        mixes[k] = mixture_of(w, group, k);
        alpha[k] = mixes[k].opaque ? 1.0 : -moit_expm1(-mixes[k].absorbance);
        opaque += mixes[k].opaque > 0;
    }
    if (opaque && far > group->near) { /* seen where it begins, if that is so of all of it */
        bool meets = b > 0 && w->groups.groups[b - 1].far == group->near
                     && w->groups.groups[b - 1].near == group->near;
        if (opaque < alphas || meets) return false;
        far = group->near;
    }
    for (int l = 0; l < w->job->how->lights; ++l) light[l] = light_of(w, group, l, mixes);
    moit_add_piece(&w->truth, b, group->near, far, alpha, light);
    return true;
}

/* What a piece must not be mixed with others of; false where its own members differ. */
static bool identify(workshop *w, int64_t b) {
    const moit_group *group = &w->groups.groups[b];
    const int64_t *identity = w->job->how->identity;
    w->identity[b] = identity[w->groups.members[group->begin].sample];
    for (int64_t m = group->begin; m < group->end; ++m)
        if (identity[w->groups.members[m].sample] != w->identity[b]) return false;
    return true;
}

static void find_tolerances(workshop *w) {
    const moit_simplifying *how = w->job->how;
    int alphas = w->job->samples->alphas;
    w->scale = 1.0;
    for (int64_t b = 0; b <= w->truth.count; ++b)
        for (int v = alphas; v < w->truth.width; ++v)
            w->scale = fmax(w->scale, fabs(moit_state(&w->truth, b)[v]));
    for (int v = 0; v < w->truth.width; ++v)
        w->tolerance[v] = how->error * margin * (v < alphas ? 1.0 : w->scale);
}

/* The next depth of a pixel behind that of end `e` of group `b`; infinity where there is none. */
static double next_depth(const workshop *w, int64_t b, int e) {
    const moit_group *groups = w->groups.groups;
    double depth = e ? groups[b].far : groups[b].near;
    for (; b < w->groups.count; ++b, e = 0) {
        if (!e && groups[b].near > depth) return groups[b].near;
        if (groups[b].far > depth) return groups[b].far;
    }
    return HUGE_VAL;
}

/* Moves a pixel's depths to such as have few digits, in the same order. Each stays in front of
 * where the next was, so that the next can stay where it is, whatever there is no room for. */
static void move_depths(workshop *w) {
    const double share = w->job->how->depth_error;
    const bool half = w->job->how->depth_is_half;
    double was = -HUGE_VAL, is = -HUGE_VAL;
    for (int64_t b = 0; b < w->groups.count; ++b) {
        double *ends[] = {&w->groups.groups[b].near, &w->groups.groups[b].far};
        for (int e = 0; e < 2; ++e) {
            double depth = *ends[e], reach = share * fabs(depth);
            if (depth != was) {
                double low = depth - reach, high = depth + reach, next = next_depth(w, b, e);
                if (low <= is) low = (double)nextafterf((float)is, HUGE_VALF);
                if (high >= next) high = (double)nextafterf((float)next, -HUGE_VALF);
                was = depth;
                is = high < (double)FLT_MAX ? shortest(low, high, depth, half) : depth;
            }
            *ends[e] = is;
        }
    }
}

/* MOIT_OK with *able, whether the pixel can be simplified; or MOIT_NO_MEMORY. */
static moit_status make_truth(workshop *w, int64_t pixel, bool *able) {
    const moit_deep *s = w->job->samples;
    moit_status status = moit_group_samples(&w->groups, s, pixel);
    if (status != MOIT_OK) return status;
    if (w->job->how->depth_error > 0.0) move_depths(w);
    int64_t pieces = w->groups.count;
    int width = s->alphas + w->job->how->lights;
    moit_ray_curve *curves[] = {&w->truth, &w->made};
    for (int i = 0; i < 2; ++i) {
        curves[i]->alphas = s->alphas;
        curves[i]->width = width;
        curves[i]->dimmed_by = w->job->how->dimmed_by;
        if (!moit_curve_room(curves[i], pieces)) return MOIT_NO_MEMORY;
        for (int v = 0; v < width; ++v) moit_state(curves[i], 0)[v] = v < s->alphas;
    }
    w->plan.identity = NULL;
    if (w->job->how->identity) {
        if (!moit_grow(&w->identity, &w->identity_room, pieces, sizeof *w->identity))
            return MOIT_NO_MEMORY;
        w->plan.identity = w->identity;
    }
    w->truth.count = pieces;
    *able = true;
    for (int64_t b = 0; b < pieces && *able; ++b)
        *able = add_group(w, b) && (!w->plan.identity || identify(w, b));
    if (*able) find_tolerances(w);
    return MOIT_OK;
}

/* ---- What leads from one state to another ---------------------------------------------------- */

static double chosen(const workshop *w, double low, double high, double best, bool half) {
    if (w->job->how->shortest) return shortest(low, high, best, half);
    double found = rounded(best, half);
    return found >= low && found <= high ? found : shortest(low, high, best, half);
}

/* An alpha that leads from one transmittance to another between two ends. */
static double alpha_between(const workshop *w, double from, double low, double high, double best) {
    bool half = w->job->how->alpha_is_half;
    if (best == 0.0) return 1.0;
    if (!(from > 0.0)) return 0.0;
    double goal = fmax(0.0, 1.0 - best / from);
    double least = fmax(0.0, 1.0 - high / from), most = 1.0 - low / from;
    most = fmin(most, fmax(goal, 1.0 - 0x1p-11)); /* opaque is what nothing is seen behind */
    if (goal > 0.0) least = fmax(least, fmin(0.5 * goal, most));
    return chosen(w, least, most, goal, half);
}

static double light_between(const workshop *w, int l, double through, double from, double low,
                            double high, double best) {
    if (!(through > 0.0)) return 0.0;
    return chosen(w, (low - from) / through, (high - from) / through, (best - from) / through,
                  w->job->how->light_is_half[l]);
}

/* ---- Samples --------------------------------------------------------------------------------- */

static double *made_state(workshop *w, int64_t b) { return moit_state(&w->made, b); }

/* Sets the next sample, from state `at` of what is made, to lead between w->plan.low and high, as
 * near to state `b` of the truth as that. */
static void put_sample(workshop *w, int64_t at, int64_t index, double near, double far, int64_t b) {
    const simplify_job *job = w->job;
    const int alphas = job->samples->alphas;
    const double *from = made_state(w, at), *truth = moit_state(&w->truth, b);
    double *low = w->plan.low, *high = w->plan.high;
    const double *goal = truth;
    if (w->freedom < 2.0) { /* volumes of the plan begin where it leads */
        goal = moit_planned(&w->plan, b);
        for (int v = 0; v < w->truth.width; ++v) {
            low[v] = fmax(low[v], fmin(goal[v] - w->freedom * w->tolerance[v], high[v]));
            high[v] = fmin(high[v], fmax(goal[v] + w->freedom * w->tolerance[v], low[v]));
        }
    }
    double alpha[MOIT_MOST_ALPHAS], light[MOIT_MOST_DEEP_LIGHTS];
    for (int k = 0; k < alphas; ++k) {
        double best = truth[k] == 0.0 ? 0.0 : fmin(fmax(goal[k], low[k]), high[k]);
        alpha[k] = alpha_between(w, from[k], low[k], high[k], best);
        job->out->alpha[k * all_samples(job) + index] = (float)alpha[k];
    }
    for (int l = 0; l < job->how->lights; ++l) {
        int v = alphas + l;
        double best = fmin(fmax(goal[v], low[v]), high[v]);
        light[l] =
            light_between(w, l, from[job->how->dimmed_by[l]], from[v], low[v], high[v], best);
        job->out->light[l * all_samples(job) + index] = (float)light[l];
    }
    job->out->front[index] = (float)near;
    job->out->back[index] = (float)far;
    moit_add_piece(&w->made, at, near, far, alpha, light);
}

/* The sample of pieces [begin, end) that hides most. */
static int64_t source_of(const workshop *w, int64_t begin, int64_t end) {
    int64_t found = -1;
    double most = -1.0;
    for (int64_t b = begin; b < end; ++b) {
        double through = moit_state(&w->truth, b)[0];
        const moit_group *group = &w->groups.groups[b];
        for (int64_t m = group->begin; m < group->end; ++m) {
            const moit_member *one = &w->groups.members[m];
            double part = moit_part_of(moit_alpha_of(w->job->samples, one->sample, 0), one->share);
            if (through * part > most) {
                most = through * part;
                found = one->sample;
            }
        }
    }
    return found;
}

/* The next sample as a volume: ever nearer to the truth where it ends, until the curve in between
 * is within the corridor. */
static bool put_volume(workshop *w, int64_t at, int64_t index, const moit_stand_in *one,
                       int64_t plateau) {
    double near = w->truth.near[one->begin], far = w->truth.far[one->end - 1];
    const double *truth = moit_state(&w->truth, one->end);
    moit_ray_curve *slope = &w->plan.slope;
    for (double share = 0.5; share > 0x1p-12; share *= 0.125) {
        if (!moit_corridor(&w->plan, one->end, plateau)) return false;
        for (int v = 0; v < w->truth.width; ++v) {
            w->plan.low[v] = fmax(w->plan.low[v], truth[v] - share * w->tolerance[v]);
            w->plan.high[v] = fmin(w->plan.high[v], truth[v] + share * w->tolerance[v]);
        }
        put_sample(w, at, index, near, far, one->end);
        size_t bytes = 2 * (size_t)w->truth.width * sizeof(double);
        memcpy(moit_state(slope, 0), made_state(w, at), bytes);
        slope->near[0] = near;
        slope->far[0] = far;
        if (moit_curves_differ(&w->truth, one->begin, one->end, slope, w->tolerance, NULL) <= 1.0)
            return true;
    }
    return false;
}

/* The samples of a plan, from `first` on. false: a number cannot be as it has to. */
static bool put_samples(workshop *w, int64_t first) {
    const moit_plan *plan = &w->plan;
    for (int64_t n = 0; n < plan->count; ++n) {
        const moit_stand_in *one = &plan->stand_ins[n];
        int64_t plateau = n + 1 < plan->count ? plan->stand_ins[n + 1].begin : w->truth.count;
        w->job->out->source[first + n] = source_of(w, one->begin, one->end);
        if (one->kind == MOIT_VOLUME) {
            if (!put_volume(w, n, first + n, one, plateau)) return false;
            continue;
        }
        double near = w->truth.near[one->begin];
        bool volume = w->truth.far[one->begin] > near; /* seen from where it begins on */
        if (!moit_corridor(&w->plan, volume ? one->begin : one->begin + 1, plateau)) return false;
        put_sample(w, n, first + n, near, near, plateau);
    }
    w->made.count = plan->count;
    return true;
}

/* Whether what was made is within the error; worst has how far from the truth it is. */
static bool is_within_error(workshop *w, double worst[2]) {
    double unit[MOIT_MOST_ALPHAS + MOIT_MOST_DEEP_LIGHTS];
    for (int v = 0; v < w->truth.width; ++v) unit[v] = v < w->job->samples->alphas ? 1.0 : w->scale;
    moit_curves_differ(&w->truth, 0, w->truth.count, &w->made, unit, worst);
    return worst[0] <= w->job->how->error && worst[1] <= w->job->how->error;
}

static void keep_pixel(const simplify_job *job, int64_t pixel) {
    const moit_deep *s = job->samples;
    const int64_t samples = all_samples(job);
    for (int64_t i = s->offsets[pixel]; i < s->offsets[pixel + 1]; ++i) {
        job->out->source[i] = i;
        job->out->front[i] = s->front[i];
        job->out->back[i] = s->back ? s->back[i] : s->front[i];
        for (int k = 0; k < s->alphas; ++k)
            job->out->alpha[k * samples + i] = s->alpha[k * samples + i];
        for (int l = 0; l < job->how->lights; ++l)
            job->out->light[l * samples + i] = job->how->light[l * samples + i];
    }
    job->out->counts[pixel] = s->offsets[pixel + 1] - s->offsets[pixel];
    job->out->worst[2 * pixel] = job->out->worst[2 * pixel + 1] = 0.0;
}

static moit_status simplify_pixel(workshop *w, int64_t pixel) {
    const moit_deep *s = w->job->samples;
    int64_t first = s->offsets[pixel], samples = s->offsets[pixel + 1] - first;
    bool able = false;
    moit_status status = samples ? make_truth(w, pixel, &able) : MOIT_OK;
    if (status == MOIT_OK && able) {
        w->plan.truth = &w->truth;
        w->plan.tolerance = w->tolerance;
        able = false;
        /* Volumes may fail by the numbers that a file holds. Such as are nearer to a plan that
         * leaves them room mostly do not, and surfaces never. */
        for (int k = w->job->how->volumes ? 0 : ATTEMPTS; k <= ATTEMPTS && !able; ++k) {
            w->plan.volumes = k < ATTEMPTS;
            w->freedom = k < ATTEMPTS ? attempts[k].freedom : 2.0;
            w->plan.room_for_numbers = k < ATTEMPTS ? attempts[k].room : 0.0;
            status = moit_make_plan(&w->plan);
            if (status != MOIT_OK) break;
            able = w->plan.count >= 0 && w->plan.count <= samples && put_samples(w, first)
                   && is_within_error(w, w->job->out->worst + 2 * pixel);
        }
        if (able) w->job->out->counts[pixel] = w->plan.count;
    }
    if (!able) keep_pixel(w->job, pixel);
    return status;
}

static moit_status simplify_block(void *context, int64_t block, int thread) {
    (void)thread;
    simplify_job *job = context;
    int64_t first = block * BLOCK, last = first + BLOCK;
    if (last > job->samples->pixels) last = job->samples->pixels;
    moit_status status = MOIT_OK;
    workshop w = {.job = job};
    for (int64_t p = first; p < last && status == MOIT_OK; ++p) status = simplify_pixel(&w, p);
    moit_free_grouping(&w.groups);
    moit_free_curve(&w.truth);
    moit_free_curve(&w.made);
    moit_free_plan(&w.plan);
    free(w.identity);
    return status;
}

moit_status moit_simplify(const moit_deep *samples, const moit_simplifying *how,
                          const moit_simplified *out, const moit_run *run) {
    simplify_job job = {samples, how, out};
    int64_t blocks = (samples->pixels + BLOCK - 1) / BLOCK;
    return moit_parallel_for(run, blocks, simplify_block, &job);
}
