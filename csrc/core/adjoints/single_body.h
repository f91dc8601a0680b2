/* Compiled once per table of single.h, as core/stages/body.h is. */
#include "core/adjoints/single.h"

#include "core/stages/lanes.h"
#include "core/stages/quads.h"
#include "core/stages/rays.h"

#define NAMED(name) JOIN(name, NODES)
#define TEXT "core/adjoints/dual_of_count.h"
#include "core/stages/each_power_count.h"
#define TEXT "core/adjoints/power_of_count.h"
#include "core/stages/each_power_count.h"
#include "core/adjoints/rays_body.h"

/* Four fragments more, of which `left` are there. */
FN void add_four(const int count, const float *a, const float *z, int left, quad *sum) {
    quad power = some_of_row(a, left), x = some_of_row(z, left);
    sum[0] += power;
    for (int k = 1; k <= count; ++k) sum[k] += power = power * x;
}

FN void state_of(const int count, const moit_single_state *o) {
    for (int p = 0; p < o->pixels; ++p) {
        quad sum[5] = {{0}}, mean;
        int i = o->offsets[p], end = o->offsets[p + 1], last = i + 8;
        /* with no branch that depends on how many of eight there are: processors guess it wrong */
        for (; i < last; i += 4) add_four(count, o->a + i, o->z + i, end - i, sum);
        for (; i < end; i += 4) add_four(count, o->a + i, o->z + i, end - i, sum);
        double total = (sum[0][0] + sum[0][1]) + (sum[0][2] + sum[0][3]);
        o->b0[p] = total;
        /* as sums make means: of next to no absorbance, too, 1 / b0 is finite */
        mean = sums_of_four(sum + 1) * QUAD(1.0 / (total > 0x1p-1022 ? total : 0x1p-1022));
        if (count == 4) memcpy(o->b + 4 * p, &mean, sizeof mean);
        else
            for (int k = 0; k < count; ++k) o->b[p * count + k] = mean[k];
    }
}

static void state(const moit_single_state *o) {
    if (o->count == 2) state_of(2, o);
    else state_of(4, o);
}

static void pixels(const moit_single_pixels *o) {
    const quad none = QUAD(0.0), one = QUAD(1.0);
    for (int p = 0; p < o->pixels; p += 4) {
        quad g[4], seen[4], shown[4], total, b0, sum;
        for (int k = 0; k < 4; ++k) {
            int q = p + k < o->pixels ? p + k : p;
            quad s, behind;
            memcpy(&s, o->sums + 4 * q, sizeof s);
            memcpy(&behind, o->shown + 4 * q, sizeof behind);
            g[k] = load_quad(o->seed + 4 * o->pixel[q]);
            seen[k] = with_last(g[k] * s, none);
            shown[k] = g[k] * behind;
            sum[k] = s[3];
            total[k] = o->total[q];
            b0[k] = o->b0[q];
        }
        quad by_scale = sums_of_four(seen), by_total = sums_of_four(shown), covers = one - total;
        for (int k = 0; k < 4; ++k)
            if (b0[k] < MOIT_LITTLE_COVERED) covers[k] = moit_covered_by(b0[k], total[k]);
        quad_truth scales = sum > (o->scales ? none : QUAD(__builtin_huge_val()));
        quad inverse = quad_select(scales, one / sum, none);
        quad scale = quad_select(scales, covers * inverse, one);
        quad by_b0 = total * (by_scale * inverse - by_total);
        quad by_last = none - by_scale * scale * inverse;
        for (int k = 0; k < 4 && p + k < o->pixels; ++k) {
            quad by = with_last(g[k] * QUAD(scale[k]), QUAD(by_last[k]));
            double *behind = o->by_behind + 3 * o->pixel[p + k];
            memcpy(o->by_sums + 4 * (p + k), &by, sizeof by);
            o->by_b0[p + k] = by_b0[k];
            for (int c = 0; c < 3; ++c) behind[c] = g[k][c] * total[k];
        }
    }
}

static void weights(int n, const float *A, float *T) {
    for (int i = 0; i < n; i += LANES)
        store(T + i, exponential(-min(load(A + i), K(MOIT_MOST_ABSORBED))));
}

#define SHUFFLED __builtin_shufflevector

