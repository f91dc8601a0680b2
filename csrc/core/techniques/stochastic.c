/* Stochastic transparency and hashed alpha testing (kernels/stochastic.h has the papers). */
#include "core/techniques/options.h"
#include "core/techniques/table.h"

#include <string.h>

/* The scratch of a tile. */
typedef struct {
    uint32_t *row, *column;     /* (fragments) of the fragment's pixel in the display */
    uint32_t *key, *twin;       /* (fragments) */
    uint32_t *low, *high;       /* (fragments) samples covered */
    struct counted_key *counts; /* a table of at least two places a fragment of any one pixel */
    void *nearest;              /* (pixels, MOIT_SAMPLE_ROW) depth of each sample */
} sampling;

typedef struct counted_key {
    uint32_t key, count;
} counted_key;

static int samples_of(const moit_job *job) {
    return job->technique->kind == MOIT_STOCHASTIC ? job->technique->count : 1;
}

static size_t table_size(int fragments) {
    size_t size = 16;
    while (size < 2 * (size_t)fragments) size *= 2;
    return size;
}

static size_t aligned(size_t bytes) { return (bytes + 63) / 64 * 64; }

static size_t stochastic_scratch(const moit_job *job, int fragments, int pixels) {
    return 6 * aligned((size_t)fragments * sizeof(uint32_t))
           + aligned(table_size(fragments) * sizeof(counted_key))
           + (size_t)pixels * (size_t)MOIT_SAMPLE_ROW(samples_of(job)) * job->scalar;
}

static sampling lay_out(const moit_tile *tile) {
    size_t fragments = (size_t)tile->fragments + MOIT_PADDING;
    size_t words = aligned(fragments * sizeof(uint32_t));
    char *at = tile->own;
    sampling s = {
        .row = (uint32_t *)at,
        .column = (uint32_t *)(at + words),
        .key = (uint32_t *)(at + 2 * words),
        .twin = (uint32_t *)(at + 3 * words),
        .low = (uint32_t *)(at + 4 * words),
        .high = (uint32_t *)(at + 5 * words),
        .counts = (counted_key *)(at + 6 * words),
    };
    s.nearest = (char *)s.counts
                + aligned(table_size(tile->fragments + MOIT_PADDING) * sizeof(counted_key));
    return s;
}

/* Where each fragment's pixel is, also behind the last, for the lanes there. */
static void place_fragments(const moit_job *job, const moit_tile *tile, const sampling *s) {
    const moit_fragments *f = job->fragments;
    int64_t width = f->width ? f->width : f->pixels;
    for (int p = 0; p < tile->pixels; ++p) {
        int64_t pixel = moit_pixel_at(tile, p);
        uint32_t row = (uint32_t)(f->top + pixel / width);
        uint32_t column = (uint32_t)(f->left + pixel % width);
        for (int i = tile->offsets[p]; i < tile->offsets[p + 1]; ++i) {
            s->row[i] = row;
            s->column[i] = column;
        }
    }
    memset(s->row + tile->fragments, 0, MOIT_PADDING * sizeof *s->row);
    memset(s->column + tile->fragments, 0, MOIT_PADDING * sizeof *s->column);
}

/* twin[i] = how many fragments of the same key are in its pixel before it. */
static void count_twins(const moit_tile *tile, const sampling *s) {
    for (int p = 0; p < tile->pixels; ++p) {
        int start = tile->offsets[p], n = tile->offsets[p + 1] - start;
        size_t size = table_size(n);
        memset(s->counts, 0, size * sizeof *s->counts);
        for (int i = start; i < start + n; ++i) {
            size_t place = s->key[i] & (size - 1);
            while (s->counts[place].count && s->counts[place].key != s->key[i])
                place = (place + 1) & (size - 1);
            s->counts[place].key = s->key[i];
            s->twin[i] = s->counts[place].count++;
        }
    }
    memset(s->twin + tile->fragments, 0, MOIT_PADDING * sizeof *s->twin);
}

