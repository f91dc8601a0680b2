/* Backwards through power moments of NODES nodes, lanes over the fragments of several pixels. What
 * power_of_count.h has at a place is done there; sums over places are double. */

#include "core/stages/rule_rows_of_count.h"

/* Rows of a block's rays: their rules, and b0. */
FN void NAMED(block_rows)(const moit_ray_state *o, const ray_block *block,
                          SCALAR (*row)[BLOCK_ROW]) {
    for (int r = 0; r < block->rays; ++r) {
        NAMED(rule_into_rows)(row, r, o->rules + block->pixel[r] * MOIT_RULE_SIZE(2 * NODES));
        for (int i = 0; o->low && i < NODES; ++i)
            row[NODES + i][r] += (SCALAR)o->low[block->pixel[r] * (NODES + 1) + i];
        row[3 * NODES + 1][r] = (SCALAR)o->b0[block->pixel[r]];
    }
}

static void NAMED(absorbance)(const moit_ray_state *o, SCALAR *A) {
    const SCALAR *places = o->z, *masses = o->own;
    ray_block block;
    SCALAR row[3 * NODES + 2][BLOCK_ROW] = {{0}};
    for (int p = 0; p < o->pixels;) {
        p = next_block(&block, p, o->pixels, o->offsets);
        NAMED(block_rows)(o, &block, row);
        for (int i = block.first; i < block.end; i += LANES) {
            truth lane;
            int ray = first_ray(&block, i, &lane);
            NAMED(rule) r = NAMED(rule_of_rows)(row, ray, lane);
            real z = load(places + i), total = lanes_of_row(row[3 * NODES + 1] + ray, lane);
            NAMED(found) f = NAMED(found_at)(r, z);
            NAMED(distances) away = NAMED(away_from_rule)(r, z);
            NAMED(counted) c = NAMED(counted_nodes)(r, away.from, &f);
            NAMED(masses) mass = {.at = f.at, .in_front = NAMED(in_front_of)(&c, &f)};
            NAMED(keep)((SCALAR *)o->kept + i, o->apart, &f);
            store(A + i, NAMED(absorbance_past)(mass, total, masses ? load(masses + i) : K(0.0),
                                                K(o->beta)));
        }
    }
}

/* A block's numbers: S, by b0, by z and by own absorbances of fragments; and polynomials. */
STRUCT(NAMED(block_numbers)) {
    SCALAR of[TERMS + 1][BLOCK_ROOM];
    SCALAR by_z[BLOCK_ROOM], by_own[BLOCK_ROOM];
    SCALAR value[BLOCK_ROOM], slope[BLOCK_ROOM];
};

/* What a block's fragments give. */
FN void NAMED(read_block)(const moit_ray_state *o, const moit_ray_pull *by, const ray_block *block,
                          SCALAR (*row)[BLOCK_ROW], NAMED(block_numbers) *n) {
    const SCALAR *places = o->z, *masses = o->own, *given = by->by;
    for (int i = block->first, at = 0; i < block->end; i += LANES, at += LANES) {
        truth lane;
        int ray = first_ray(block, i, &lane);
        NAMED(rule) r = NAMED(rule_of_rows)(row, ray, lane);
        real total = lanes_of_row(row[3 * NODES + 1] + ray, lane);
        NAMED(found) f = NAMED(found_again)(o->kept, o->apart, i, EVERYWHERE);
        NAMED(pulled) p =
            NAMED(pulled_at)(r, &f, total, load(places + i), masses ? load(masses + i) : K(0.0),
                             K(o->beta), select(total > 0.0, load(given + i), K(0.0)));
        for (int t = 0; t < TERMS; ++t) store(n->of[t] + at, p.S[t]);
        store(n->of[TERMS] + at, p.b0);
        store(n->by_z + at, p.z);
        store(n->by_own + at, masses ? p.own : K(0.0));
    }
}

