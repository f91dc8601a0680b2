/* Moments of blocks of pixels: Moment Transparency at low resolution (MT 4.1).
 *
 * A block is a pixel of a smaller image. Its opaque depth is the farthest of its pixels' opaque
 * surfaces, and infinite where a pixel has none; what lies behind it is culled, opaque surfaces
 * themselves are not transparent. Blocks count from display coordinates 0, 0, so that crops have
 * the blocks of the whole; those at the image's edges may be cut off. */
#include "core/techniques/moment_transparency.h"
#include "core/techniques/table.h"
#include "core/threads.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { ITEM_BLOCKS = 64 };

typedef struct {
    int64_t width, height, side; /* pixels */
    int64_t left, top;           /* pixels that the first block has beyond the image */
    int64_t across, down;        /* blocks */
    int passes;
    char *b0[2], *b[2]; /* (blocks), (blocks, 4) */
} blocks;

/* What a thread works with: the fragments of one pixel, and the rules of an item's blocks. */
typedef struct {
    char *depth, *alpha, *absorbance, *z, *T; /* padded */
    char *channel[3], *net;                   /* opacities, where there is transmission; padded */
    double *double_b, *rules;
} workbench;

typedef struct {
    const moit_job *job;
    blocks *blocks;
    char *memory;
    size_t part;
    size_t most; /* fragments of a pixel, with padding */
} capture;

static size_t aligned(size_t bytes) { return (bytes + 63) / 64 * 64; }

static workbench workbench_of(const capture *c, char *memory, size_t *bytes) {
    enum { ARRAYS = 9 };
    char *parts[ARRAYS + 2];
    size_t used = 0;
    for (int i = 0; i < ARRAYS + 2; ++i) {
        parts[i] = memory ? memory + used : NULL;
        used += aligned(i < ARRAYS    ? c->most * c->job->scalar
                        : i == ARRAYS ? (size_t)ITEM_BLOCKS * MOIT_MOST_NUMBERS * sizeof(double)
                                      : (size_t)ITEM_BLOCKS * MOIT_MOST_RULE * sizeof(double));
    }
    *bytes = used;
    return (workbench){.depth = parts[0],
                       .alpha = parts[1],
                       .absorbance = parts[2],
                       .z = parts[3],
                       .T = parts[4],
                       .channel = {parts[5], parts[6], parts[7]},
                       .net = parts[8],
                       .double_b = (double *)(void *)parts[ARRAYS],
                       .rules = (double *)(void *)parts[ARRAYS + 1]};
}

/* The pixels of a block: from first to last, not included, in x and y. */
typedef struct {
    int64_t left, right, top, bottom;
} window;

static int64_t within(int64_t x, int64_t most) { return x < 0 ? 0 : x < most ? x : most; }

static window window_of(const blocks *b, int64_t block) {
    int64_t x = block % b->across * b->side - b->left, y = block / b->across * b->side - b->top;
    return (window){within(x, b->width), within(x + b->side, b->width), within(y, b->height),
                    within(y + b->side, b->height)};
}

/* Of the pixel that holds the middle of the whole block, or is next to it in the image. */
static window middle_of(const blocks *b, int64_t block) {
    int64_t x = block % b->across * b->side - b->left, y = block / b->across * b->side - b->top;
    x = within(x + b->side / 2, b->width - 1);
    y = within(y + b->side / 2, b->height - 1);
    return (window){x, x + 1, y, y + 1};
}

/* As tile.c has it: nothing of any channel gets through. */
static bool is_opaque(const moit_fragments *f, int64_t i) {
    if (moit_number(f->precision, f->alpha, i) != 1.0) return false;
    double most = 0.0;
    for (int c = 0; f->transmission && c < 3; ++c)
        most = fmax(most, moit_number(f->precision, f->transmission, 3 * i + c));
    return f->precision == MOIT_FLOAT64 ? 1.0 - most == 1.0 : (float)(1.0 - most) == 1.0f;
}

static double farthest_opaque(const moit_job *job, const blocks *b, window w) {
    const moit_fragments *f = job->fragments;
    if (!job->cull_opaque) return __builtin_inf();
    double farthest = -__builtin_inf();
    for (int64_t y = w.top; y < w.bottom; ++y)
        for (int64_t x = w.left; x < w.right; ++x) {
            int64_t pixel = y * b->width + x;
            double nearest = __builtin_inf();
            for (int64_t i = f->offsets[pixel]; i < f->offsets[pixel + 1]; ++i)
                if (is_opaque(f, i))
                    nearest = fmin(nearest, moit_number(f->precision, f->depth, i));
            if (isinf(nearest)) return nearest;
            farthest = fmax(farthest, nearest);
        }
    return farthest;
}

