/* Pictures and transmittances of power moments in float32, backwards in floats: rules and sums over
 * fragments are double, all else has a float's digits and twice the lanes. */
#include "core/adjoints/single.h"

#include "core/elementary.h"
#include "core/techniques/moments.h"
#include "core/techniques/table.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* With less, nodes of a rule may lie nearer to one another than floats hold powers of. */
#define LEAST_BIAS 1e-8

/* Of six and eight, floats lose the third digit of what depths change by, where surfaces are
 * close. */
enum { MOST_COUNT = 4 };

bool moit_is_single(const moit_job *job) {
    const moit_technique *technique = job->technique;
    return job->fragments->precision == MOIT_FLOAT32 && technique->kind == MOIT_POWER_MOMENTS
           && technique->count <= MOST_COUNT && technique->moments.bits != 16
           && !technique->moments.halves && technique->resolution <= 1
           && !technique->range_per_pixel && !job->blocks && job->bias >= LEAST_BIAS;
}

static const moit_single_adjoints *adjoints_of(moit_isa isa) {
    if (!moit_isa_supported(isa)) isa = MOIT_ISA_BASE;
#if defined(__x86_64__) && !defined(MOIT_NO_AVX2)
    if (isa == MOIT_ISA_AVX2) return &moit_single_adjoints_avx2;
#endif
#if defined(__x86_64__) && !defined(MOIT_NO_AVX512)
    if (isa == MOIT_ISA_AVX512) return &moit_single_adjoints_avx512;
#endif
    return &moit_single_adjoints_base;
}

/* Pixels that go back in double: of each its place in the tile, and the numbers of it and of its
 * fragments, one pixel after the other. */
typedef struct {
    int32_t *pixel, *offsets;
    double *rules, *b0, *by_b0;
    double *z, *a, *by, *by_z, *by_a, *kept;
} hard_pixels;

typedef struct {
    float *kept, *A, *T, *by_A, *by_a, *by_z, *by_alpha, *by_depth, *by_color;
    double *b, *sums, *by_sums, *by_b0, *by_behind, *shown;
    int32_t *pixel, *offsets; /* of pixels with fragments, of the tile's */
    bool *is_hard;
    hard_pixels hard;
    int64_t apart;
} room;

/* Hands out aligned room; with no memory it only counts. */
static void *some(char *memory, size_t *used, size_t count, size_t size) {
    char *start = memory ? memory + *used : NULL;
    *used += (count * size + 63) / 64 * 64;
    return start;
}

/* Room for `n` padded fragments; how many bytes of `memory` that is. */
static size_t lay_out(size_t n, size_t pixels, char *memory, room *r) {
    size_t used = 0, few = pixels < n ? pixels : n; /* that have fragments */
    hard_pixels *hard = &r->hard;
    struct {
        void *start;
        size_t count, size;
    } parts[] = {{&r->sums, 4 * pixels, sizeof(double)},
                 {&r->by_sums, 4 * pixels, sizeof(double)},
                 {&r->by_b0, pixels, sizeof(double)},
                 {&r->by_behind, 3 * pixels, sizeof(double)},
                 {&r->shown, 4 * pixels, sizeof(double)},
                 {&r->pixel, pixels + 1, sizeof(int32_t)},
                 {&r->offsets, pixels + 2, sizeof(int32_t)},
                 {&r->b, MOIT_MOST_NUMBERS * pixels, sizeof(double)},
                 {&r->kept, MOIT_KEPT * n, sizeof(float)},
                 {&r->A, n, sizeof(float)},
                 {&r->T, n, sizeof(float)},
                 {&r->by_A, n, sizeof(float)},
                 {&r->by_a, n, sizeof(float)},
                 {&r->by_z, n, sizeof(float)},
                 {&r->by_alpha, n, sizeof(float)},
                 {&r->by_depth, n, sizeof(float)},
                 {&r->by_color, 3 * n, sizeof(float)},
                 {&r->is_hard, pixels, sizeof(bool)},
                 {&hard->pixel, few, sizeof(int32_t)},
                 {&hard->offsets, few + 1, sizeof(int32_t)},
                 {&hard->rules, MOIT_MOST_RULE * few, sizeof(double)},
                 {&hard->b0, few, sizeof(double)},
                 {&hard->by_b0, few, sizeof(double)},
                 {&hard->z, n, sizeof(double)},
                 {&hard->a, n, sizeof(double)},
                 {&hard->by, n, sizeof(double)},
                 {&hard->by_z, n, sizeof(double)},
                 {&hard->by_a, n, sizeof(double)},
                 {&hard->kept, MOIT_KEPT * n, sizeof(double)}};
    for (size_t i = 0; i < sizeof parts / sizeof *parts; ++i) {
        void *start = some(memory, &used, parts[i].count, parts[i].size);
        memcpy(parts[i].start, &start, sizeof start);
    }
    r->apart = (int64_t)n;
    return used;
}

