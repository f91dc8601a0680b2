/* What trigonometric.h has of NODES nodes. */

/* Lanes as in power.h. */
static void NAMED(circle_transmittance_of)(const moit_wrapping_zone *zone_, int pixels,
                                           const int32_t *offsets, const SCALAR *z,
                                           const SCALAR *own, const double *rules, const SCALAR *b0,
                                           double beta, bool absorbed, SCALAR *T) {
    wrapping_zone zone = zone_of(zone_);
    ray_block block;
    SCALAR row[5 * NODES + 4][BLOCK_ROW] = {{0}};
    for (int p = 0; p < pixels;) {
        p = next_block(&block, p, pixels, offsets);
        for (int r = 0; r < block.rays; ++r) {
            const double *rule = rules + block.pixel[r] * MOIT_CIRCLE_RULE_SIZE(NODES);
            for (int i = 0; i < 2 * NODES; ++i) { /* z and g */
                row[i][r] = (SCALAR)rule[i];
                row[2 * NODES + i][r] = (SCALAR)(rule[i] - (double)row[i][r]);
            }
            for (int i = 0; i < NODES + 3; ++i) row[4 * NODES + i][r] = (SCALAR)rule[2 * NODES + i];
            row[5 * NODES + 3][r] = b0[block.pixel[r]];
        }
        for (int i = block.first; i < block.end; i += LANES) {
            truth lane;
            int ray = first_ray(&block, i, &lane);
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
            real total = lanes_of_row(row[5 * NODES + 3] + ray, lane);
            store(T + i, NAMED(circle_absorbance_before)(r, zone, total, load(z + i),
                                                         own ? load(own + i) : K(0.0), K(beta)));
        }
        if (!absorbed) decay_of_block(&block, T);
    }
}
