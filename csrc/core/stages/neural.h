/* Stages of networks: what they see of pixels, with lanes over pixels, and what they say of fragments,
 * with lanes over these. */

#define WIDEST 32
#include "kernels/network.h"

#define NODES 2
#include "kernels/bounded_neural.h"
#undef NODES
#define NODES 3
#include "kernels/bounded_neural.h"
#undef NODES

/* Row by row what lanes need of their rays: the rule, the total, and the outline without `seen`. */
#define BOUNDED_ROWS(n) (3 * n + 2 + MOIT_OUTLINE_SHARED)

#define BOUNDED_OF(n) \
    FN void bounded_of##n(int pixels, const int32_t *offsets, const SCALAR *z, const SCALAR *own, \
                          const double *rules, const double *outlines, const SCALAR *b0, \
                          const float *network, SCALAR *T, int64_t stride, SCALAR *features) { \
        enum { RULE = 3 * n + 1, SHARED = RULE + 1, SUMS = SHARED + 3, INPUTS = 4 + 2 * n }; \
        ray_block block; \
        SCALAR row[BOUNDED_ROWS(n)][BLOCK_ROW] = {{0}}; \
        for (int p = 0; p < pixels;) { \
            p = next_block(&block, p, pixels, offsets); \
            for (int r = 0; r < block.rays; ++r) { \
                const double *outline = outlines + block.pixel[r] * MOIT_OUTLINE_SIZE; \
                rule_into_rows##n(row, r, rules + block.pixel[r] * MOIT_RULE_SIZE(2 * n)); \
                row[RULE][r] = b0[block.pixel[r]]; \
                for (int i = 0; i < MOIT_OUTLINE_SHARED; ++i) \
                    row[SHARED + i][r] = (SCALAR)outline[i]; \
            } \
            for (int i = block.first; i < block.end; i += LANES) { \
                truth lane; \
                int ray = first_ray(&block, i, &lane); \
                rule##n r = rule_of_rows##n(row, ray, lane); \
                outline##n o; \
                o.mean = lanes_of_row(row[SHARED] + ray, lane); \
                o.inverse_deviation = lanes_of_row(row[SHARED + 1] + ray, lane); \
                o.inverse_total = lanes_of_row(row[SHARED + 2] + ray, lane); \
                real total = lanes_of_row(row[RULE] + ray, lane); \
                outlook##n at = \
                    outlook_at##n(r, o, total, load(z + i), own ? load(own + i) : K(0.0)); \
                if (features) { \
                    int left = block.end - i; \
                    for (int k = 0; k < 4; ++k) \
                        store_at_most(features + k * stride + i, at.seen.x[k], left); \
                    store_at_most(features + INPUTS * stride + i, at.least, left); \
                    store_at_most(features + (INPUTS + 1) * stride + i, at.room, left); \
                    continue; \
                } \
                values begun; \
                for (int k = 0; k < HIDDEN; ++k) \
                    begun.x[k] = lanes_of_row(row[SUMS + k] + ray, lane); \
                store(T + i, predicted_absorbance##n(network, begun, at)); \
            } \
            if (!features) decay_of_block(&block, T); \
        } \
        for (int p = 0; features && p < pixels; ++p) \
            for (int i = offsets[p]; i < offsets[p + 1]; ++i) \
                for (int k = 0; k < 2 * n; ++k) \
                    features[(4 + k) * stride + i] = \
                        (SCALAR)outlines[p * MOIT_OUTLINE_SIZE + MOIT_OUTLINE_SHARED + k]; \
    } \
    static void bounded_transmittance_of##n(int pixels, const int32_t *offsets, const SCALAR *z, \
                                            const SCALAR *own, const double *rules, \
                                            const double *outlines, const SCALAR *b0, \
                                            const float *network, SCALAR *T) { \
        bounded_of##n(pixels, offsets, z, own, rules, outlines, b0, network, T, 0, NULL); \
    } \
    static void bounded_features_of##n(int pixels, const int32_t *offsets, const SCALAR *z, \
                                       const SCALAR *own, const double *rules, \
                                       const double *outlines, const SCALAR *b0, \
                                       const float *network, int64_t stride, SCALAR *features) { \
        bounded_of##n(pixels, offsets, z, own, rules, outlines, b0, network, features, stride, \
                      features); \
    }
BOUNDED_OF(2)
BOUNDED_OF(3)
#undef BOUNDED_OF
#undef BOUNDED_ROWS

static void bounded_transmittance_stage(int count, int pixels, const int32_t *offsets,
                                        const void *z, const void *own, const double *rules,
                                        const double *outlines, const void *b0,
                                        const float *network, void *T) {
    switch (count) {
    case 4:
        bounded_transmittance_of2(pixels, offsets, z, own, rules, outlines, b0, network, T);
        break;
    case 6:
        bounded_transmittance_of3(pixels, offsets, z, own, rules, outlines, b0, network, T);
        break;
    }
}

static void bounded_features_stage(int count, int pixels, const int32_t *offsets, const void *z,
                                   const void *own, const double *rules, const double *outlines,
                                   const void *b0, const float *network, int64_t stride,
                                   void *features) {
    switch (count) {
    case 4:
        bounded_features_of2(pixels, offsets, z, own, rules, outlines, b0, network, stride,
                             features);
        break;
    case 6:
        bounded_features_of3(pixels, offsets, z, own, rules, outlines, b0, network, stride,
                             features);
        break;
    }
}

#ifdef RULES /* double tables only */
#define OUTLINES_OF(n) \
    static void outlines_of##n(int pixels, const double *rules, const double *b0, \
                               const float *network, double *outlines) { \
        for (int p = 0; p < pixels; p += LANES) { \
            SCALAR own[2 * n + 2][LANES]; \
            for (int lane = 0; lane < LANES; ++lane) { \
                int from = p + lane < pixels ? p + lane : p; \
                for (int k = 0; k <= 2 * n; ++k) \
                    own[k][lane] = rules[from * MOIT_RULE_SIZE(2 * n) + k]; \
                own[2 * n + 1][lane] = b0[from]; \
            } \
            rule##n r; \
            for (int k = 0; k < n; ++k) { \
                r.g[k] = load(own[k]); \
                r.g_low[k] = K(0.0); \
                r.e[k] = load(own[n + k]); \
            } \
            r.d = load(own[2 * n]); \
            outline##n o = outline_of##n(r, load(own[2 * n + 1])); \
            values begun = first_sums##n(network, o); \
            for (int lane = 0; lane < LANES && p + lane < pixels; ++lane) { \
                double *out = outlines + (p + lane) * MOIT_OUTLINE_SIZE; \
                out[0] = o.mean[lane]; \
                out[1] = o.inverse_deviation[lane]; \
                out[2] = o.inverse_total[lane]; \
                for (int k = 0; k < HIDDEN; ++k) out[3 + k] = begun.x[k][lane]; \
                for (int k = 0; k < 2 * n; ++k) out[MOIT_OUTLINE_SHARED + k] = o.seen.x[k][lane]; \
            } \
        } \
    }
OUTLINES_OF(2)
OUTLINES_OF(3)
#undef OUTLINES_OF

static void bounded_outlines_stage(int count, int pixels, const double *rules, const double *b0,
                                   const float *network, double *outlines) {
    switch (count) {
    case 4: outlines_of2(pixels, rules, b0, network, outlines); break;
    case 6: outlines_of3(pixels, rules, b0, network, outlines); break;
    }
}
#define BOUNDED_OUTLINES_STAGE bounded_outlines_stage
#else
#define BOUNDED_OUTLINES_STAGE NULL
#endif
