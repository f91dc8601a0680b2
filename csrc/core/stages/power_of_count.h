/* What power.h has of NODES nodes. */
#include "kernels/power_moments.h"
#include "core/stages/rule_rows_of_count.h"

/* The rule of one pixel in all lanes; what a float32 node rounds off is kept in g_low. */
FN NAMED(rule) NAMED(load_rule)(const double *p) {
    NAMED(rule) r;
    for (int i = 0; i < NODES; ++i) {
        SCALAR g = (SCALAR)p[i];
        r.g[i] = K(g);
        r.g_low[i] = K(p[i] - (double)g);
        r.e[i] = K(p[NODES + i]);
    }
    r.d = K(p[2 * NODES]);
    return r;
}

#if NODES > 2
/* What is absorbed in front of a block's fragments. Steps to a root wait for one another: each is
 * taken for several vectors before the next is, so that a processor has other work meanwhile. */
FN void NAMED(absorbance_of_block)(const ray_block *block, SCALAR (*row)[BLOCK_ROW],
                                   const SCALAR *z, const SCALAR *own, double beta, SCALAR *T) {
    enum { TOGETHER = 8 };
    NAMED(place) o[TOGETHER];
    NAMED(outer_end) end[TOGETHER];
    NAMED(sought_root) x[TOGETHER];
    const real most = K(FARTHEST), converged = CONVERGED;
    truth lane;
    for (int from = block->first; from < block->end; from += TOGETHER * LANES) {
        int left = (block->end - from + LANES - 1) / LANES, n = left < TOGETHER ? left : TOGETHER;
        for (int k = 0; k < n; ++k) {
            int ray = first_ray(block, from + k * LANES, &lane);
            NAMED(rule) r = NAMED(rule_of_rows)(row, ray, lane);
            o[k] = NAMED(place_of)(r, load(z + from + k * LANES));
            end[k] = NAMED(outer_end_of)(r, o[k]);
        }
        for (int k = 0; k < n; ++k)
            x[k] = NAMED(lowest_root_start)(o[k].p, end[k].level, end[k].e, end[k].gap, NODES, most,
                                            end[k].inside);
        for (int k = 0; k < n; ++k)
            x[k] = NAMED(lowest_root_nearer)(x[k], converged, o[k].p, end[k].level, end[k].e,
                                             end[k].gap, NODES, most);
        for (int k = 0; k < n; ++k)
            x[k].s = NAMED(lowest_root_found)(x[k], 1, converged, o[k].p, end[k].level, end[k].e,
                                              end[k].gap, NODES, most);
        for (int k = 0, i = from; k < n; ++k, i += LANES) {
            int ray = first_ray(block, i, &lane);
            NAMED(rule) r = NAMED(rule_of_rows)(row, ray, lane);
            NAMED(masses) mass = NAMED(masses_from_end)(r, o[k], end[k], x[k].s);
            store(T + i, NAMED(absorbance_past)(mass, lanes_of_row(row[3 * NODES + 1] + ray, lane),
                                                own ? load(own + i) : K(0.0), K(beta)));
        }
    }
}
#else
FN void NAMED(absorbance_of_block)(const ray_block *block, SCALAR (*row)[BLOCK_ROW],
                                   const SCALAR *z, const SCALAR *own, double beta, SCALAR *T) {
    for (int i = block->first; i < block->end; i += LANES) {
        truth lane;
        int ray = first_ray(block, i, &lane);
        NAMED(rule) r = NAMED(rule_of_rows)(row, ray, lane);
        real total = lanes_of_row(row[3 * NODES + 1] + ray, lane);
        store(T + i, NAMED(absorbance_before)(r, total, load(z + i), own ? load(own + i) : K(0.0),
                                              K(beta)));
    }
}
#endif

/* Lanes are fragments, whatever pixels they belong to; the last vector of a block of pixels runs on
 * into the next, which overwrites it in its turn. */
static void NAMED(transmittance_of)(int pixels, const int32_t *offsets, const SCALAR *z,
                                    const SCALAR *own, const double *rules, const SCALAR *b0,
                                    double beta, bool absorbed, SCALAR *T) {
    ray_block block;
    SCALAR row[3 * NODES + 2][BLOCK_ROW] = {{0}};
    for (int p = 0; p < pixels;) {
        p = next_block(&block, p, pixels, offsets);
        for (int r = 0; r < block.rays; ++r) {
            NAMED(rule_into_rows)(row, r, rules + block.pixel[r] * MOIT_RULE_SIZE(2 * NODES));
            row[3 * NODES + 1][r] = b0[block.pixel[r]];
        }
        NAMED(absorbance_of_block)(&block, row, z, own, beta, T);
        if (!absorbed) decay_of_block(&block, T);
    }
}
