/* What trigonometric.h has of NODES nodes. */

/* Numbers of a block's rays as rows, which lanes read: z and g, what rounding takes of these,
 * residues, d and f at the zone's ends, and b0. */
enum { NAMED(CIRCLE_ROWS) = 5 * NODES + 4 };

FN void NAMED(circle_into_rows)(SCALAR (*row)[BLOCK_ROW], int r, const double *rule, SCALAR b0) {
    for (int i = 0; i < 2 * NODES; ++i) {
        row[i][r] = (SCALAR)rule[i];
        row[2 * NODES + i][r] = (SCALAR)(rule[i] - (double)row[i][r]);
    }
    for (int i = 0; i < NODES + 3; ++i) row[4 * NODES + i][r] = (SCALAR)rule[2 * NODES + i];
    row[5 * NODES + 3][r] = b0;
}

FN NAMED(circle_rule) NAMED(circle_of_rows)(SCALAR (*row)[BLOCK_ROW], int ray, truth lane) {
    NAMED(circle_rule) r;
    for (int k = 0; k < NODES; ++k) {
        r.z[k] = lanes_of_row(row[k] + ray, lane);
        r.g[k] = lanes_of_row(row[NODES + k] + ray, lane);
        r.z_low[k] = lanes_of_row(row[2 * NODES + k] + ray, lane);
        r.g_low[k] = lanes_of_row(row[3 * NODES + k] + ray, lane);
        r.e[k] = lanes_of_row(row[4 * NODES + k] + ray, lane);
    }
    r.d = lanes_of_row(row[5 * NODES] + ray, lane);
    r.f_front = lanes_of_row(row[5 * NODES + 1] + ray, lane);
    r.f_back = lanes_of_row(row[5 * NODES + 2] + ray, lane);
    return r;
}

/* As absorbance_of_block of power moments: roots of several vectors of fragments are sought
 * together. */
FN void NAMED(circle_absorbance_of_block)(const ray_block *block, SCALAR (*row)[BLOCK_ROW],
                                          wrapping_zone zone, const SCALAR *z, const SCALAR *own,
                                          double beta, SCALAR *T) {
    enum { TOGETHER = 8 };
    NAMED(circle_place) o[TOGETHER];
    NAMED(outer_end) end[2][TOGETHER];
    NAMED(sought_root) x[2][TOGETHER];
    const real most = K(CIRCLE_FARTHEST), converged = CONVERGED;
    truth lane;
    for (int from = block->first; from < block->end; from += TOGETHER * LANES) {
        int left = (block->end - from + LANES - 1) / LANES, n = left < TOGETHER ? left : TOGETHER;
        for (int k = 0; k < n; ++k) {
            int ray = first_ray(block, from + k * LANES, &lane);
            NAMED(circle_rule) r = NAMED(circle_of_rows)(row, ray, lane);
            o[k] = NAMED(circle_place_of)(r, zone, load(z + from + k * LANES));
            end[0][k] = NAMED(circle_end_of)(r, o[k], 0);
            end[1][k] = NAMED(circle_end_of)(r, o[k], 1);
        }
        for (int b = 0; b < 2; ++b) {
            for (int k = 0; k < n; ++k)
                x[b][k] = NAMED(lowest_root_start)(o[k].p, end[b][k].level, end[b][k].e,
                                                   end[b][k].gap, NODES, most, end[b][k].inside);
            for (int k = 0; k < n; ++k)
                x[b][k] = NAMED(lowest_root_nearer)(x[b][k], converged, o[k].p, end[b][k].level,
                                                    end[b][k].e, end[b][k].gap, NODES, most);
            for (int k = 0; k < n; ++k)
                x[b][k].s = NAMED(lowest_root_found)(x[b][k], 1, converged, o[k].p, end[b][k].level,
                                                     end[b][k].e, end[b][k].gap, NODES, most);
        }
        for (int k = 0, i = from; k < n; ++k, i += LANES) {
            int ray = first_ray(block, i, &lane);
            NAMED(circle_rule) r = NAMED(circle_of_rows)(row, ray, lane);
            real ends = NAMED(counted_end)(r, zone, o[k], end[0][k], 0, x[0][k].s)
                        + NAMED(counted_end)(r, zone, o[k], end[1][k], 1, x[1][k].s);
#if NODES == 4
            ends = ends + NAMED(second_weight)(r, o[k]);
#endif
            NAMED(masses) mass = NAMED(circle_masses)(o[k], ends);
            store(T + i, NAMED(absorbance_past)(mass, lanes_of_row(row[5 * NODES + 3] + ray, lane),
                                                own ? load(own + i) : K(0.0), K(beta)));
        }
    }
}

/* Lanes as in power.h. */
static void NAMED(circle_transmittance_of)(const moit_wrapping_zone *zone_, int pixels,
                                           const int32_t *offsets, const SCALAR *z,
                                           const SCALAR *own, const double *rules, const SCALAR *b0,
                                           double beta, bool absorbed, SCALAR *T) {
    wrapping_zone zone = zone_of(zone_);
    ray_block block;
    SCALAR row[NAMED(CIRCLE_ROWS)][BLOCK_ROW] = {{0}};
    for (int p = 0; p < pixels;) {
        p = next_block(&block, p, pixels, offsets);
        for (int r = 0; r < block.rays; ++r)
            NAMED(circle_into_rows)(row, r, rules + block.pixel[r] * MOIT_CIRCLE_RULE_SIZE(NODES),
                                    b0[block.pixel[r]]);
        NAMED(circle_absorbance_of_block)(&block, row, zone, z, own, beta, T);
        if (!absorbed) decay_of(block.first, block.end, T);
    }
}
