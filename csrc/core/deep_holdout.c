/* Samples as they are seen through others. What coincides shares what is seen by its absorbance:
 * Kainz, Interpreting OpenEXR Deep Pixels. */
#include <math.h>

#include "core/deep_groups.h"
#include "core/elementary.h"
#include "core/offsets.h"
#include "core/threads.h"

enum { BLOCK = 256 }; /* pixels that a thread takes at once */

typedef struct {
    const moit_deep *samples;
    const bool *holds;
    int64_t *offsets; /* counts of pixels, shifted by one, while there is no `out` */
    const moit_held_out *out;
} holdout_job;

/* One alpha's state between groups. What pieces let through is what all let through and what those
 * that hold out have hidden: a sum, in which nothing is lost as in 1 less what pieces hide. */
typedef struct {
    double through; /* of all */
    double hidden;  /* of the light, by samples that hold out */
} eye;

/* Of a group and an alpha: sums over members. */
typedef struct {
    bool is_alone;     /* there is one: what it hides is all seen */
    double absorbance; /* of those that are not opaque */
    double seen;       /* of each unit of absorbance */
    double through;    /* what it lets through */
    int64_t opaque;    /* how many are */
    int64_t kept_opaque;
    double kept, held; /* the coverage of both kinds that the eye sees, relative to `through` */
} mixture;

static double part_alpha(const moit_deep *s, const moit_member *m, int k) {
    return moit_part_of(moit_alpha_of(s, m->sample, k), m->share);
}

/* How much is seen of what a member hides: 1 of a surface that nothing coincides with. */
static double visible(const mixture *mix, double alpha) {
    if (mix->is_alone) return 1.0;
    if (mix->opaque) return alpha == 1.0 ? 1.0 / (double)mix->opaque : 0.0;
    return alpha > 0.0 ? -moit_log1p(-alpha) / alpha * mix->seen : mix->seen;
}

static mixture mixture_of(const holdout_job *job, const moit_grouping *g, const moit_group *group,
                          int k) {
    mixture mix = {.is_alone = group->end - group->begin == 1};
    if (mix.is_alone) {
        const moit_member *one = &g->members[group->begin];
        double alpha = part_alpha(job->samples, one, k);
        bool is_held = job->holds[one->sample];
        mix.opaque = alpha == 1.0;
        mix.kept_opaque = mix.opaque && !is_held;
        mix.through = 1.0 - alpha;
        *(is_held ? &mix.held : &mix.kept) = alpha;
        return mix;
    }
    double held = 0.0;
    for (int64_t m = group->begin; m < group->end; ++m) {
        double alpha = part_alpha(job->samples, &g->members[m], k);
        bool is_held = job->holds[g->members[m].sample];
        if (alpha == 1.0) {
            ++mix.opaque;
            mix.kept_opaque += !is_held;
        } else {
            double absorbance = -moit_log1p(-alpha);
            mix.absorbance += absorbance;
            if (is_held) held += absorbance;
            else mix.kept += absorbance;
        }
    }
    if (mix.opaque) {
        mix.kept = (double)mix.kept_opaque / (double)mix.opaque;
        mix.held = (double)(mix.opaque - mix.kept_opaque) / (double)mix.opaque;
        return mix;
    }
    mix.through = moit_exp(-mix.absorbance);
    mix.seen = mix.absorbance > 0.0 ? -moit_expm1(-mix.absorbance) / mix.absorbance : 1.0;
    mix.kept *= mix.seen;
    mix.held = held * mix.seen;
    return mix;
}

typedef struct {
    double alpha, gain;
} seen_part;

/* One member that does not hold out. `all` is what its kind hides in the group, of what the pieces
 * in front of it let through: members share it by their absorbance, so that mixing them gives it
 * again. */
static seen_part seen_of(const holdout_job *job, const moit_member *m, int k, const mixture *mix,
                         const eye *from) {
    double alpha = moit_alpha_of(job->samples, m->sample, k), part = part_alpha(job->samples, m, k);
    double lets = from->through + from->hidden;
    double is_seen = visible(mix, part), light = moit_light_of_part(alpha, m->share) * is_seen;
    if (from->through == 0.0 || lets == 0.0) return (seen_part){0.0, 0.0};
    if (mix->is_alone && from->hidden == 0.0) return (seen_part){part, light};
    light *= from->through / lets;
    double all = mix->kept * from->through / lets;
    bool opaque = mix->opaque > 0 && from->hidden == 0.0 && mix->kept_opaque == mix->opaque;
    if (opaque) /* the mean of opaque ones is seen, and of nothing else here */
        return part == 1.0 ? (seen_part){1.0, light * (double)mix->opaque} : (seen_part){0.0, 0.0};
    if (all <= 0.0) return (seen_part){0.0, light};
    if (all > 1.0 - 0x1p-53) all = 1.0 - 0x1p-53; /* only rounding makes it opaque */
    double absorbance = -moit_log1p(-all), own = part * is_seen / mix->kept * absorbance;
    double covers = -moit_expm1(-own);
    return (seen_part){covers, light * (absorbance / all) * (own > 0.0 ? covers / own : 1.0)};
}