/* Four fragments of a pixel. What is written beyond its last is written over. */
FN void pull_four(const moit_single_sums *o, const four_numbers by[4], int i) {
    const float *color = o->color + 3 * i;
    float *by_color = o->by_color + 3 * i;
    four_numbers T = load_four(o->T + i), alpha = load_four(o->alpha + i), emission = alpha;
    if (o->emission != o->alpha) emission = load_four(o->emission + i);
    four_numbers a = load_four(color), b = load_four(color + 4), c = load_four(color + 8);
    four_numbers red = SHUFFLED(SHUFFLED(a, b, 0, 3, 6, 6), c, 0, 1, 2, 5);
    four_numbers green = SHUFFLED(SHUFFLED(a, b, 1, 4, 7, 7), c, 0, 1, 2, 6);
    four_numbers blue = SHUFFLED(SHUFFLED(a, b, 2, 5, 5, 5), c, 0, 1, 4, 7);
    four_numbers seen = by[0] * red + by[1] * green + by[2] * blue, light = emission * T;
    four_numbers by_alpha = (seen + by[3]) * T, by_A = -T * (seen * emission + by[3] * alpha);
    red = by[0] * light;
    green = by[1] * light;
    blue = by[2] * light;
    a = SHUFFLED(SHUFFLED(red, green, 0, 4, 1, 1), blue, 0, 1, 4, 2);
    b = SHUFFLED(SHUFFLED(green, blue, 1, 5, 2, 2), red, 0, 1, 6, 2);
    c = SHUFFLED(SHUFFLED(blue, red, 2, 7, 3, 3), green, 0, 1, 7, 2);
    memcpy(by_color, &a, sizeof a);
    memcpy(by_color + 4, &b, sizeof b);
    memcpy(by_color + 8, &c, sizeof c);
    memcpy(o->by_alpha + i, &by_alpha, sizeof by_alpha);
    memcpy(o->by_A + i, &by_A, sizeof by_A);
}

/* One fragment: a caller's arrays may end behind it. */
FN void pull_one(const moit_single_sums *o, const four_numbers by[4], int i) {
    const float *color = o->color + 3 * i;
    float T = o->T[i], light = o->emission[i] * T, sum = by[3][0];
    float seen = by[0][0] * color[0] + by[1][0] * color[1] + by[2][0] * color[2];
    for (int c = 0; c < 3; ++c) o->by_color[3 * i + c] = by[c][0] * light;
    o->by_alpha[i] = (seen + sum) * T;
    o->by_A[i] = -T * (seen * o->emission[i] + sum * o->alpha[i]);
}

static void sums(const moit_single_sums *of) {
    const moit_single_sums o = *of; /* which no array of floats may be */
    int all = o.offsets[o.pixels];
    for (int p = 0; p < o.pixels; ++p) {
        quad wide;
        memcpy(&wide, o.by_sum + 4 * p, sizeof wide);
        four_numbers x = __builtin_convertvector(wide, four_numbers);
        const four_numbers by[4] = {SHUFFLED(x, x, 0, 0, 0, 0), SHUFFLED(x, x, 1, 1, 1, 1),
                                    SHUFFLED(x, x, 2, 2, 2, 2), SHUFFLED(x, x, 3, 3, 3, 3)};
        int i = o.offsets[p], end = o.offsets[p + 1];
        for (; i < end && i + 4 <= all; i += 4) pull_four(&o, by, i);
        for (; i < end; ++i) pull_one(&o, by, i);
    }
}

/* From absorbances and z to alpha and depth, of a caller's arrays. */
static bool slopes(const moit_single_slopes *o) {
    bool bounded = o->warp->warp != MOIT_WARP_NONE, logarithms = o->warp->warp == MOIT_WARP_LOG;
    truth finite = EVERYWHERE;
    for (int i = 0; i < o->n; i += LANES) {
        int left = o->n - i;
        real alpha = load_at_most(o->alpha + i, left), depth = load_at_most(o->depth + i, left);
        real rise = K(o->rise), by_alpha = load_at_most(o->by_alpha + i, left);
        if (logarithms) rise = rise / depth;
        if (bounded)
            rise = select((depth < K(o->warp->near)) | (depth > K(o->warp->far)), K(0.0), rise);
        real slope = select(alpha > K(o->most), K(0.0), 1.0 / (1.0 - alpha));
        by_alpha = by_alpha + load(o->by_a + i) * slope;
        real moved = load(o->by_z + i) * rise;
        for (int k = left; k < LANES; ++k) by_alpha[k] = moved[k] = 0; /* of nothing */
        finite = BOTH(finite,
                      BOTH(real_abs(by_alpha) < K(__FLT_MAX__), real_abs(moved) < K(__FLT_MAX__)));
        store_at_most(o->by_alpha + i, by_alpha, left);
        store_at_most(o->by_depth + i, moved, left);
    }
    return !any_lane(~finite);
}

const moit_single_adjoints TABLE = {
    {ray_absorbance, pull_rays}, state, pixels, weights, sums, slopes};
#include "core/stages/lanes_end.h"
