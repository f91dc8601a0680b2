/* The way back with lanes over the fragments of several pixels, for units of floats and of doubles:
 * behind lanes.h, quads.h, rays.h, and power_of_count.h of each count of nodes. */
#include "core/adjoints/rays.h"

/* Room of a block's rows: sums read eight places of each ray. */
enum { BLOCK_ROOM = BLOCK_POINTS + 2 * LANES + 8 };

/* Numbers of a row from x on; those beyond the first `left` are 0, whatever memory holds. */
FN quad some_of_row(const SCALAR *x, int left) {
    quad_truth there = (quad_truth){0, 1, 2, 3} < left;
    return (quad)((quad_truth)load_quad(x) & there);
}

/* The sum of n numbers of a row, or with y of their products, as four sums of every fourth: the
 * same bits whatever lanes there are. Eight are always read, as processors guess a branch wrong
 * that depends on how many there are. */
FN quad sum_of_row(const SCALAR *x, const SCALAR *y, int n) {
    quad sum = some_of_row(x, n), more = some_of_row(x + 4, n - 4);
    if (y) sum *= some_of_row(y, n), more *= some_of_row(y + 4, n - 4);
    sum += more;
    for (int i = 8; i < n; i += 4) {
        more = some_of_row(x + i, n - i);
        sum += y ? more * some_of_row(y + i, n - i) : more;
    }
    return sum;
}

/* Of four rows, `apart` numbers from one to the next, of which `rows` are there. */
FN quad sums_of_rows(const int rows, const SCALAR *x, const int apart, int n) {
    const SCALAR *row[4];
    for (int k = 0; k < 4; ++k) row[k] = x + (k < rows ? k : 0) * apart;
    quad sum[4];
    for (int k = 0; k < 4; ++k) sum[k] = some_of_row(row[k], n) + some_of_row(row[k] + 4, n - 4);
    for (int i = 8; i < n; i += 4)
        for (int k = 0; k < 4; ++k) sum[k] += some_of_row(row[k] + i, n - i);
    return sums_of_four(sum);
}

/* Rays of a block that are answered. */
typedef struct {
    int count, ray[BLOCK_RAYS];
} answered_rays;

FN answered_rays rays_answered(const ray_block *block, const bool *is_hard) {
    answered_rays some = {.count = 0};
    for (int r = 0; r < block->rays; ++r) {
        some.ray[some.count] = r;
        some.count += !(is_hard && is_hard[block->pixel[r]]);
    }
    return some;
}

/* Of one row, over the places of four of these from the k-th on; y: is multiplied by, or NULL. */
FN quad sums_of_rays(const ray_block *block, const answered_rays *some, const int32_t *offsets,
                     int k, const SCALAR *x, const SCALAR *y) {
    quad sum[4];
    for (int j = 0; j < 4; ++j) {
        bool there = k + j < some->count;
        int p = block->pixel[some->ray[there ? k + j : k]], first = offsets[p];
        sum[j] = sum_of_row(x + (first - block->first), y ? y + first : NULL,
                            there ? offsets[p + 1] - first : 0);
    }
    return sums_of_four(sum);
}

/* What is read at z and what moments move with it take each other away where fragments are few or
 * close. A ray whose parts are in sum more than so many times as large as what is left is for
 * doubles; what is left counts at least as such a share of all that depths may do. */
#define MOST_LOST 150.0
#define LEAST_MOTION 0x1p-8

/* So little that its inverse is finite. */
#define LEAST_TOTAL (DOUBLE ? 0x1p-1022 : 0x1p-126)

/* Of a block: of each ray what all its absorbances change by, what one of the polynomial's values
 * does, and b0; of each fragment the polynomial and its slope, and what is read; lost: how far
 * digits of by_z are from being enough, over all of a ray. */
typedef struct {
    const SCALAR *all, *each, *b0, *value, *slope, *by_z, *by_own;
    SCALAR *lost;
} ray_motions;

FN void give_block(const moit_ray_pull *by, const ray_block *block, const ray_motions *of) {
    const SCALAR *a = by->a, *given = by->by;
    SCALAR *by_a = by->by_a, *by_z = by->by_z;
    for (int i = block->first, at = 0; i < block->end; i += LANES, at += LANES) {
        truth lane;
        int ray = first_ray(block, i, &lane);
        real all = lanes_of_row(of->all + ray, lane), each = lanes_of_row(of->each + ray, lane);
        real read = load(of->by_z + at), written = each * load(a + i) * load(of->slope + at);
        real moved = read + written;
        store(by_a + i, load(of->by_own + at) + all + each * load(of->value + at));
        store(by_z + i, moved);
        if (!by->is_hard) continue;
        real total = lanes_of_row(of->b0 + ray, lane);
        real size = real_abs(moved) + K(LEAST_MOTION) * total * real_abs(load(given + i));
        store(of->lost + at, real_abs(read) + real_abs(written) - K(MOST_LOST) * size);
    }
}

#define TEXT "core/adjoints/rays_of_count.h"
#include "core/stages/each_power_count.h"

static void ray_absorbance(const moit_ray_state *o, void *A) {
    switch (o->count) {
    case 2: absorbance1(o, A); break;
    case 4: absorbance2(o, A); break;
    case 6: absorbance3(o, A); break;
    default: absorbance4(o, A);
    }
}

static bool pull_rays(const moit_ray_state *o, const moit_ray_pull *by) {
    ray_block block;
    for (int p = 0; p < o->pixels; ++p)
        if (o->offsets[p + 1] - o->offsets[p] > BLOCK_POINTS) return false;
    for (int p = 0; p < o->pixels;) {
        p = next_block(&block, p, o->pixels, o->offsets);
        switch (o->count) {
        case 2: pull_block1(o, by, &block); break;
        case 4: pull_block2(o, by, &block); break;
        case 6: pull_block3(o, by, &block); break;
        default: pull_block4(o, by, &block);
        }
    }
    return true;
}