/* Absorbance and z of what a pixel adds to its block; how many fragments that is. */
static int take_pixel(const moit_job *job, const workbench *at, int64_t pixel, double farthest) {
    const moit_fragments *f = job->fragments;
    moit_precision precision = f->precision;
    int64_t first = f->offsets[pixel], end = f->offsets[pixel + 1];
    if (f->transmission)
        job->stages->opacities((int)(end - first),
                               (const char *)f->alpha + (size_t)first * job->scalar,
                               (const char *)f->transmission + 3 * (size_t)first * job->scalar,
                               at->channel[0], at->channel[1], at->channel[2], at->net);
    int n = 0;
    for (int64_t i = first; i < end; ++i) {
        double depth = moit_number(precision, f->depth, i);
        if (depth > farthest || (job->cull_opaque && is_opaque(f, i))) continue;
        moit_set_number(precision, at->depth, n, depth);
        moit_set_number(precision, at->alpha, n++,
                        f->transmission ? moit_number(precision, at->net, i - first)
                                        : moit_number(precision, f->alpha, i));
    }
    job->stages->scaled_absorbance(n, at->alpha, job->max_alpha, at->absorbance);
    job->stages->warp(n, at->depth, &job->warp, at->z);
    return n;
}

/* Moments of one block in one pass; the second weighs by what the first lets through. */
static void take_block(const capture *c, const workbench *at, int64_t block, int pass,
                       const double *rule) {
    const moit_job *job = c->job;
    moit_precision precision = job->fragments->precision;
    const moit_moment_stages *stages = &job->stages->moments[MOIT_POWER];
    blocks *b = c->blocks;
    window w = window_of(b, block);
    double farthest = farthest_opaque(job, b, w);
    if (!job->technique->transparency.average) w = middle_of(b, block);
    double sum = 0.0, sums[4] = {0.0};
    for (int64_t y = w.top; y < w.bottom; ++y)
        for (int64_t x = w.left; x < w.right; ++x) {
            int n = take_pixel(job, at, y * b->width + x, farthest);
            const int32_t offsets[2] = {0, n};
            if (pass == 1) {
                stages->transmittance(4, NULL, 1, offsets, at->z, NULL, rule,
                                      b->b0[0] + (size_t)block * job->scalar,
                                      job->technique->moments.overestimation, false, at->T);
                job->stages->occluded(n, at->absorbance, at->T, at->absorbance);
            }
            double total[1], mean[4]; /* room for numbers of either precision */
            stages->sums(4, NULL, 1, offsets, at->absorbance, at->z, total, mean);
            double part = moit_number(precision, total, 0);
            sum += part;
            for (int k = 0; k < 4; ++k) sums[k] += part * moit_number(precision, mean, k);
        }
    double pixels = (double)((w.right - w.left) * (w.bottom - w.top));
    moit_set_number(precision, b->b0[pass], block, sum / pixels);
    for (int k = 0; k < 4; ++k)
        moit_set_number(precision, b->b[pass], 4 * block + k, sum > 0.0 ? sums[k] / sum : 0.0);
}

static moit_status take_blocks(void *context, int64_t item, int thread) {
    const capture *c = context;
    const moit_job *job = c->job;
    size_t bytes, s = job->scalar;
    workbench at = workbench_of(c, c->memory + (size_t)thread * c->part, &bytes);
    moit_mt_reader reader = {job->stages, job->precise, job->fragments->precision, job->technique,
                             job->bias};
    blocks *b = c->blocks;
    int64_t all = b->across * b->down, first = item * ITEM_BLOCKS;
    int count = (int)(all - first < ITEM_BLOCKS ? all - first : ITEM_BLOCKS);
    for (int pass = 0; pass < b->passes; ++pass) {
        for (int i = 0; i < count; ++i)
            take_block(c, &at, first + i, pass, at.rules + i * MOIT_RULE_SIZE(4));
        char *b0 = b->b0[pass] + (size_t)first * s, *moments = b->b[pass] + 4 * (size_t)first * s;
        moit_mt_hold(&reader, count, b0, moments);
        if (pass + 1 < b->passes) moit_mt_read(&reader, count, moments, at.double_b, at.rules);
    }
    return MOIT_OK;
}

