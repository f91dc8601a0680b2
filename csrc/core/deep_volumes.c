/* Volume samples of deep images as fragments.
 *
 * A volume sample fills [front, back) with a medium of constant density: of opacity alpha it
 * hides 1 - (1 - alpha)^x up to the share x of its depth, and emits its colour evenly. Kainz,
 * Interpreting OpenEXR Deep Pixels; Hillman, The Theory of OpenEXR Deep Samples. There colours
 * are multiplied by alpha. Divided by it they are simpler: a part of a sample keeps its colour,
 * has the absorbance u = -x log(1 - alpha), and coincident parts mix as
 *
 *     alpha = 1 - exp(-sum u),    colour = sum(u colour) / sum u. */
#include <math.h>
#include <stdlib.h>

#include "moit.h"
#include "core/threads.h"

/* What happens at a depth, in this order: half open volumes end, surfaces come before what
 * begins with them (the document sorts by front, then back), volumes begin. */
enum { END, POINT, START };

typedef struct {
    float depth;
    int kind;
    int64_t sample;
} event;

typedef struct {
    const moit_deep_samples *samples;
    event *events;   /* two for each sample of a pixel */
    int64_t *active; /* the volumes that fill the depth just passed, in arrival order */
} sweep;

typedef struct {
    float *depth, *alpha, *color;
} pieces;

static int by_depth(const void *left, const void *right) {
    const event *a = left, *b = right;
    if (a->depth != b->depth) return a->depth < b->depth ? -1 : 1;
    if (a->kind != b->kind) return a->kind - b->kind;
    return (a->sample > b->sample) - (a->sample < b->sample);
}

static bool is_volume(const moit_deep_samples *s, int64_t i) { return s->front[i] < s->back[i]; }

static void put_sample(const moit_deep_samples *s, int64_t i, const pieces *out, int64_t at) {
    out->depth[at] = s->front[i];
    out->alpha[at] = s->alpha[i];
    for (int c = 0; s->color && c < 3; ++c) out->color[3 * at + c] = s->color[3 * i + c];
}

/* All volumes of `active` between two depths, as one piece. Opaque ones hide the rest, also of
 * one another: their mean, as a pair of them in the document. */
static void put_mixture(const moit_deep_samples *s, const int64_t *active, int64_t count,
                        double near, double far, const pieces *out, int64_t at) {
    bool opaque = false;
    for (int64_t k = 0; k < count; ++k) opaque |= s->alpha[active[k]] == 1.0f;
    double total = 0.0, color[3] = {0.0, 0.0, 0.0};
    for (int64_t k = 0; k < count; ++k) {
        int64_t i = active[k];
        double share = (far - near) / ((double)s->back[i] - (double)s->front[i]);
        double u = opaque ? s->alpha[i] == 1.0f : -share * log1p(-(double)s->alpha[i]);
        total += u;
        for (int c = 0; s->color && c < 3; ++c) color[c] += u * (double)s->color[3 * i + c];
    }
    out->depth[at] = (float)near;
    out->alpha[at] = opaque ? 1.0f : (float)-expm1(-total);
    for (int c = 0; s->color && c < 3; ++c)
        out->color[3 * at + c] = total > 0.0 ? (float)(color[c] / total) : 0.0f;
}

/* The piece between two depths. A sample that nothing cuts or overlaps stays as it is, bit for
 * bit, and so does the colour of a part. */
static void put_piece(const moit_deep_samples *s, const int64_t *active, int64_t count, float near,
                      float far, const pieces *out, int64_t at) {
    int64_t i = active[0];
    if (count == 1 && near == s->front[i] && far == s->back[i]) {
        put_sample(s, i, out, at);
        return;
    }
    put_mixture(s, active, count, (double)near, (double)far, out, at);
    for (int c = 0; count == 1 && s->color && c < 3; ++c)
        out->color[3 * at + c] = s->color[3 * i + c];
}

static int64_t without_ended(const moit_deep_samples *s, int64_t *active, int64_t count,
                             float depth) {
    int64_t kept = 0;
    for (int64_t k = 0; k < count; ++k)
        if (s->back[active[k]] > depth) active[kept++] = active[k];
    return kept;
}