size_t moit_single_scratch(int fragments, int pixels) {
    room r;
    return lay_out((size_t)fragments, (size_t)pixels, NULL, &r);
}

/* Leaves out pixels without fragments, which images have many of: how many are left. */
static int leave_out_empty(const moit_tile *tile, const room *r) {
    int filled = 0;
    r->offsets[0] = 0;
    for (int p = 0; p < tile->pixels; ++p) {
        r->pixel[filled] = p;
        r->offsets[filled + 1] = tile->offsets[p + 1];
        filled += tile->offsets[p + 1] > tile->offsets[p];
    }
    return filled;
}

/* The tile's state: its totals and rules in double, of absorbances and z as floats have them. */
static void gather(const moit_job *job, moit_tile *tile, const room *r) {
    const moit_technique *technique = job->technique;
    const moit_moment_steps steps = moit_technique_moments(technique, MOIT_FLOAT64);
    job->stages->absorbance(tile->fragments, tile->alpha, job->max_alpha, tile->absorbance);
    moit_warp_tile(job, tile);
    adjoints_of(job->run->isa)
        ->state(&(moit_single_state){.count = technique->count,
                                     .pixels = tile->pixels,
                                     .offsets = tile->offsets,
                                     .a = tile->absorbance,
                                     .z = tile->z,
                                     .b0 = tile->double_b0,
                                     .b = r->b});
    /* as forwards: next to the least bias, what single doubles round off is nothing */
    job->precise->moments[MOIT_POWER].rules(technique->count, NULL, true, tile->pixels, r->b,
                                            job->bias, steps.safe, steps.least, tile->rules);
    job->precise->decay(tile->pixels, tile->double_b0, tile->total);
}

/* What is behind the tile's pixels, and how alpha moves with what they let through. */
static void find_shown(const moit_job *job, const moit_tile *tile, const moit_single_asked *asked,
                       const room *r) {
    const float *color = job->fragments->color;
    for (int k = 0; k < tile->pixels; ++k) {
        int p = r->pixel[k];
        double *shown = r->shown + 4 * k;
        const double *behind = asked->behind->color;
        if (asked->behind->per_pixel) behind += 3 * (tile->first_pixel + p);
        for (int c = 0; c < 3; ++c) shown[c] = behind[c];
        shown[3] = -1.0;
        if (!tile->opaque || tile->opaque[p] < 0) continue;
        const float *last = color + 3 * (tile->first_fragment + tile->opaque[p]);
        for (int c = 0; c < 3; ++c) shown[c] = (double)last[c];
        shown[3] = 0.0; /* it hides all light: alpha is 1 whatever is in front of it */
    }
}

