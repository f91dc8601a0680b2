/* Compiled once per table of single.h, as core/stages/body.h is. */
#include "core/adjoints/single.h"

#include "core/stages/lanes.h"
#include "core/stages/quads.h"
#include "core/stages/rays.h"

/* The sum of n numbers, as four sums of every fourth: the same bits whatever lanes there are. */
FN double sum_of_row(const SCALAR *x, int n) {
    quad sum = {0.0};
    int i = 0;
    for (; i + 4 <= n; i += 4) sum += load_quad(x + i);
    for (int k = 0; i < n; ++i, ++k) sum[k] += (double)x[i];
    return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

FN double sum_of_products(const SCALAR *x, const SCALAR *y, int n) {
    quad sum = {0.0};
    int i = 0;
    for (; i + 4 <= n; i += 4) sum += load_quad(x + i) * load_quad(y + i);
    for (int k = 0; i < n; ++i, ++k) sum[k] += (double)x[i] * (double)y[i];
    return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

/* What is read at z and what moments move with it take each other away where fragments are few or
 * close. A ray whose parts are in sum more than so many times as large as what is left is for
 * doubles; what is left counts at least as such a share of all that depths may do. */
#define MOST_LOST 150.0
#define LEAST_MOTION 0x1p-8

/* From absorbances and z to alpha and depth; more: of each ray what all its absorbances change by,
 * and what one of the polynomial's values does; b0: its total. lost: how far digits of by_z are
 * from being enough, over all of a ray. Whether all is finite. */
FN bool give_block(const moit_single_pull *by, const ray_block *block, SCALAR (*more)[BLOCK_ROW],
                   const SCALAR *b0, const SCALAR *value, const SCALAR *slope, const SCALAR *by_z,
                   const SCALAR *by_own, SCALAR *lost) {
    bool bounded = by->warp->warp != MOIT_WARP_NONE, logarithms = by->warp->warp == MOIT_WARP_LOG;
    truth finite = EVERYWHERE;
    for (int i = block->first, at = 0; i < block->end; i += LANES, at += LANES) {
        truth lane;
        int ray = first_ray(block, i, &lane), left = block->end - i;
        real all = lanes_of_row(more[0] + ray, lane), each = lanes_of_row(more[1] + ray, lane);
        real alpha = load_at_most(by->alpha + i, left), depth = load_at_most(by->depth + i, left);
        real by_a = load(by_own + at) + all + each * load(value + at);
        real read = load(by_z + at), written = each * load(by->a + i) * load(slope + at);
        real moved = read + written, total = lanes_of_row(b0 + ray, lane);
        real size = real_abs(moved) + K(LEAST_MOTION) * total * real_abs(load(by->by + i));
        store(lost + at, real_abs(read) + real_abs(written) - K(MOST_LOST) * size);
        real rise = K(by->rise);
        if (logarithms) rise = rise / depth;
        if (bounded)
            rise = select((depth < K(by->warp->near)) | (depth > K(by->warp->far)), K(0.0), rise);
        by_a = load_at_most(by->by_alpha + i, left)
               + by_a * select(alpha > K(by->most), K(0.0), 1.0 / (1.0 - alpha));
        moved = moved * rise;
        for (int k = left; k < LANES; ++k) by_a[k] = moved[k] = 0; /* the next block's */
        finite =
            BOTH(finite, BOTH(real_abs(by_a) < K(__FLT_MAX__), real_abs(moved) < K(__FLT_MAX__)));
        store_at_most(by->by_alpha + i, by_a, left);
        store_at_most(by->by_depth + i, moved, left);
    }
    return !any_lane(~finite);
}

#define NAMED(name) JOIN(name, NODES)
#define TEXT "core/adjoints/dual_of_count.h"
#include "core/stages/each_power_count.h"
#define TEXT "core/adjoints/power_of_count.h"
#include "core/stages/each_power_count.h"
#define TEXT "core/adjoints/single_of_count.h"
#include "core/stages/each_power_count.h"

static void absorbed(const moit_single_state *o, float *A) {
    switch (o->count) {
    case 2: absorbance1(o, A); break;
    case 4: absorbance2(o, A); break;
    case 6: absorbance3(o, A); break;
    default: absorbance4(o, A);
    }
}

static bool pull(const moit_single_state *o, const moit_single_pull *by) {
    ray_block block;
    SCALAR row[3 * 4 + 2][BLOCK_ROW] = {{0}};
    bool finite = true;
#define CASE(count, nodes) \
    case count: \
        JOIN(block_rows, nodes)(o, &block, row); \
        finite = JOIN(pull_rays, nodes)(o, by, &block, row) && finite; \
        break
    for (int p = 0; p < o->pixels;) {
        p = next_block(&block, p, o->pixels, o->offsets);
        if (block.end - block.first > BLOCK_POINTS) return false; /* for the way back in double */
        switch (o->count) {
            CASE(2, 1);
            CASE(4, 2);
            CASE(6, 3);
            CASE(8, 4);
        }
    }
#undef CASE
    return finite;
}

/* Beyond that exp(-x) is nothing of floats. */
#define MOST_ABSORBED 87.0

static void weights(bool relative, int pixels, const int32_t *offsets, const float *alpha, float *A,
                    float *T) {
    int all = offsets[pixels];
    for (int p = 0; relative && p < pixels; ++p) {
        int first = offsets[p], end = offsets[p + 1];
        float least = __FLT_MAX__;
        for (int i = first; i < end; ++i) {
            float counts = alpha[i] > 0.0f ? A[i] : __FLT_MAX__;
            least = counts < least ? counts : least;
        }
        if (least == __FLT_MAX__) continue;
        for (int i = first; i < end; ++i) A[i] = A[i] - least;
    }
    for (int i = 0; i < all; i += LANES)
        store(T + i, exponential(-min(load(A + i), K(MOST_ABSORBED))));
}

static void sums(const moit_single_sums *o) {
    for (int p = 0; p < o->pixels; ++p) {
        float by[4];
        for (int k = 0; k < 4; ++k) by[k] = (float)o->by_sum[4 * p + k];
        for (int i = o->offsets[p]; i < o->offsets[p + 1]; ++i) {
            const float *color = o->color + 3 * i;
            float T = o->T[i], light = o->emission[i] * T;
            float seen = by[0] * color[0] + by[1] * color[1] + by[2] * color[2];
            for (int c = 0; c < 3; ++c) o->by_color[3 * i + c] = by[c] * light;
            o->by_alpha[i] = (seen + by[3]) * T;
            o->by_A[i] = -T * (seen * o->emission[i] + by[3] * o->alpha[i]);
        }
    }
}

const moit_single_adjoints TABLE = {absorbed, weights, sums, pull};
#include "core/stages/lanes_end.h"
