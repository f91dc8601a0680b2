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

static void weights(int n, const float *A, float *T) {
    for (int i = 0; i < n; i += LANES)
        store(T + i, exponential(-min(load(A + i), K(MOIT_MOST_ABSORBED))));
}

/* Four fragments of a pixel. What is written beyond its last is written over. */
FN void pull_four(const moit_single_sums *o, const four_numbers by[4], int i) {
    const float *color = o->color + 3 * i;
    four_numbers T = load_four(o->T + i), alpha = load_four(o->alpha + i), emission = alpha;
    if (o->emission != o->alpha) emission = load_four(o->emission + i);
    four_numbers a = load_four(color), b = load_four(color + 4), c = load_four(color + 8);
    four_numbers seen = by[0] * (four_numbers){a[0], a[3], b[2], c[1]};
    seen = seen + by[1] * (four_numbers){a[1], b[0], b[3], c[2]};
    seen = seen + by[2] * (four_numbers){a[2], b[1], c[0], c[3]};
    four_numbers light = emission * T, red = by[0] * light, green = by[1] * light;
    four_numbers blue = by[2] * light, by_alpha = (seen + by[3]) * T;
    four_numbers by_A = -T * (seen * emission + by[3] * alpha);
    a = (four_numbers){red[0], green[0], blue[0], red[1]};
    b = (four_numbers){green[1], blue[1], red[2], green[2]};
    c = (four_numbers){blue[2], red[3], green[3], blue[3]};
    memcpy(o->by_color + 3 * i, &a, sizeof a);
    memcpy(o->by_color + 3 * i + 4, &b, sizeof b);
    memcpy(o->by_color + 3 * i + 8, &c, sizeof c);
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

static void sums(const moit_single_sums *o) {
    int all = o->offsets[o->pixels];
    for (int p = 0; p < o->pixels; ++p) {
        four_numbers by[4];
        for (int k = 0; k < 4; ++k) by[k] = (four_numbers){0} + (float)o->by_sum[4 * p + k];
        int i = o->offsets[p], end = o->offsets[p + 1];
        for (; i < end && i + 4 <= all; i += 4) pull_four(o, by, i);
        for (; i < end; ++i) pull_one(o, by, i);
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

const moit_single_adjoints TABLE = {{ray_absorbance, pull_rays}, weights, sums, slopes};
#include "core/stages/lanes_end.h"
