/* What neural.h has of bounded neural transmittance with NODES nodes. */
#include "kernels/bounded_neural.h"

/* Rays of a block as rows: the rule, the outline without `seen`, and the total. */
FN void NAMED(outlined_rows)(const ray_block *block, const double *rules, const double *outlines,
                             const SCALAR *by_rows, int length, const SCALAR *b0,
                             SCALAR (*row)[BLOCK_ROW]) {
    enum { RULE = 3 * NODES + 1, TOTAL = RULE + MOIT_OUTLINE_SHARED };
    if (by_rows) {
        for (int k = 0; k < TOTAL; ++k) numbers_of_rays(block, by_rows + k * length, row[k]);
        numbers_of_rays(block, b0, row[TOTAL]);
        return;
    }
    for (int r = 0; r < block->rays; ++r) {
        const double *outline = outlines + block->pixel[r] * MOIT_OUTLINE_SIZE;
        NAMED(rule_into_rows)(row, r, rules + block->pixel[r] * MOIT_RULE_SIZE(2 * NODES));
        for (int i = 0; i < MOIT_OUTLINE_SHARED; ++i) row[RULE + i][r] = (SCALAR)outline[i];
        row[TOTAL][r] = b0[block->pixel[r]];
    }
}

/* by_rows: rules and outlines as rows, or NULL. */
FN void NAMED(bounded_of)(int pixels, const int32_t *offsets, const SCALAR *z, const SCALAR *own,
                          const double *rules, const double *outlines, const SCALAR *by_rows,
                          const SCALAR *b0, const float *network, bool absorbed, SCALAR *T,
                          int64_t stride, SCALAR *features) {
    /* steps of a fragment wait for one another: in short loops a processor has several at once */
    enum { OUTLOOKS = 16 * LANES };
    enum { SHARED = 3 * NODES + 1, SUMS = SHARED + 3, TOTAL = SHARED + MOIT_OUTLINE_SHARED };
    enum { INPUTS = 4 + 2 * NODES };
    ray_block block;
    SCALAR row[TOTAL + 1][BLOCK_ROW] = {{0}};
    for (int p = 0; p < pixels;) {
        p = next_block(&block, p, pixels, offsets);
        NAMED(outlined_rows)(&block, rules, outlines, by_rows, MOIT_ROW(pixels), b0, row);
        for (int from = block.first; from < block.end; from += OUTLOOKS) {
            SCALAR room[OUTLOOKS], said[OUTLOOKS], seen[OF_SURFACE][OUTLOOKS];
            int to = block.end - from < OUTLOOKS ? block.end : from + OUTLOOKS;
            for (int i = from; i < to; i += LANES) {
                truth lane;
                int ray = first_ray(&block, i, &lane);
                NAMED(rule) r = NAMED(rule_of_rows)(row, ray, lane);
                NAMED(outline) o;
                o.mean = lanes_of_row(row[SHARED] + ray, lane);
                o.inverse_deviation = lanes_of_row(row[SHARED + 1] + ray, lane);
                o.inverse_total = lanes_of_row(row[SHARED + 2] + ray, lane);
                real total = lanes_of_row(row[TOTAL] + ray, lane);
                NAMED(outlook) at =
                    NAMED(outlook_at)(r, o, total, load(z + i), own ? load(own + i) : K(0.0));
                if (features) {
                    int left = block.end - i;
                    for (int k = 0; k < OF_SURFACE; ++k)
                        store_at_most(features + k * stride + i, at.seen.x[k], left);
                    store_at_most(features + INPUTS * stride + i, at.least, left);
                    store_at_most(features + (INPUTS + 1) * stride + i, at.room, left);
                    continue;
                }
                store(T + i, at.least);
                store(room + (i - from), at.room);
                for (int k = 0; k < OF_SURFACE; ++k) store(seen[k] + (i - from), at.seen.x[k]);
            }
            for (int i = from; !features && i < to; i += LANES) {
                truth lane;
                int ray = first_ray(&block, i, &lane);
                values begun;
                NAMED(outlook) at;
                for (int k = 0; k < HIDDEN; ++k)
                    begun.x[k] = lanes_of_row(row[SUMS + k] + ray, lane);
                for (int k = 0; k < OF_SURFACE; ++k) at.seen.x[k] = load(seen[k] + (i - from));
                store(said + (i - from), NAMED(network_output)(network, begun, at));
            }
            for (int i = from; !features && i < to; i += LANES) {
                real share = sigmoid(load(said + (i - from)));
                store(T + i, load(T + i) + share * load(room + (i - from)));
            }
        }
        if (!features && !absorbed) decay_of(block.first, block.end, T);
    }
    for (int p = 0; features && p < pixels; ++p)
        for (int i = offsets[p]; i < offsets[p + 1]; ++i)
            for (int k = 0; k < 2 * NODES; ++k)
                features[(4 + k) * stride + i] =
                    (SCALAR)outlines[p * MOIT_OUTLINE_SIZE + MOIT_OUTLINE_SHARED + k];
}

static void NAMED(bounded_transmittance_of)(int pixels, const int32_t *offsets, const SCALAR *z,
                                            const SCALAR *own, const double *rules,
                                            const double *outlines, const SCALAR *b0,
                                            const float *network, bool absorbed, SCALAR *T) {
    NAMED(bounded_of)(pixels, offsets, z, own, rules, outlines, NULL, b0, network, absorbed, T, 0,
                      NULL);
}

