/* What neural.h has of bounded neural transmittance with NODES nodes. */
#include "kernels/bounded_neural.h"

FN void NAMED(bounded_of)(int pixels, const int32_t *offsets, const SCALAR *z, const SCALAR *own,
                          const double *rules, const double *outlines, const SCALAR *b0,
                          const float *network, bool absorbed, SCALAR *T, int64_t stride,
                          SCALAR *features) {
    /* steps of a fragment wait for one another: in short loops a processor has several at once */
    enum { OUTLOOKS = 16 * LANES };
    enum { RULE = 3 * NODES + 1, SHARED = RULE + 1, SUMS = SHARED + 3, INPUTS = 4 + 2 * NODES };
    ray_block block;
    /* what lanes need of their rays: the rule, the total, and the outline without `seen` */
    SCALAR row[3 * NODES + 2 + MOIT_OUTLINE_SHARED][BLOCK_ROW] = {{0}};
    for (int p = 0; p < pixels;) {
        p = next_block(&block, p, pixels, offsets);
        for (int r = 0; r < block.rays; ++r) {
            const double *outline = outlines + block.pixel[r] * MOIT_OUTLINE_SIZE;
            NAMED(rule_into_rows)(row, r, rules + block.pixel[r] * MOIT_RULE_SIZE(2 * NODES));
            row[RULE][r] = b0[block.pixel[r]];
            for (int i = 0; i < MOIT_OUTLINE_SHARED; ++i) row[SHARED + i][r] = (SCALAR)outline[i];
        }
        for (int from = block.first; from < block.end; from += OUTLOOKS) {
            SCALAR room[OUTLOOKS], seen[OF_SURFACE][OUTLOOKS];
            int to = block.end - from < OUTLOOKS ? block.end : from + OUTLOOKS;
            for (int i = from; i < to; i += LANES) {
                truth lane;
                int ray = first_ray(&block, i, &lane);
                NAMED(rule) r = NAMED(rule_of_rows)(row, ray, lane);
                NAMED(outline) o;
                o.mean = lanes_of_row(row[SHARED] + ray, lane);
                o.inverse_deviation = lanes_of_row(row[SHARED + 1] + ray, lane);
                o.inverse_total = lanes_of_row(row[SHARED + 2] + ray, lane);
                real total = lanes_of_row(row[RULE] + ray, lane);
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
                real share = NAMED(predicted_share)(network, begun, at);
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
    NAMED(bounded_of)(pixels, offsets, z, own, rules, outlines, b0, network, absorbed, T, 0, NULL);
}

static void NAMED(bounded_features_of)(int pixels, const int32_t *offsets, const SCALAR *z,
                                       const SCALAR *own, const double *rules,
                                       const double *outlines, const SCALAR *b0,
                                       const float *network, int64_t stride, SCALAR *features) {
    NAMED(bounded_of)(pixels, offsets, z, own, rules, outlines, b0, network, false, features,
                      stride, features);
}

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
#endif