/* What is behind pixels without fragments is seen as it is. */
static void give_empty(const moit_tile *whole, const moit_single_asked *asked, const room *r) {
    const float *seed = asked->seed + 4 * whole->first_pixel;
    for (int p = 0; p < whole->pixels; ++p)
        for (int c = 0; whole->offsets[p] == whole->offsets[p + 1] && c < 3; ++c)
            r->by_behind[3 * p + c] = (double)seed[4 * p + c];
}

/* By the colours of opaque surfaces, which stand where the picture's background would. */
static void give_opaque(const moit_tile *tile, const moit_single_asked *asked, const room *r) {
    float *to = asked->out->color;
    for (int p = 0; to && tile->opaque && p < tile->pixels; ++p)
        for (int c = 0; tile->opaque[p] >= 0 && c < 3; ++c)
            to[3 * (tile->first_fragment + tile->opaque[p]) + c] = (float)r->by_behind[3 * p + c];
}

/* Of weights whose ratios alone count. Below, they may be next to nothing for floats. */
#define LEAST_SUM 1e-20

/* Pixel p's weights again, where all is behind so much that they are next to nothing: without what
 * is in front of all fragments. */
static void unbury(const moit_job *job, const moit_tile *tile, const room *r, int p) {
    const float *alpha = tile->alpha, *color = tile->color;
    int first = tile->offsets[p], end = tile->offsets[p + 1];
    float least = FLT_MAX;
    for (int i = first; i < end; ++i)
        if (alpha[i] > 0.0f && r->A[i] < least) least = r->A[i];
    if (least == FLT_MAX) return; /* there is nothing but what is clear */
    for (int i = first; i < end; ++i)
        r->T[i] = (float)moit_exp(-(double)fminf(r->A[i] - least, MOIT_MOST_ABSORBED));
    job->stages->blend(1, tile->offsets + p, alpha, tile->emission, r->T, color, r->sums + 4 * p);
}

/* The picture's sums, backwards. */
static void pull_picture(const moit_job *job, const moit_tile *tile, const moit_single_asked *asked,
                         const room *r) {
    const moit_single_adjoints *adjoints = adjoints_of(job->run->isa);
    adjoints->weights(tile->fragments, r->A, r->T);
    job->stages->blend(tile->pixels, tile->offsets, tile->alpha, tile->emission, r->T, tile->color,
                       r->sums);
    for (int p = 0; job->technique->normalize && p < tile->pixels; ++p)
        if (r->sums[4 * p + 3] < LEAST_SUM) unbury(job, tile, r, p);
    find_shown(job, tile, asked, r);
    adjoints->pixels(&(moit_single_pixels){.pixels = tile->pixels,
                                           .pixel = r->pixel,
                                           .scales = job->technique->normalize,
                                           .seed = asked->seed + 4 * tile->first_pixel,
                                           .sums = r->sums,
                                           .shown = r->shown,
                                           .b0 = tile->double_b0,
                                           .total = tile->total,
                                           .by_sums = r->by_sums,
                                           .by_b0 = r->by_b0,
                                           .by_behind = r->by_behind});
    adjoints->sums(&(moit_single_sums){.pixels = tile->pixels,
                                       .offsets = tile->offsets,
                                       .by_sum = r->by_sums,
                                       .T = r->T,
                                       .alpha = tile->alpha,
                                       .emission = tile->emission,
                                       .color = tile->color,
                                       .by_A = r->by_A,
                                       .by_alpha = r->by_alpha,
                                       .by_color = r->by_color});
}

/* The same of transmittances. */
static void pull_fragments(const moit_job *job, const moit_tile *tile,
                           const moit_single_asked *asked, const room *r) {
    const float *seed = asked->seed + tile->first_fragment;
    size_t n = (size_t)tile->fragments;
    adjoints_of(job->run->isa)->weights(tile->fragments, r->A, r->T);
    for (int i = 0; i < tile->fragments; ++i)
        r->by_A[i] = -r->T[i] * seed[tile->source ? tile->source[i] : i];
    memset(r->by_alpha, 0, n * sizeof *r->by_alpha);
    memset(r->by_color, 0, 3 * n * sizeof *r->by_color);
    for (int p = 0; p < tile->pixels; ++p) {
        int opaque = tile->opaque ? tile->opaque[r->pixel[p]] : -1;
        r->by_b0[p] = opaque >= 0 ? -tile->total[p] * (double)seed[opaque] : 0.0;
    }
}

