/* Rules of NODES nodes of a block of rays, in rows that lanes read. Behind
 * kernels/power_moments.h. */

/* Rules of a block's rays as rows of numbers, the rest of nodes that rounding takes among them. */
FN void NAMED(rule_into_rows)(SCALAR (*row)[BLOCK_ROW], int r, const double *rule) {
    for (int i = 0; i < NODES; ++i) {
        row[i][r] = (SCALAR)rule[i];
        row[NODES + i][r] = (SCALAR)(rule[i] - (double)row[i][r]);
        row[2 * NODES + i][r] = (SCALAR)rule[NODES + i];
    }
    row[3 * NODES][r] = (SCALAR)rule[2 * NODES];
}

FN NAMED(rule) NAMED(rule_of_rows)(SCALAR (*row)[BLOCK_ROW], int ray, truth lane) {
    NAMED(rule) r;
    for (int k = 0; k < NODES; ++k) {
        r.g[k] = lanes_of_row(row[k] + ray, lane);
        r.g_low[k] = lanes_of_row(row[NODES + k] + ray, lane);
        r.e[k] = lanes_of_row(row[2 * NODES + k] + ray, lane);
    }
    r.d = lanes_of_row(row[3 * NODES] + ray, lane);
    return r;
}
