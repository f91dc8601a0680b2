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

/* The rule of each of LANES fragments from the i-th on, and b0. */
FN NAMED(rule) NAMED(rule_at)(const rays_of_fragments *rays, int i, real *b0) {
    if (rays->block) {
        truth lane;
        int ray = first_ray(rays->block, i, &lane);
        *b0 = lanes_of_row(rays->row[3 * NODES + 1] + ray, lane);
        return NAMED(rule_of_rows)(rays->row, ray, lane);
    }
    NAMED(rule) r;
    const SCALAR *each = rays->each + i;
    for (int k = 0; k < NODES; ++k) {
        r.g[k] = load(each + k * rays->length);
        r.g_low[k] = load(each + (NODES + k) * rays->length);
        r.e[k] = load(each + (2 * NODES + k) * rays->length);
    }
    r.d = load(each + 3 * NODES * rays->length);
    *b0 = load(rays->b0 + i);
    return r;
}

#if NODES > 2
/* What is absorbed in front of fragments. Steps to a root wait for one another: each is
 * taken for several vectors before the next is, so that a processor has other work meanwhile. */
FN void NAMED(absorbance_of)(const rays_of_fragments rays, int first, int last, const SCALAR *z,
                             const SCALAR *own, double beta, SCALAR *T) {
    enum { TOGETHER = 8 };
    NAMED(place) o[TOGETHER];
    NAMED(outer_end) end[TOGETHER];
    NAMED(sought_root) x[TOGETHER];
    const real most = K(FARTHEST), converged = CONVERGED;
    real b0;
    for (int from = first; from < last; from += TOGETHER * LANES) {
        int left = (last - from + LANES - 1) / LANES, n = left < TOGETHER ? left : TOGETHER;
        for (int k = 0; k < n; ++k) {
            NAMED(rule) r = NAMED(rule_at)(&rays, from + k * LANES, &b0);
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
            NAMED(rule) r = NAMED(rule_at)(&rays, i, &b0);
            NAMED(masses) mass = NAMED(masses_from_end)(r, o[k], end[k], x[k].s);
            store(T + i, NAMED(absorbance_past)(mass, b0, own ? load(own + i) : K(0.0), K(beta)));
        }
    }
}
#else
FN void NAMED(absorbance_of)(const rays_of_fragments rays, int first, int last, const SCALAR *z,
                             const SCALAR *own, double beta, SCALAR *T) {
    for (int i = first; i < last; i += LANES) {
        real b0;
        NAMED(rule) r = NAMED(rule_at)(&rays, i, &b0);
        store(T + i,
              NAMED(absorbance_before)(r, b0, load(z + i), own ? load(own + i) : K(0.0), K(beta)));
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
        NAMED(absorbance_of)((rays_of_fragments){.block = &block, .row = row}, block.first,
                             block.end, z, own, beta, T);
        if (!absorbed) decay_of(block.first, block.end, T);
    }
}

#ifndef RULES /* float tables only */
/* The same by rows. */
static void NAMED(transmittance_by_rows_of)(int pixels, const int32_t *offsets, const SCALAR *z,
                                            const SCALAR *own, const SCALAR *rows, const SCALAR *b0,
                                            double beta, bool absorbed, SCALAR *T) {
    const int length = MOIT_ROW(pixels);
    ray_block block;
    SCALAR row[3 * NODES + 2][BLOCK_ROW] = {{0}};
    if (!offsets) {
        int whole = pixels / LANES * LANES;
        rays_of_fragments each = {.each = rows, .b0 = b0, .length = length};
        NAMED(absorbance_of)(each, 0, whole, z, own, beta, T);
        if (whole < pixels) { /* b0 and own end where they end */
            SCALAR last[2][LANES] = {{0}};
            size_t left = (size_t)(pixels - whole) * sizeof(SCALAR);
            memcpy(last[0], b0 + whole, left);
            if (own) memcpy(last[1], own + whole, left);
            each.each += whole;
            each.b0 = last[0];
            NAMED(absorbance_of)(each, 0, 1, z + whole, own ? last[1] : NULL, beta, T + whole);
        }
        if (!absorbed) decay_of(0, pixels, T);
        return;
    }
    for (int p = 0; p < pixels;) {
        p = next_block(&block, p, pixels, offsets);
        for (int k = 0; k < 3 * NODES + 2; ++k)
            numbers_of_rays(&block, k <= 3 * NODES ? rows + k * length : b0, row[k]);
        NAMED(absorbance_of)((rays_of_fragments){.block = &block, .row = row}, block.first,
                             block.end, z, own, beta, T);
        if (!absorbed) decay_of(block.first, block.end, T);
    }
}
#endif