/* Pixel p behind the first `pixels` hard ones; how many these are then. */
static int add_hard(const moit_tile *tile, const room *r, int rule_size, int p, int pixels) {
    const hard_pixels *hard = &r->hard;
    int n = hard->offsets[pixels];
    hard->pixel[pixels] = p;
    hard->b0[pixels] = tile->double_b0[p];
    hard->by_b0[pixels] = r->by_b0[p];
    memcpy(hard->rules + pixels * rule_size, tile->rules + p * rule_size,
           (size_t)rule_size * sizeof *hard->rules);
    for (int i = tile->offsets[p]; i < tile->offsets[p + 1]; ++i, ++n) {
        hard->z[n] = (double)((const float *)tile->z)[i];
        hard->a[n] = (double)((const float *)tile->absorbance)[i];
        hard->by[n] = (double)r->by_A[i];
    }
    hard->offsets[pixels + 1] = n;
    return pixels + 1;
}

/* Of few fragments what is read at a depth and what moments move with it nearly always take each
 * other away: that is for doubles at once. */
enum { FEW = 3 };

static void find_few(const moit_tile *tile, const room *r) {
    for (int p = 0; p < tile->pixels; ++p)
        r->is_hard[p] = tile->offsets[p + 1] - tile->offsets[p] <= FEW;
}

/* How many hard pixels there are. alone_stay: a lone fragment of a pixel is seen as much as it
 * covers, wherever it lies. */
static int gather_hard(const moit_tile *tile, const room *r, int rule_size, bool alone_stay) {
    const hard_pixels *hard = &r->hard;
    int pixels = 0;
    hard->offsets[0] = 0;
    for (int p = 0; p < tile->pixels; ++p) {
        int first = tile->offsets[p], n = tile->offsets[p + 1] - first;
        if (alone_stay && n == 1) {
            r->by_a[first] = (float)r->by_b0[p];
            r->by_z[first] = 0.0f;
        } else if (r->is_hard[p]) pixels = add_hard(tile, r, rule_size, p, pixels);
    }
    int end = hard->offsets[pixels];
    for (int i = end; i < end + MOIT_PADDING; ++i) hard->z[i] = hard->a[i] = hard->by[i] = 0.0;
    return pixels;
}

/* Pixels in double, from what is absorbed in front of their fragments on: in place of what floats
 * have said. */
static void pull_hard(const moit_job *job, const moit_tile *tile, const room *r, bool alone_stay) {
    const moit_technique *technique = job->technique;
    const hard_pixels *hard = &r->hard;
    int rule_size = moit_family_of(technique)->rule_size(technique->count);
    int pixels = gather_hard(tile, r, rule_size, alone_stay);
    if (!pixels) return;
    const moit_ray_adjoints *rays = &moit_moment_adjoints_of(technique, job->run->isa)->rays;
    moit_ray_state state = {.count = technique->count,
                            .pixels = pixels,
                            .offsets = hard->offsets,
                            .z = hard->z,
                            .own = technique->moments.exclude_self ? hard->a : NULL,
                            .rules = hard->rules,
                            .b0 = hard->b0,
                            .beta = technique->moments.overestimation,
                            .kept = hard->kept,
                            .apart = r->apart};
    moit_ray_pull pull = {.by = hard->by,
                          .a = hard->a,
                          .by_b0 = hard->by_b0,
                          .keeps = 1.0 - job->bias,
                          .by_a = hard->by_a,
                          .by_z = hard->by_z};
    rays->absorbance(&state, hard->by_a); /* for what it keeps */
    rays->pull(&state, &pull);
    for (int k = 0; k < pixels; ++k) {
        int first = tile->offsets[hard->pixel[k]] - hard->offsets[k];
        for (int i = hard->offsets[k]; i < hard->offsets[k + 1]; ++i) {
            r->by_a[first + i] = (float)hard->by_a[i];
            r->by_z[first + i] = (float)hard->by_z[i];
        }
    }
}

