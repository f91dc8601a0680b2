/* Pictures and transmittances of power moments in float32, backwards in floats: rules and sums over
 * fragments are double, all else has a float's digits and twice the lanes. */
#include "core/adjoints/single.h"

#include "core/techniques/moments.h"
#include "core/techniques/table.h"

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

typedef struct {
    float *kept, *A, *T, *by_A, *by_alpha, *by_depth, *by_color;
    double *a, *z, *b, *sums, *by_sums, *by_b0;
    double *hard[5]; /* (fragments) to work with */
    bool *is_hard;
    int64_t apart;
} room;

static room lay_out(const moit_tile *tile) {
    size_t n = (size_t)tile->given + MOIT_PADDING, pixels = (size_t)tile->pixels, used = 0;
    char *memory = tile->own;
    room r = {.apart = (int64_t)n};
    struct {
        float **start;
        size_t count;
    } floats[] = {{&r.kept, MOIT_KEPT * n}, {&r.A, n},        {&r.T, n},           {&r.by_A, n},
                  {&r.by_alpha, n},         {&r.by_depth, n}, {&r.by_color, 3 * n}};
    struct {
        double **start;
        size_t count;
    } doubles[] = {{&r.a, n},
                   {&r.z, n},
                   {&r.sums, 4 * pixels},
                   {&r.by_sums, 4 * pixels},
                   {&r.by_b0, pixels},
                   {&r.b, MOIT_MOST_NUMBERS * pixels}};
    for (size_t i = 0; i < sizeof doubles / sizeof *doubles; ++i) {
        *doubles[i].start = (double *)(void *)(memory + used);
        used += (doubles[i].count * sizeof(double) + 63) / 64 * 64;
    }
    for (size_t i = 0; i < sizeof floats / sizeof *floats; ++i) {
        *floats[i].start = (float *)(void *)(memory + used);
        used += (floats[i].count * sizeof(float) + 63) / 64 * 64;
    }
    for (int k = 0; k < 5; ++k) {
        r.hard[k] = (double *)(void *)(memory + used);
        used += (n * sizeof(double) + 63) / 64 * 64;
    }
    r.is_hard = (bool *)(memory + used);
    return r;
}

/* The tile's state: its totals and rules in double, of absorbances and z as floats have them. */
static void gather(const moit_job *job, moit_tile *tile, const room *r) {
    const moit_technique *technique = job->technique;
    const moit_stages *precise = job->precise;
    const float *a = tile->absorbance, *z = tile->z;
    int count = technique->count;
    job->stages->absorbance(tile->fragments, tile->alpha, job->max_alpha, tile->absorbance);
    moit_warp_tile(job, tile);
    for (int i = 0; i < tile->fragments; ++i) {
        r->a[i] = (double)a[i];
        r->z[i] = (double)z[i];
    }
    if (count == 4)
        precise->plain_power_sums(tile->pixels, tile->offsets, r->a, r->z, tile->double_b0, r->b);
    else
        precise->moments[MOIT_POWER].sums(count, NULL, tile->pixels, tile->offsets, r->a, r->z,
                                          tile->double_b0, r->b);
    moit_moments_read(precise, MOIT_FLOAT64, technique, NULL, job->bias, tile->pixels, r->b,
                      tile->double_b, tile->rules);
    precise->decay(tile->pixels, tile->double_b0, tile->total);
}

/* Of each pixel, by its sums and by the total b0; color_by: by what is behind. */
static void pull_pixels(const moit_job *job, const moit_tile *tile, const moit_single_asked *asked,
                        const room *r) {
    const float *color = job->fragments->color;
    for (int p = 0; p < tile->pixels; ++p) {
        int64_t pixel = tile->first_pixel + p;
        const float *seed = asked->seed + 4 * pixel;
        const double *sum = r->sums + 4 * p, *behind = asked->background;
        double *by_sum = r->by_sums + 4 * p, total = tile->total[p], by_total = 0.0, scale = 1.0;
        bool hides = tile->opaque && tile->opaque[p] >= 0;
        bool scales = job->technique->normalize && sum[3] > 0.0;
        int64_t last = hides ? tile->first_fragment + tile->opaque[p] : 0;
        if (asked->per_pixel) behind += 3 * pixel;
        if (scales) scale = -expm1(-tile->double_b0[p]) / sum[3];
        by_sum[3] = 0.0;
        for (int c = 0; c < 3; ++c) {
            double g = (double)seed[c], shown = hides ? (double)color[3 * last + c] : behind[c];
            double by_behind = g * total;
            by_sum[c] = g * scale;
            by_total += g * shown;
            if (scales) {
                by_sum[3] -= g * sum[c] * scale / sum[3];
                by_total -= g * sum[c] / sum[3];
            }
            if (asked->out->background)
                asked->out->background[3 * pixel + c] = hides ? 0.0 : by_behind;
        }
        /* an opaque surface hides all light: alpha is 1 whatever is in front of it */
        if (!hides) by_total -= (double)seed[3];
        r->by_b0[p] = -total * by_total;
    }
}

/* By the colours of opaque surfaces, which stand where the picture's background would. */
static void give_opaque(const moit_tile *tile, const moit_single_asked *asked) {
    float *to = asked->out->color;
    for (int p = 0; asked->background && to && tile->opaque && p < tile->pixels; ++p)
        for (int c = 0; tile->opaque[p] >= 0 && c < 3; ++c)
            to[3 * (tile->first_fragment + tile->opaque[p]) + c] =
                (float)((double)asked->seed[4 * (tile->first_pixel + p) + c] * tile->total[p]);
}