moit_status moit_blocks_prepare(moit_job *job) {
    const moit_fragments *f = job->fragments;
    job->prepared = NULL;
    if (job->technique->transparency.resolution < 2 || !f->pixels) return MOIT_OK;
    int64_t side = job->technique->transparency.resolution, width = f->width ? f->width : f->pixels;
    blocks b = {.width = width,
                .height = f->pixels / width,
                .side = side,
                .left = (f->left % side + side) % side,
                .top = (f->top % side + side) % side,
                .passes = job->technique->transparency.passes};
    b.across = (b.left + width + side - 1) / side;
    b.down = (b.top + b.height + side - 1) / side;
    size_t count = (size_t)(b.across * b.down), s = job->scalar;
    size_t header = aligned(sizeof b), pass = aligned(count * s) + aligned(4 * count * s);
    blocks *made = malloc(header + (size_t)b.passes * pass);
    if (!made) return MOIT_NO_MEMORY;
    for (int i = 0; i < b.passes; ++i) {
        b.b0[i] = (char *)made + header + (size_t)i * pass;
        b.b[i] = b.b0[i] + aligned(count * s);
    }
    *made = b;
    job->prepared = made;

    int64_t most = 0;
    for (int64_t p = 0; p < f->pixels; ++p) {
        int64_t n = f->offsets[p + 1] - f->offsets[p];
        if (n > most) most = n;
    }
    if (most > INT32_MAX / 4) return MOIT_NO_MEMORY;
    capture c = {.job = job, .blocks = made, .most = (size_t)most + MOIT_PADDING};
    workbench_of(&c, NULL, &c.part);
    int64_t items = ((int64_t)count + ITEM_BLOCKS - 1) / ITEM_BLOCKS;
    int64_t threads = job->run->threads < items ? job->run->threads : items;
    c.memory = aligned_alloc(64, c.part * (size_t)threads);
    if (!c.memory) return MOIT_NO_MEMORY;
    moit_status status = moit_parallel_for(job->run, items, take_blocks, &c);
    free(c.memory);
    return status;
}

void moit_blocks_release(moit_job *job) {
    free(job->prepared);
    job->prepared = NULL;
}

/* The two blocks between whose middles a pixel lies, and the share of the second. */
typedef struct {
    int64_t low, high;
    double share;
} between;

static between between_blocks(int64_t pixel, int64_t side, int64_t blocks_there) {
    int64_t twice = 2 * pixel + 1 - side; /* from the first block's middle, in half pixels */
    int64_t low = twice < 0 ? 0 : twice / (2 * side), high = twice < 0 ? 0 : low + 1;
    double share = twice < 0 ? 0.0 : (double)(twice - 2 * side * low) / (double)(2 * side);
    int64_t last = blocks_there - 1;
    return (between){low < last ? low : last, high < last ? high : last, share};
}

void moit_blocks_read(const moit_job *job, const moit_tile *tile, int pass, void *b0, void *b) {
    const blocks *from = job->prepared;
    moit_precision precision = job->fragments->precision;
    for (int p = 0; p < tile->pixels; ++p) {
        int64_t pixel = tile->first_pixel + p;
        between x = between_blocks(pixel % from->width + from->left, from->side, from->across),
                y = between_blocks(pixel / from->width + from->top, from->side, from->down);
        const int64_t places[4] = {y.low * from->across + x.low, y.low * from->across + x.high,
                                   y.high * from->across + x.low, y.high * from->across + x.high};
        const double shares[4] = {(1.0 - y.share) * (1.0 - x.share), (1.0 - y.share) * x.share,
                                  y.share * (1.0 - x.share), y.share * x.share};
        double sum = 0.0, sums[4] = {0.0};
        for (int i = 0; i < 4; ++i) {
            double part = shares[i] * moit_number(precision, from->b0[pass], places[i]);
            sum += part;
            for (int k = 0; k < 4; ++k)
                sums[k] += part * moit_number(precision, from->b[pass], 4 * places[i] + k);
        }
        moit_set_number(precision, b0, p, sum);
        for (int k = 0; k < 4; ++k)
            moit_set_number(precision, b, 4 * p + k, sum > 0.0 ? sums[k] / sum : 0.0);
    }
}