/* Where a tile's numbers go at once, as its fragments are those that were given. */
static float *place_of(const moit_tile *tile, void *out, int width, float *room) {
    return out && !tile->source ? (float *)out + tile->first_fragment * width : room;
}

/* Numbers of a tile's fragments to where these came from; the others get 0. */
static void give(const moit_tile *tile, void *out, int width, const float *numbers) {
    if (!out || !tile->source) return;
    float *to = (float *)out + tile->first_fragment * width;
    memset(to, 0, (size_t)(tile->given * width) * sizeof *to);
    for (int i = 0; i < tile->fragments; ++i)
        for (int k = 0; k < width; ++k) to[tile->source[i] * width + k] = numbers[i * width + k];
}

bool moit_single_backwards(const moit_job *job, const moit_tile *whole,
                           const moit_single_asked *asked) {
    const moit_single_adjoints *adjoints = adjoints_of(job->run->isa);
    const moit_technique *technique = job->technique;
    room r;
    moit_tile filled = *whole, *tile = &filled;
    lay_out((size_t)tile->given + MOIT_PADDING, (size_t)tile->pixels, tile->own, &r);
    tile->pixels = leave_out_empty(whole, &r);
    tile->offsets = r.offsets;
    r.by_depth = place_of(tile, asked->out->depth, 1, r.by_depth);
    r.by_alpha = place_of(tile, asked->out->alpha, 1, r.by_alpha);
    r.by_color = place_of(tile, asked->out->color, 3, r.by_color);
    gather(job, tile, &r);
    const float *own = technique->moments.exclude_self ? tile->absorbance : NULL;
    moit_ray_state state = {.count = technique->count,
                            .pixels = tile->pixels,
                            .offsets = tile->offsets,
                            .z = tile->z,
                            .own = own,
                            .rules = tile->rules,
                            .b0 = tile->double_b0,
                            .beta = technique->moments.overestimation,
                            .kept = r.kept,
                            .apart = r.apart};
    adjoints->rays.absorbance(&state, r.A);
    (asked->behind ? pull_picture : pull_fragments)(job, tile, asked, &r);
    find_few(tile, &r);
    moit_ray_pull pull = {.by = r.by_A,
                          .a = tile->absorbance,
                          .by_b0 = r.by_b0,
                          .keeps = 1.0 - job->bias,
                          .by_a = r.by_a,
                          .by_z = r.by_z,
                          .is_hard = r.is_hard};
    if (!adjoints->rays.pull(&state, &pull)) return false;
    pull_hard(job, tile, &r, asked->behind && technique->normalize);
    moit_single_slopes slopes = {.n = tile->fragments,
                                 .most = job->max_alpha,
                                 .warp = &job->warp,
                                 .rise = moit_warp_rise(&job->warp),
                                 .by_a = r.by_a,
                                 .by_z = r.by_z,
                                 .alpha = tile->alpha,
                                 .depth = tile->depth,
                                 .by_alpha = r.by_alpha,
                                 .by_depth = r.by_depth};
    if (!adjoints->slopes(&slopes)) return false;
    give(tile, asked->out->depth, 1, r.by_depth);
    give(tile, asked->out->alpha, 1, r.by_alpha);
    give(tile, asked->out->color, 3, r.by_color);
    if (!asked->behind) return true;
    give_empty(whole, asked, &r);
    give_opaque(whole, asked, &r);
    moit_behind_give(asked->behind, whole, r.by_behind);
    return true;
}
