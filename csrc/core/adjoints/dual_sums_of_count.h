/* Sums of what dual_of_count.h gives at the places of one pixel. */

/* Sums over places, as four sums of every fourth: the same bits whatever lanes there are. */
STRUCT(NAMED(sums)) { quad of[TERMS + 1]; }; /* S, and by b0 */

/* Adds the lanes that are there, those of places i on; the others are 0. */
FN void NAMED(sum_up)(NAMED(sums) *sums, const NAMED(pulled) *p, int i, truth there, double *by_z,
                      double *by_own) {
    for (int t = 0; t <= TERMS; ++t) add_by_fours(sums->of + t, i, t < TERMS ? p->S[t] : p->b0);
    add_where(there, by_z + i, p->z);
    if (by_own) add_where(there, by_own + i, p->own);
}

/* Fills S, and gives the sum by b0. */
FN double NAMED(give_sums)(const NAMED(sums) *sums, double *S) {
    double sum = 0.0;
    for (int t = 0; t <= TERMS; ++t) {
        quad x = sums->of[t];
        sum = (x[0] + x[1]) + (x[2] + x[3]);
        if (t < TERMS) S[t] = sum;
    }
    return sum;
}
