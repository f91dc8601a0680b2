/* A row of blocks is gathered by one thread, tile by tile, so that sums run in one order. */
#include "core/techniques/blocks.h"

#include "core/techniques/table.h"
#include "core/techniques/upsampling.h"
#include "core/threads.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { ITEM_BLOCKS = 64, MOST_SETS = 2 };

typedef struct {
    const moit_block_family *family;
    moit_squares squares;
    int sets, numbers;
    bool means, middle;
    char *weight[MOST_SETS], *number[MOST_SETS]; /* (blocks), (blocks, numbers) */
    moit_guides guides;
    double *sums; /* (blocks, 1 + numbers) of the set that is made */
} blocks;

static size_t aligned(size_t bytes) { return (bytes + 63) / 64 * 64; }

static const moit_block_family *family_of(const moit_job *job) {
    return moit_technique_rows[job->technique->kind]->blocks;
}

/* ---- What blocks take ------------------------------------------------------------------------ */

/* As moit_job.limit. */
static double limit_of(const moit_job *job, int64_t pixel) {
    const blocks *b = job->making;
    return b->middle && !moit_is_square_middle(&b->squares, pixel)
               ? -__builtin_inf()
               : b->guides.farthest[moit_square_at(&b->squares, pixel)];
}

typedef struct {
    const moit_job *job;
    blocks *blocks;
    int set;
} capture;

static void add_tile(const moit_job *job, moit_tile *tile, void *context) {
    const capture *c = context;
    blocks *b = c->blocks;
    moit_precision precision = job->fragments->precision;
    b->family->gather(job, tile, c->set);
    moit_state state = b->family->state(job, tile, c->set);
    for (int p = 0; p < tile->pixels; ++p) {
        double *sum =
            b->sums + moit_square_at(&b->squares, moit_pixel_at(tile, p)) * (1 + b->numbers);
        double part = b->means ? moit_number(precision, state.weight, p) : 1.0;
        sum[0] += part;
        for (int k = 0; k < b->numbers; ++k)
            sum[1 + k] += part * moit_number(precision, state.numbers, p * b->numbers + k);
    }
}

static moit_state state_at(const moit_job *job, const blocks *b, int set, int64_t block) {
    size_t at = (size_t)block * job->scalar;
    return (moit_state){b->means ? b->weight[set] + at : NULL,
                        b->number[set] + at * (size_t)b->numbers};
}

/* From sums to what is kept. */
static moit_status keep_blocks(void *context, int64_t item, int thread) {
    (void)thread;
    const capture *c = context;
    const blocks *b = c->blocks;
    moit_precision precision = c->job->fragments->precision;
    int64_t all = b->squares.across * b->squares.down, first = item * ITEM_BLOCKS;
    int count = (int)(all - first < ITEM_BLOCKS ? all - first : ITEM_BLOCKS);
    moit_state state = state_at(c->job, b, c->set, first);
    for (int i = 0; i < count; ++i) {
        const double *sum = b->sums + (first + i) * (1 + b->numbers);
        double pixels = b->middle ? 1.0 : (double)moit_square_pixels(&b->squares, first + i);
        if (b->means) moit_set_number(precision, state.weight, i, sum[0] / pixels);
        for (int k = 0; k < b->numbers; ++k) {
            double mean = !b->means      ? sum[1 + k] / pixels
                          : sum[0] > 0.0 ? sum[1 + k] / sum[0]
                                         : 0.0;
            moit_set_number(precision, state.numbers, i * b->numbers + k, mean);
        }
    }
    if (b->family->hold) b->family->hold(c->job, count, &state);
    return MOIT_OK;
}

static moit_status make_blocks(const moit_job *job, blocks *b) {
    int64_t count = b->squares.across * b->squares.down;
    const moit_squares *s = &b->squares;
    moit_runs rows = {.first = -s->top * s->width, .length = s->side * s->width};
    moit_job own = *job;
    own.blocks = NULL;
    own.making = b;
    own.depths = 0;
    moit_status status = MOIT_OK;
    if (b->guides.farthest) {
        status = moit_guides_find(&own, s, &b->guides);
        if (b->family->of_farthest_surface) own.limit = limit_of;
    }
    own.skips_empty = true; /* they add nothing */
    for (int set = 0; status == MOIT_OK && set < b->sets; ++set) {
        capture c = {&own, b, set};
        memset(b->sums, 0, (size_t)(count * (1 + b->numbers)) * sizeof *b->sums);
        status = moit_for_tiles_of(&own, &rows, add_tile, &c);
        if (status != MOIT_OK) break;
        status =
            moit_parallel_for(job->run, (count + ITEM_BLOCKS - 1) / ITEM_BLOCKS, keep_blocks, &c);
    }
    return status;
}

