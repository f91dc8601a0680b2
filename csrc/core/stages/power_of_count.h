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
        for (int i = block.first; i < block.end; i += LANES) {
            truth lane;
            int ray = first_ray(&block, i, &lane);
            NAMED(rule) r = NAMED(rule_of_rows)(row, ray, lane);
            real total = lanes_of_row(row[3 * NODES + 1] + ray, lane);
            store(T + i, NAMED(absorbance_before)(r, total, load(z + i),
                                                  own ? load(own + i) : K(0.0), K(beta)));
        }
        if (!absorbed) decay_of_block(&block, T);
    }
}