static sampling sample_tile(const moit_job *job, const moit_tile *tile) {
    const moit_technique *technique = job->technique;
    sampling s = lay_out(tile);
    int samples = samples_of(job);
    bool stratified = technique->kind == MOIT_STOCHASTIC && technique->sampling.stratified;
    place_fragments(job, tile, &s);
    job->stages->fragment_keys(tile->fragments, technique->sampling.seed, s.row, s.column,
                               tile->depth, tile->alpha, s.key);
    count_twins(tile, &s);
    job->stages->coverage(samples, stratified, tile->fragments, tile->alpha, s.key, s.twin, s.low,
                          s.high);
    job->stages->nearest_covering(samples, tile->pixels, tile->offsets, tile->depth, s.low, s.high,
                                  s.nearest);
    return s;
}

/* The published total is exact; that of an alpha test is what the test leaves. */
static void set_totals(const moit_job *job, moit_tile *tile, const sampling *s) {
    if (job->technique->kind == MOIT_STOCHASTIC) {
        moit_total_product(job, tile);
        return;
    }
    for (int p = 0; p < tile->pixels; ++p) {
        double nearest =
            moit_number(job->fragments->precision, s->nearest, (int64_t)p * MOIT_SAMPLE_ROW(1));
        tile->total[p] = nearest < __builtin_inf() ? 0.0 : 1.0;
    }
}

static void stochastic_weigh(const moit_job *job, moit_tile *tile) {
    sampling s = sample_tile(job, tile);
    job->stages->shares_seen(samples_of(job), tile->pixels, tile->offsets, tile->depth, s.nearest,
                             tile->T);
    set_totals(job, tile, &s);
}

static void stochastic_curve(const moit_job *job, moit_tile *tile) {
    moit_precision precision = job->fragments->precision;
    sampling s = sample_tile(job, tile);
    int samples = samples_of(job), row = MOIT_SAMPLE_ROW(samples);
    for (int p = 0; p < tile->pixels; ++p)
        for (int64_t k = 0; k < job->depths; ++k) {
            int seen = 0;
            for (int i = 0; i < samples; ++i)
                seen += !(moit_number(precision, s.nearest, (int64_t)p * row + i) < job->depth[k]);
            moit_set_number(precision, tile->curve, p * job->depths + k, (double)seen / samples);
        }
    set_totals(job, tile, &s);
}

/* An alpha test: the nearest fragment that passes, the first of equals, is opaque. */
static void hashed_alpha_resolve(const moit_job *job, moit_tile *tile) {
    moit_precision precision = job->fragments->precision;
    sampling s = sample_tile(job, tile);
    set_totals(job, tile, &s);
    for (int p = 0; p < tile->pixels; ++p) {
        double *sum = tile->sums + 4 * p;
        double nearest = moit_number(precision, s.nearest, (int64_t)p * MOIT_SAMPLE_ROW(1));
        memset(sum, 0, 4 * sizeof *sum);
        for (int i = tile->offsets[p]; i < tile->offsets[p + 1]; ++i) {
            if (!s.low[i] || moit_number(precision, tile->depth, i) != nearest) continue;
            for (int c = 0; c < 3; ++c)
                sum[c] = moit_number(precision, tile->color, 3 * (int64_t)i + c);
            sum[3] = 1.0;
            break;
        }
    }
}

#define SEED WHOLE("seed", sampling.seed, 0, INT_MAX)

const moit_technique_row moit_stochastic_row = {
    .name = "stochastic",
    OPTIONS(COUNT, NORMALIZE, SEED, TRUTH("stratified", sampling.stratified)),
    .usual_counts = (const int[]){8, 0},
    .least_count = 1,
    .most_count = MOIT_MOST_SAMPLES,
    .weigh = stochastic_weigh,
    .pull_back = moit_stochastic_pull_back,
    .total = moit_total_product,
    .curve = stochastic_curve,
    .scratch = stochastic_scratch,
    .is_random = true,
    .reconstructs = true,
    .takes_points = true,
    .geometry_passes = 3};

const moit_technique_row moit_hashed_alpha_row = {.name = "hashed-alpha",
                                                  OPTIONS(SEED),
                                                  .weigh = stochastic_weigh,
                                                  .curve = stochastic_curve,
                                                  .resolve = hashed_alpha_resolve,
                                                  .scratch = stochastic_scratch,
                                                  .is_random = true,
                                                  .takes_points = true,
                                                  .arrival = MOIT_TIES_IN_ORDER,
                                                  .ties = MOIT_TIES_EARLIER,
                                                  .geometry_passes = 1};