/* The polynomial of each ray, in rows, at the same fragments. */
FN void NAMED(read_polynomials)(const moit_ray_state *o, const ray_block *block,
                                SCALAR (*row)[BLOCK_ROW], SCALAR (*S)[BLOCK_ROW],
                                NAMED(block_numbers) *n) {
    const SCALAR *places = o->z;
    for (int i = block->first, at = 0; i < block->end; i += LANES, at += LANES) {
        truth lane;
        int ray = first_ray(block, i, &lane);
        real z = load(places + i), from[NODES], terms[TERMS];
        for (int k = 0; k < NODES; ++k)
            from[k] =
                (z - lanes_of_row(row[k] + ray, lane)) - lanes_of_row(row[NODES + k] + ray, lane);
        for (int t = 0; t < TERMS; ++t) terms[t] = lanes_of_row(S[t] + ray, lane);
        NAMED(reading) found = NAMED(reading_at)(terms, from);
        store(n->value + at, found.value);
        store(n->slope + at, found.slope);
    }
}

/* Rays of a block, each of which fits in it. */
static void NAMED(pull_block)(const moit_ray_state *o, const moit_ray_pull *by,
                              const ray_block *block) {
    enum { APART = BLOCK_ROOM, SUMS = TERMS + 1 };
    const int32_t *offsets = o->offsets;
    SCALAR row[3 * NODES + 2][BLOCK_ROW] = {{0}}, S[TERMS][BLOCK_ROW] = {{0}};
    SCALAR all[BLOCK_ROW] = {0}, each[BLOCK_ROW] = {0};
    NAMED(block_numbers) n;
    double by_b0[BLOCK_RAYS];
    NAMED(block_rows)(o, block, row);
    NAMED(read_block)(o, by, block, row, &n);
    const answered_rays some = rays_answered(block, by->is_hard);
    for (int k = 0; k < some.count; ++k) {
        int r = some.ray[k], first = offsets[block->pixel[r]],
            count = offsets[block->pixel[r] + 1] - first;
        const SCALAR *at = n.of[0] + (first - block->first);
#define FOUR_ROWS(t) \
    if (SUMS > (t)) { \
        quad sum = sums_of_rows(SUMS - (t), at + (t)*APART, APART, count); \
        for (int j = 0; j < 4 && (t) + j < TERMS; ++j) S[(t) + j][r] = (SCALAR)sum[j]; \
        if ((t) + 4 >= SUMS) by_b0[r] = sum[(TERMS - (t)) & 3]; \
    }
        FOUR_ROWS(0)
        FOUR_ROWS(4)
        FOUR_ROWS(8)
        FOUR_ROWS(12)
#undef FOUR_ROWS
    }
    NAMED(read_polynomials)(o, block, row, S, &n);
    for (int k = 0; k < some.count; k += 4) {
        quad sum = sums_of_rays(block, &some, offsets, k, n.value, by->a);
        for (int j = 0; j < 4 && k + j < some.count; ++j) {
            int r = some.ray[k + j], p = block->pixel[r];
            /* as sums make means: of next to no absorbance, too, 1 / b0 is finite */
            double inverse = 1.0 / (o->b0[p] > LEAST_TOTAL ? o->b0[p] : LEAST_TOTAL);
            double keeps = o->b0[p] > 0.0 ? by->keeps * inverse : 0.0;
            all[r] = (SCALAR)(by->by_b0[p] + by_b0[r] - keeps * (inverse * sum[j]));
            each[r] = (SCALAR)keeps;
        }
    }
    ray_motions of = {.all = all,
                      .each = each,
                      .b0 = row[3 * NODES + 1],
                      .value = n.value,
                      .slope = n.slope,
                      .by_z = n.by_z,
                      .by_own = n.by_own,
                      .lost = n.of[0]};
    give_block(by, block, &of);
    for (int r = 0; by->leaves_depths && r < block->rays; ++r) {
        int first = offsets[block->pixel[r]], count = offsets[block->pixel[r] + 1] - first;
        if (o->low && o->low[block->pixel[r] * (NODES + 1) + NODES] > 0.0) continue;
        for (int i = 0; count <= NODES && i < count; ++i) ((SCALAR *)by->by_z)[first + i] = 0;
    }
    for (int k = 0; by->is_hard && k < some.count; k += 4) {
        quad sum = sums_of_rays(block, &some, offsets, k, of.lost, NULL);
        for (int j = 0; j < 4 && k + j < some.count; ++j)
            by->is_hard[block->pixel[some.ray[k + j]]] = sum[j] > 0.0;
    }
}
