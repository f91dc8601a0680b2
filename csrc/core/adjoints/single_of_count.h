/* Backwards through power moments of NODES nodes in floats, lanes over the fragments of several
 * pixels. What power_of_count.h has at a place is the same text; between places sums are double. */

#include "core/stages/rule_rows_of_count.h"

/* Rows of a block's rays: their rules, and b0. */
FN void NAMED(block_rows)(const moit_single_state *o, const ray_block *block,
                          SCALAR (*row)[BLOCK_ROW]) {
    for (int r = 0; r < block->rays; ++r) {
        NAMED(rule_into_rows)(row, r, o->rules + block->pixel[r] * MOIT_RULE_SIZE(2 * NODES));
        row[3 * NODES + 1][r] = (SCALAR)o->b0[block->pixel[r]];
    }
}

static void NAMED(absorbance)(const moit_single_state *o, float *A) {
    ray_block block;
    SCALAR row[3 * NODES + 2][BLOCK_ROW] = {{0}};
    for (int p = 0; p < o->pixels;) {
        p = next_block(&block, p, o->pixels, o->offsets);
        NAMED(block_rows)(o, &block, row);
        for (int i = block.first; i < block.end; i += LANES) {
            truth lane;
            int ray = first_ray(&block, i, &lane);
            NAMED(rule) r = NAMED(rule_of_rows)(row, ray, lane);
            real z = load(o->z + i), total = lanes_of_row(row[3 * NODES + 1] + ray, lane);
            NAMED(found) f = NAMED(found_at)(r, z);
            NAMED(distances) away = NAMED(away_from_rule)(r, z);
            NAMED(counted) c = NAMED(counted_nodes)(r, away.from, &f);
            NAMED(masses) mass = {.at = f.at, .in_front = NAMED(in_front_of)(&c, &f)};
            NAMED(keep)(o->kept + i, o->apart, &f);
            store(A + i, NAMED(absorbance_past)(mass, total, o->own ? load(o->own + i) : K(0.0),
                                                K(o->beta)));
        }
    }
}

/* A block's numbers: S, by b0, by z and by own absorbances of fragments; and polynomials. */
STRUCT(NAMED(block_numbers)) {
    SCALAR of[TERMS + 1][BLOCK_POINTS + 2 * LANES];
    SCALAR by_z[BLOCK_POINTS + 2 * LANES], by_own[BLOCK_POINTS + 2 * LANES];
    SCALAR value[BLOCK_POINTS + 2 * LANES], slope[BLOCK_POINTS + 2 * LANES];
};

/* What fragments [i, end) give. */
FN void NAMED(read_block)(const moit_single_state *o, const moit_single_pull *by,
                          const ray_block *block, SCALAR (*row)[BLOCK_ROW], int i, int end,
                          NAMED(block_numbers) *n) {
    for (int at = 0; i < end; i += LANES, at += LANES) {
        truth lane;
        int ray = first_ray(block, i, &lane);
        NAMED(rule) r = NAMED(rule_of_rows)(row, ray, lane);
        real total = lanes_of_row(row[3 * NODES + 1] + ray, lane);
        NAMED(found) f = NAMED(found_again)(o->kept, o->apart, i, EVERYWHERE);
        NAMED(pulled) p =
            NAMED(pulled_at)(r, &f, total, load(o->z + i), o->own ? load(o->own + i) : K(0.0),
                             K(o->beta), select(total > 0.0, load(by->by + i), K(0.0)));
        for (int t = 0; t < TERMS; ++t) store(n->of[t] + at, p.S[t]);
        store(n->of[TERMS] + at, p.b0);
        store(n->by_z + at, p.z);
        store(n->by_own + at, o->own ? p.own : K(0.0));
    }
}

/* The polynomial of each ray, in rows, at the same fragments. */
FN void NAMED(read_polynomials)(const moit_single_state *o, const ray_block *block,
                                SCALAR (*row)[BLOCK_ROW], SCALAR (*S)[BLOCK_ROW], int i, int end,
                                NAMED(block_numbers) *n) {
    for (int at = 0; i < end; i += LANES, at += LANES) {
        truth lane;
        int ray = first_ray(block, i, &lane);
        real z = load(o->z + i), from[NODES], terms[TERMS];
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
static bool NAMED(pull_rays)(const moit_single_state *o, const moit_single_pull *by,
                             const ray_block *block, SCALAR (*row)[BLOCK_ROW]) {
    NAMED(block_numbers) n;
    SCALAR S[TERMS][BLOCK_ROW] = {{0}}, more[2][BLOCK_ROW] = {{0}};
    double by_b0[BLOCK_RAYS];
    NAMED(read_block)(o, by, block, row, block->first, block->end, &n);
    for (int r = 0; r < block->rays; ++r) {
        int p = block->pixel[r], first = o->offsets[p] - block->first;
        int end = o->offsets[p + 1] - block->first;
        for (int t = 0; t < TERMS; ++t) S[t][r] = (SCALAR)sum_of_row(n.of[t] + first, end - first);
        by_b0[r] = by->by_b0[p] + sum_of_row(n.of[TERMS] + first, end - first);
    }
    NAMED(read_polynomials)(o, block, row, S, block->first, block->end, &n);
    for (int r = 0; r < block->rays; ++r) {
        int p = block->pixel[r], first = o->offsets[p] - block->first;
        int end = o->offsets[p + 1] - block->first;
        double inverse = 1.0 / (o->b0[p] > 0x1p-126 ? o->b0[p] : 0x1p-126);
        double mean =
            inverse * sum_of_products(by->a + o->offsets[p], n.value + first, end - first);
        double keeps = o->b0[p] > 0.0 ? by->keeps * inverse : 0.0;
        more[0][r] = (SCALAR)(by_b0[r] - keeps * mean);
        more[1][r] = (SCALAR)keeps;
    }
    SCALAR *lost = n.of[0];
    bool finite =
        give_block(by, block, more, row[3 * NODES + 1], n.value, n.slope, n.by_z, n.by_own, lost);
    for (int r = 0; r < block->rays; ++r) {
        int p = block->pixel[r], first = o->offsets[p] - block->first;
        by->is_hard[p] = sum_of_row(lost + first, o->offsets[p + 1] - block->first - first) > 0.0;
    }
    return finite;
}