/* The picture's sums, backwards. */
static void pull_picture(const moit_job *job, const moit_tile *tile, const moit_single_asked *asked,
                         const room *r) {
    const moit_single_adjoints *adjoints = adjoints_of(job->run->isa);
    adjoints->weights(job->technique->normalize, tile->pixels, tile->offsets, tile->alpha, r->A,
                      r->T);
    job->stages->blend(tile->pixels, tile->offsets, tile->alpha, tile->emission, r->T, tile->color,
                       r->sums);
    pull_pixels(job, tile, asked, r);
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
    adjoints_of(job->run->isa)
        ->weights(false, tile->pixels, tile->offsets, tile->alpha, r->A, r->T);
    for (int i = 0; i < tile->fragments; ++i)
        r->by_A[i] = -r->T[i] * seed[tile->source ? tile->source[i] : i];
    memset(r->by_alpha, 0, n * sizeof *r->by_alpha);
    memset(r->by_color, 0, 3 * n * sizeof *r->by_color);
    for (int p = 0; p < tile->pixels; ++p) {
        bool hides = tile->opaque && tile->opaque[p] >= 0;
        r->by_b0[p] = hides ? -tile->total[p] * (double)seed[tile->opaque[p]] : 0.0;
    }
}

/* A pixel in double, from what is absorbed in front of its fragments on; s: of any pixel. */
static void pull_hard(const moit_job *job, const moit_tile *tile, const moit_single_asked *asked,
                      const room *r, int p, moit_moment_state s) {
    double *by = r->hard[0], *by_z = r->hard[1], *by_a = r->hard[2];
    const float *alpha = tile->alpha, *depth = tile->depth, *color = tile->color;
    int first = tile->offsets[p], n = tile->offsets[p + 1] - first;
    s.n = s.surfaces = n;
    s.rule = tile->rules + p * s.rule_size;
    s.a = r->a + first;
    s.z = r->z + first;
    s.b0 = tile->double_b0[p];
    for (int i = 0; i < n; ++i) {
        by[i] = (double)r->by_A[first + i];
        by_z[i] = by_a[i] = 0.0;
    }
    moit_readings at = {.n = n,
                        .z = s.z,
                        .own = job->technique->moments.exclude_self ? s.a : NULL,
                        .by = by,
                        .by_z = by_z,
                        .by_own = by_a};
    moit_pull_state(&s, r->by_b0[p], &at, r->hard[3], r->hard[4], by_z, by_a);
    double rise = moit_warp_rise(&job->warp);
    for (int i = 0; i < n; ++i) {
        int k = first + i;
        double seen = 0.0, own = (double)alpha[k];
        for (int c = 0; asked->background && c < 3; ++c)
            seen += r->by_sums[4 * p + c] * (double)color[3 * k + c];
        if (asked->background) seen += r->by_sums[4 * p + 3];
        seen *= (double)r->T[k];
        own = by_a[i] * moit_absorbance_slope(job->technique, job->max_alpha, own);
        r->by_alpha[k] = (float)(seen + own);
        r->by_depth[k] = (float)(by_z[i] * moit_warp_slope(&job->warp, rise, (double)depth[k]));
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

bool moit_single_backwards(const moit_job *job, moit_tile *tile, const moit_single_asked *asked) {
    const moit_single_adjoints *adjoints = adjoints_of(job->run->isa);
    const moit_technique *technique = job->technique;
    room r = lay_out(tile);
    r.by_depth = place_of(tile, asked->out->depth, 1, r.by_depth);
    r.by_alpha = place_of(tile, asked->out->alpha, 1, r.by_alpha);
    r.by_color = place_of(tile, asked->out->color, 3, r.by_color);
    gather(job, tile, &r);
    const float *own = technique->moments.exclude_self ? tile->absorbance : NULL;
    moit_single_state state = {.count = technique->count,
                               .pixels = tile->pixels,
                               .offsets = tile->offsets,
                               .z = tile->z,
                               .own = own,
                               .rules = tile->rules,
                               .b0 = tile->double_b0,
                               .beta = technique->moments.overestimation,
                               .kept = r.kept,
                               .apart = r.apart};
    adjoints->absorbance(&state, r.A);
    (asked->background ? pull_picture : pull_fragments)(job, tile, asked, &r);
    moit_single_pull by = {.by = r.by_A,
                           .a = tile->absorbance,
                           .by_b0 = r.by_b0,
                           .keeps = 1.0 - job->bias,
                           .most = job->max_alpha,
                           .warp = &job->warp,
                           .rise = moit_warp_rise(&job->warp),
                           .alpha = tile->alpha,
                           .depth = tile->depth,
                           .by_alpha = r.by_alpha,
                           .by_depth = r.by_depth,
                           .is_hard = r.is_hard};
    if (!adjoints->pull(&state, &by)) return false;
    moit_moment_state any = moit_any_state(job);
    for (int p = 0; p < tile->pixels; ++p)
        if (tile->offsets[p] < tile->offsets[p + 1] && r.is_hard[p])
            pull_hard(job, tile, asked, &r, p, any);
    give(tile, asked->out->depth, 1, r.by_depth);
    give(tile, asked->out->alpha, 1, r.by_alpha);
    give(tile, asked->out->color, 3, r.by_color);
    give_opaque(tile, asked);
    return true;
}
