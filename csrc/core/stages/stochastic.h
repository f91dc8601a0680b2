/* Stages of stochastic transparency. */

static void fragment_keys_stage(int n, uint32_t seed, const uint32_t *row, const uint32_t *column,
                                const void *depth_, const void *alpha_, uint32_t *key) {
    const SCALAR *depth = depth_, *alpha = alpha_;
    for (int i = 0; i < n; i += LANES) {
        uint y, x;
        memcpy(&y, row + i, sizeof y);
        memcpy(&x, column + i, sizeof x);
        uint k = fragment_key(U(seed), y, x, load_at_most(depth + i, n - i),
                              load_at_most(alpha + i, n - i));
        memcpy(key + i, &k, sizeof k);
    }
}

FN void coverage_by(int stratified, int samples, int n, const SCALAR *alpha, const uint32_t *key,
                    const uint32_t *twin, uint32_t *low, uint32_t *high) {
    for (int i = 0; i < n; i += LANES) {
        uint k, t;
        memcpy(&k, key + i, sizeof k);
        memcpy(&t, twin + i, sizeof t);
        coverage c = coverage_of(k, t, load_at_most(alpha + i, n - i), samples, stratified);
        memcpy(low + i, &c.low, sizeof c.low);
        memcpy(high + i, &c.high, sizeof c.high);
    }
}

static void coverage_stage(int samples, bool stratified, int n, const void *alpha,
                           const uint32_t *key, const uint32_t *twin, uint32_t *low,
                           uint32_t *high) {
    if (stratified) coverage_by(1, samples, n, alpha, key, twin, low, high);
    else coverage_by(0, samples, n, alpha, key, twin, low, high);
}

/* Lanes are samples here. */
static void nearest_covering_stage(int samples, int pixels, const int32_t *offsets,
                                   const void *depth_, const uint32_t *low, const uint32_t *high,
                                   void *nearest_) {
    const SCALAR *depth = depth_;
    SCALAR *nearest = nearest_;
    int row = MOIT_SAMPLE_ROW(samples);
    truth bit[32 / LANES];
    for (int v = 0; v < 32 / LANES; ++v)
        for (int k = 0; k < LANES; ++k) bit[v][k] = (bits)(1u << (v * LANES + k));
    for (int p = 0; p < pixels; ++p)
        for (int s = 0; s < row; s += LANES) {
            const uint32_t *covered = s < 32 ? low : high;
            truth own = bit[s % 32 / LANES];
            real z = K(__builtin_inf());
            for (int i = offsets[p]; i < offsets[p + 1]; ++i) {
                real d = K(depth[i]);
                truth covers = (own & (bits)covered[i]) != 0;
                z = min(z, select(covers, d, z));
            }
            store(nearest + (int64_t)p * row + s, z);
        }
}

static void shares_seen_stage(int samples, int pixels, const int32_t *offsets, const void *depth_,
                              const void *nearest_, void *T_) {
    const SCALAR *depth = depth_, *nearest = nearest_;
    SCALAR *T = T_;
    int row = MOIT_SAMPLE_ROW(samples), n = offsets[pixels];
    for (int p = 0; p < pixels; ++p, nearest += row)
        for (int i = offsets[p]; i < offsets[p + 1]; i += LANES) {
            /* lanes of later pixels are overwritten when these have their turn */
            real d = load_at_most(depth + i, n - i), seen = K(0.0);
            for (int s = 0; s < samples; ++s) seen += seen_by(K(nearest[s]), d);
            store(T + i, seen / K(samples));
        }
}