moit_status moit_blocks_prepare(moit_job *job) {
    const moit_fragments *f = job->fragments;
    const moit_technique *technique = job->technique;
    const moit_block_family *family = family_of(job);
    job->blocks = NULL;
    if (!family || technique->resolution < 2 || !f->pixels) return MOIT_OK;
    blocks b = {.family = family,
                .squares = moit_squares_of(f, technique->resolution),
                .sets = family->sets ? family->sets(technique) : 1,
                .numbers = family->numbers(technique),
                .means = !family->total,
                .middle = family->of_middle && family->of_middle(technique)};
    size_t count = (size_t)(b.squares.across * b.squares.down), numbers = (size_t)b.numbers;
    size_t header = aligned(sizeof b), weight = aligned(count * job->scalar),
           number = aligned(count * numbers * job->scalar),
           farthest = aligned(count * sizeof(double)),
           sums = aligned(count * (1 + numbers) * sizeof(double));
    char *made = malloc(header + farthest + (size_t)b.sets * (weight + number) + sums);
    if (!made) return MOIT_NO_MEMORY;
    char *next = made + header;
    if (family->of_farthest_surface || technique->depth_aware)
        b.guides.farthest = (double *)(void *)next;
    b.guides.guided = technique->depth_aware;
    next += farthest;
    for (int set = 0; set < b.sets; ++set, next += weight + number) {
        b.weight[set] = next;
        b.number[set] = next + weight;
    }
    b.sums = (double *)(void *)next;
    memcpy(made, &b, sizeof b);
    moit_status status = make_blocks(job, (blocks *)(void *)made);
    job->blocks = made;
    return status;
}

void moit_blocks_release(moit_job *job) {
    free(job->blocks);
    job->blocks = NULL;
}

/* ---- What pixels read ------------------------------------------------------------------------ */

static double total_of(moit_precision precision, const double *weights, int numbers,
                       const void *state, int64_t p) {
    double total = 0.0;
    for (int k = 0; k < numbers; ++k)
        total += weights[k] * moit_number(precision, state, p * numbers + k);
    return total;
}

/* Of means: of states weighted by shares and their own weights. */
static void read_means(const moit_job *job, const moit_blocks_around *of, int i, int set,
                       const moit_state *to, int p) {
    const blocks *b = job->blocks;
    moit_precision precision = job->fragments->precision;
    double part[4], sum = 0.0;
    for (int c = 0; c < 4; ++c) {
        part[c] = of->share[c][i] * moit_number(precision, b->weight[set], of->place[c][i]);
        sum += part[c];
    }
    if (!job->technique->full_total) moit_set_number(precision, to->weight, p, sum);
    for (int k = 0; k < b->numbers; ++k) {
        double all = 0.0;
        for (int c = 0; c < 4; ++c)
            all +=
                part[c] * moit_number(precision, b->number[set], of->place[c][i] * b->numbers + k);
        moit_set_number(precision, to->numbers, p * b->numbers + k, sum > 0.0 ? all / sum : 0.0);
    }
}

static void read_sums(const moit_job *job, const moit_blocks_around *of, int i, int set,
                      const moit_state *to, int p, const double *weights) {
    const blocks *b = job->blocks;
    moit_precision precision = job->fragments->precision;
    double sum[MOIT_MOST_BLOCK_NUMBERS], low = 0.0, scale = 1.0;
    for (int k = 0; k < b->numbers; ++k) {
        sum[k] = 0.0;
        for (int c = 0; c < 4; ++c)
            sum[k] += of->share[c][i]
                      * moit_number(precision, b->number[set], of->place[c][i] * b->numbers + k);
        low += weights[k] * sum[k];
    }
    if (job->technique->full_total) {
        double own = total_of(precision, weights, b->numbers, to->numbers, p);
        scale = low > 0.0 ? own / low : 0.0;
    }
    for (int k = 0; k < b->numbers; ++k)
        moit_set_number(precision, to->numbers, p * b->numbers + k, sum[k] * scale);
}

moit_state moit_block_state(const moit_job *job, int set, int64_t block) {
    return state_at(job, job->blocks, set, block);
}

void moit_blocks_find_around(const moit_job *job, const moit_tile *tile, int first, int n,
                             moit_blocks_around *of) {
    const blocks *b = job->blocks;
    moit_find_blocks_around(job, &b->squares, &b->guides, tile, first, n, of);
}

void moit_blocks_read(const moit_job *job, moit_tile *tile, int set) {
    const blocks *b = job->blocks;
    if (!b) return;
    double weights[MOIT_MOST_BLOCK_NUMBERS];
    if (!b->means) b->family->total(job->technique, weights);
    moit_state to = b->family->state(job, tile, set);
    moit_blocks_around of;
    for (int first = 0; first < tile->pixels; first += MOIT_AROUND) {
        int n = tile->pixels - first < MOIT_AROUND ? tile->pixels - first : MOIT_AROUND;
        moit_blocks_find_around(job, tile, first, n, &of);
        for (int i = 0; i < n; ++i)
            if (b->means) read_means(job, &of, i, set, &to, first + i);
            else read_sums(job, &of, i, set, &to, first + i, weights);
    }
}

void moit_own_block_read(const moit_job *job, moit_tile *tile, int set) {
    const blocks *b = job->making;
    size_t row = (size_t)b->numbers * job->scalar;
    moit_state to = b->family->state(job, tile, set);
    for (int p = 0; p < tile->pixels; ++p) {
        int64_t block = moit_square_at(&b->squares, moit_pixel_at(tile, p));
        char *weight = (char *)to.weight + (size_t)p * job->scalar,
             *numbers = (char *)to.numbers + (size_t)p * row;
        if (tile->offsets[p] == tile->offsets[p + 1]) {
            memset(weight, 0, job->scalar);
            memset(numbers, 0, row);
            continue;
        }
        moit_state from = state_at(job, b, set, block);
        memcpy(weight, from.weight, job->scalar);
        memcpy(numbers, from.numbers, row);
    }
}

void moit_blocks_total(const moit_job *job, moit_tile *tile) {
    if (job->blocks && !job->technique->full_total) moit_total_product(job, tile);
}