static void NAMED(bounded_features_of)(int pixels, const int32_t *offsets, const SCALAR *z,
                                       const SCALAR *own, const double *rules,
                                       const double *outlines, const SCALAR *b0,
                                       const float *network, int64_t stride, SCALAR *features) {
    NAMED(bounded_of)(pixels, offsets, z, own, rules, outlines, NULL, b0, network, false, features,
                      stride, features);
}

#ifndef RULES /* float tables only */
static void NAMED(bounded_by_rows_of)(int pixels, const int32_t *offsets, const float *z,
                                      const float *own, const float *rows, const float *b0,
                                      const float *network, bool absorbed, float *T) {
    NAMED(bounded_of)(pixels, offsets, z, own, NULL, NULL, rows, b0, network, absorbed, T, 0, NULL);
}
#endif

#ifdef RULES /* double tables only */
static void NAMED(outlines_of)(int pixels, const double *rules, const double *b0,
                               const double *extents, const float *network, double *outlines) {
    for (int p = 0; p < pixels; p += LANES) {
        SCALAR own[2 * NODES + 3][LANES];
        for (int lane = 0; lane < LANES; ++lane) {
            int from = p + lane < pixels ? p + lane : p;
            for (int k = 0; k <= 2 * NODES; ++k)
                own[k][lane] = rules[from * MOIT_RULE_SIZE(2 * NODES) + k];
            own[2 * NODES + 1][lane] = b0[from];
            const double *ends = extents ? extents + 2 * from : NULL;
            own[2 * NODES + 2][lane] = ends ? 0.5 * (ends[1] - ends[0]) : 1.0;
        }
        NAMED(rule) r;
        for (int k = 0; k < NODES; ++k) {
            r.g[k] = load(own[k]);
            r.g_low[k] = K(0.0);
            r.e[k] = load(own[NODES + k]);
        }
        r.d = load(own[2 * NODES]);
        NAMED(outline) o = NAMED(outline_of)(r, load(own[2 * NODES + 1]), load(own[2 * NODES + 2]));
        values begun = NAMED(first_sums)(network, o);
        for (int lane = 0; lane < LANES && p + lane < pixels; ++lane) {
            double *out = outlines + (p + lane) * MOIT_OUTLINE_SIZE;
            out[0] = o.mean[lane];
            out[1] = o.inverse_deviation[lane];
            out[2] = o.inverse_total[lane];
            for (int k = 0; k < HIDDEN; ++k) out[3 + k] = begun.x[k][lane];
            for (int k = 0; k < 2 * NODES; ++k) out[MOIT_OUTLINE_SHARED + k] = o.seen.x[k][lane];
        }
    }
}

/* Logarithms wait for their steps, too: of several vectors they are taken together. */
FN void NAMED(inputs_together)(int n, const real *unit, real (*seen)[OF_RAY]) {
    for (int v = 0; v < n; ++v) {
        values shape;
        for (int k = 0; k < OF_RAY; ++k) shape.x[k] = seen[v][k];
        shape = NAMED(inputs_of)(shape, unit ? unit[v] : K(1.0));
        for (int k = 0; k < OF_RAY; ++k) seen[v][k] = shape.x[k];
    }
}

static void NAMED(bounded_rows_of)(int pixels, const float *b, const float *b0, double bias,
                                   const double *safe, double least, const double *extents,
                                   const float *network, float *rows) {
    enum { TOGETHER = NAMED(RULES_TOGETHER), RULE_ROWS = MOIT_RULE_ROWS(2 * NODES) };
    const int length = MOIT_ROW(pixels);
    NAMED(some_rules) of;
    real seen[TOGETHER][OF_RAY], unit[TOGETHER];
    for (int k = 0; k < 2 * NODES; ++k) of.safe.b[k] = K(safe[k]);
    for (int first = 0; first < pixels; first += TOGETHER * LANES) {
        NAMED(gather_floats)(first, pixels, b, &of);
        NAMED(find_rules)(1, &of, bias, least);
        for (int v = 0, p = first; v < of.vectors; ++v, p += LANES) {
            NAMED(rule) r = of.rule[v];
            float *row = rows + p;
            real total;
            NAMED(put_rule)(r, length, row);
            row += RULE_ROWS * length;
            columns_of_floats(1, pixels - p, b0 + p, &total);
            for (int k = 0; k < NODES; ++k) r.g_low[k] = K(0.0);
            NAMED(outline) o = NAMED(shape_of)(r, total);
            put_floats(row, o.mean);
            put_floats(row + length, o.inverse_deviation);
            put_floats(row + 2 * length, o.inverse_total);
            for (int k = 0; k < OF_RAY; ++k) seen[v][k] = o.seen.x[k];
        }
        if (extents) {
            for (int v = 0, p = first; v < of.vectors; ++v, p += LANES) {
                unit[v] = K(1.0);
                for (int lane = 0; lane < LANES && p + lane < pixels; ++lane)
                    unit[v][lane] = 0.5 * (extents[2 * (p + lane) + 1] - extents[2 * (p + lane)]);
            }
            NAMED(inputs_together)(of.vectors, unit, seen);
        } else NAMED(inputs_together)(of.vectors, NULL, seen);
        for (int v = 0; v < of.vectors; ++v) {
            float *row = rows + first + v * LANES + (RULE_ROWS + 3) * length;
            NAMED(outline) o;
            for (int k = 0; k < OF_RAY; ++k) o.seen.x[k] = seen[v][k];
            values begun = NAMED(first_sums)(network, o);
            for (int k = 0; k < HIDDEN; ++k) put_floats(row + k * length, begun.x[k]);
        }
    }
}
#endif