static void put(const holdout_job *job, int64_t at, const moit_group *group, int64_t sample,
                const seen_part *seen) {
    const moit_held_out *out = job->out;
    int64_t pieces = job->offsets[job->samples->pixels];
    out->source[at] = sample;
    out->front[at] = (float)group->near;
    out->back[at] = (float)group->far;
    for (int k = 0; k < job->samples->alphas; ++k) {
        out->alpha[k * pieces + at] = seen[k].alpha;
        out->gain[k * pieces + at] = seen[k].gain;
    }
}

/* A pixel that nothing holds out. */
static int64_t keep_pixel(const holdout_job *job, int64_t pixel, int64_t at) {
    const moit_deep *s = job->samples;
    int64_t first = s->offsets[pixel], last = s->offsets[pixel + 1];
    for (int64_t i = first; job->out && i < last; ++i) {
        seen_part own[MOIT_MOST_ALPHAS];
        for (int k = 0; k < s->alphas; ++k) own[k] = (seen_part){moit_alpha_of(s, i, k), 1.0};
        moit_group whole = {moit_front_of(s, i), moit_back_of(s, i), 0, 0};
        put(job, at + i - first, &whole, i, own);
    }
    return last - first;
}

/* How many pieces a pixel gives, and where there is `out` the pieces from `at` on; -1 where there
 * is no memory. */
static int64_t hold_out_pixel(const holdout_job *job, moit_grouping *g, int64_t pixel, int64_t at) {
    const moit_deep *s = job->samples;
    bool any = false;
    for (int64_t i = s->offsets[pixel]; i < s->offsets[pixel + 1] && !any; ++i) any = job->holds[i];
    if (!any) return keep_pixel(job, pixel, at);
    if (moit_group_samples(g, s, pixel) != MOIT_OK) return -1;
    eye eyes[MOIT_MOST_ALPHAS] = {{1.0, 0.0}, {1.0, 0.0}, {1.0, 0.0}};
    int64_t pieces = 0;
    for (int64_t i = 0; i < g->count; ++i) {
        const moit_group *group = &g->groups[i];
        mixture mixes[MOIT_MOST_ALPHAS];
        for (int k = 0; k < s->alphas; ++k) mixes[k] = mixture_of(job, g, group, k);
        for (int64_t m = group->begin; m < group->end; ++m) {
            const moit_member *member = &g->members[m];
            if (job->holds[member->sample]) continue;
            seen_part seen[MOIT_MOST_ALPHAS];
            bool is_seen = false;
            for (int k = 0; k < s->alphas; ++k) {
                seen[k] = seen_of(job, member, k, &mixes[k], &eyes[k]);
                is_seen |= seen[k].alpha > 0.0 || seen[k].gain > 0.0;
            }
            if (!is_seen) continue;
            if (job->out) put(job, at + pieces, group, member->sample, seen);
            ++pieces;
        }
        for (int k = 0; k < s->alphas; ++k) {
            eyes[k].hidden += eyes[k].through * mixes[k].held;
            eyes[k].through *= mixes[k].through;
        }
    }
    return pieces;
}

static moit_status hold_out_block(void *context, int64_t block, int thread) {
    (void)thread;
    holdout_job *job = context;
    int64_t first = block * BLOCK, last = first + BLOCK;
    if (last > job->samples->pixels) last = job->samples->pixels;
    moit_status status = MOIT_OK;
    moit_grouping grouping = {0};
    for (int64_t p = first; p < last && status == MOIT_OK; ++p) {
        int64_t pieces = hold_out_pixel(job, &grouping, p, job->out ? job->offsets[p] : 0);
        if (pieces < 0) status = MOIT_NO_MEMORY;
        else if (!job->out) job->offsets[p + 1] = pieces;
    }
    moit_free_grouping(&grouping);
    return status;
}

static int64_t blocks_of(int64_t pixels) { return (pixels + BLOCK - 1) / BLOCK; }

moit_status moit_held_out_offsets(const moit_deep *samples, const bool *holds, int64_t *offsets,
                                  const moit_run *run) {
    holdout_job job = {samples, holds, offsets, NULL};
    moit_status status = moit_parallel_for(run, blocks_of(samples->pixels), hold_out_block, &job);
    if (status != MOIT_OK) return status;
    moit_offsets_of_counts(offsets, samples->pixels);
    return MOIT_OK;
}

moit_status moit_hold_out(const moit_deep *samples, const bool *holds, const int64_t *offsets,
                          const moit_held_out *out, const moit_run *run) {
    holdout_job job = {samples, holds, (int64_t *)offsets, out};
    return moit_parallel_for(run, blocks_of(samples->pixels), hold_out_block, &job);
}