/* How many fragments the samples [first, last) of one pixel give; writes them from out->depth[at]
 * on where `out` is not NULL. A pixel without volumes keeps its arrival order. */
static int64_t split_pixel(const sweep *w, int64_t first, int64_t last, const pieces *out,
                           int64_t at) {
    const moit_deep_samples *s = w->samples;
    int64_t count = 0, active = 0, begin = at;
    for (int64_t i = first; i < last; ++i) {
        bool volume = is_volume(s, i);
        w->events[count++] = (event){s->front[i], volume ? START : POINT, i};
        if (volume) w->events[count++] = (event){s->back[i], END, i};
    }
    if (count == last - first) {
        for (int64_t i = first; out && i < last; ++i) put_sample(s, i, out, at + i - first);
        return last - first;
    }
    qsort(w->events, (size_t)count, sizeof(event), by_depth);
    for (int64_t e = 0; e < count;) {
        float depth = w->events[e].depth;
        if (w->events[e].kind == END) active = without_ended(s, w->active, active, depth);
        do {
            if (w->events[e].kind == START) w->active[active++] = w->events[e].sample;
            if (w->events[e].kind != POINT) continue;
            if (out) put_sample(s, w->events[e].sample, out, at);
            ++at;
        } while (++e < count && w->events[e].depth == depth);
        if (!active || e == count) continue; /* what is active ends at a later event */
        if (out) put_piece(s, w->active, active, depth, w->events[e].depth, out, at);
        ++at;
    }
    return at - begin;
}

typedef struct {
    const moit_deep_samples *samples;
    int64_t *offsets; /* of the pieces; their numbers are put at p + 1 where `out` is NULL */
    const pieces *out;
} split_job;

enum { BLOCK = 1024 }; /* pixels of one work item */

static moit_status split_block(void *context, int64_t item, int thread) {
    (void)thread;
    const split_job *job = context;
    const moit_deep_samples *s = job->samples;
    int64_t first = item * BLOCK, most = 1;
    int64_t last = first + BLOCK < s->pixels ? first + BLOCK : s->pixels;
    for (int64_t p = first; p < last; ++p) {
        int64_t n = s->offsets[p + 1] - s->offsets[p];
        if (n > most) most = n;
    }
    moit_status status = MOIT_OK;
    sweep w = {.samples = s,
               .events = malloc((size_t)most * 2 * sizeof(event)),
               .active = malloc((size_t)most * sizeof(int64_t))};
    if (!w.events || !w.active) {
        status = MOIT_NO_MEMORY;
        goto done;
    }
    for (int64_t p = first; p < last; ++p) {
        int64_t begin = s->offsets[p], end = s->offsets[p + 1];
        if (job->out) split_pixel(&w, begin, end, job->out, job->offsets[p]);
        else job->offsets[p + 1] = split_pixel(&w, begin, end, NULL, 0);
    }
done:
    free(w.events);
    free(w.active);
    return status;
}

static int64_t blocks_of(int64_t pixels) { return (pixels + BLOCK - 1) / BLOCK; }

moit_status moit_volume_offsets(const moit_deep_samples *samples, int64_t *offsets,
                                const moit_run *run) {
    split_job job = {.samples = samples, .offsets = offsets};
    moit_status status = moit_parallel_for(run, blocks_of(samples->pixels), split_block, &job);
    if (status != MOIT_OK) return status;
    offsets[0] = 0;
    for (int64_t p = 0; p < samples->pixels; ++p) offsets[p + 1] += offsets[p];
    return MOIT_OK;
}

moit_status moit_split_volumes(const moit_deep_samples *samples, const int64_t *offsets,
                               float *depth, float *alpha, float *color, const moit_run *run) {
    const pieces out = {depth, alpha, color};
    split_job job = {.samples = samples, .offsets = (int64_t *)offsets, .out = &out};
    return moit_parallel_for(run, blocks_of(samples->pixels), split_block, &job);
}
