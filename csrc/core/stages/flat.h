/* Stages over the flat array of a tile's fragments: lanes are neighbouring fragments. */

static void opacities_stage(int n, const void *alpha_, const void *transmission_, void *red_,
                            void *green_, void *blue_, void *net_) {
    const SCALAR *alpha = alpha_, *transmission = transmission_;
    SCALAR *red = red_, *green = green_, *blue = blue_, *net = net_;
    for (int i = 0; i < n; ++i) {
        double a = (double)alpha[i];
        red[i] = (SCALAR)(a * (1.0 - (double)transmission[3 * i]));
        green[i] = (SCALAR)(a * (1.0 - (double)transmission[3 * i + 1]));
        blue[i] = (SCALAR)(a * (1.0 - (double)transmission[3 * i + 2]));
        double r = (double)red[i];
        net[i] = (SCALAR)(r + (((double)green[i] - r) + ((double)blue[i] - r)) / 3.0);
    }
}

static void absorbance_stage(int n, const void *alpha_, double max_alpha, void *out_) {
    const SCALAR *alpha = alpha_;
    SCALAR *out = out_;
    for (int i = 0; i < n; i += LANES)
        store(out + i, absorbance(min(load_at_most(alpha + i, n - i), K(max_alpha))));
}

/* One by one, in double, by differences and quotients that nothing overflows. */
static void warp_extremes(int n, const SCALAR *depth, const moit_warp_map *map, SCALAR *out) {
    bool logarithmic = map->warp == MOIT_WARP_LOG;
    double unit =
        __builtin_fmax(-map->near, map->far) > 1e300 ? 0.25 : 1.0; /* differences stay finite */
    double near = logarithmic ? moit_log(map->near) : map->near * unit;
    double far = logarithmic ? moit_log(map->far) : map->far * unit;
    for (int i = 0; i < n; ++i) {
        double d = (double)depth[i], at = near;
        if (!logarithmic) at = d * unit;
        else if (d > 0.0) at = moit_log(d);
        double z = map->low + (map->high - map->low) * ((at - near) / (far - near));
        out[i] = (SCALAR)__builtin_fmin(__builtin_fmax(z, map->low), map->high);
    }
}

static void warp_stage(int n, const void *depth_, const moit_warp_map *map, void *out_) {
    const SCALAR *depth = depth_;
    SCALAR *out = out_;
    moit_warp_steps steps =
        moit_warp_steps_of(map, sizeof(SCALAR) == 8 ? MOIT_FLOAT64 : MOIT_FLOAT32);
    const real near = K(steps.near), low = K(steps.low), high = K(steps.high),
               scale = K(steps.scale), inverse = K(steps.inverse);
    switch (steps.kind) {
    case MOIT_STEPS_NONE:
        for (int i = 0; i < n; i += LANES) store(out + i, load_at_most(depth + i, n - i));
        return;
    case MOIT_STEPS_LEVEL:
        for (int i = 0; i < n; i += LANES) store(out + i, low);
        return;
    case MOIT_STEPS_LINEAR:
        for (int i = 0; i < n; i += LANES)
            store(out + i, linear_warp(load_at_most(depth + i, n - i), near, low, high, scale));
        return;
    case MOIT_STEPS_LOG:
        for (int i = 0; i < n; i += LANES)
            store(out + i,
                  log_warp(load_at_most(depth + i, n - i), near, inverse, low, high, scale));
        return;
    default: warp_extremes(n, depth, map, out);
    }
}

static void decay_stage(int n, const void *x_, void *out_) {
    const SCALAR *x = x_;
    SCALAR *out = out_;
    for (int i = 0; i < n; i += LANES)
        store_at_most(out + i, exponential(-load_at_most(x + i, n - i)), n - i);
}

/* The largest of three numbers of each of LANES fragments, of which `n` are there. */
FN real largest_of_three(const SCALAR *color, int n) {
#if defined(__GNUC__) && !defined(__clang__)
    if (n > LANES) { /* the last number has two behind it, which another fragment has */
        real of[3];
        truth lane;
        for (int k = 0; k < LANES; ++k) lane[k] = k;
        for (int k = 0; k < 3; ++k) { /* of each number and the two behind it */
            const SCALAR *c = color + k * LANES;
            of[k] = max(max(load(c), load(c + 1)), load(c + 2));
        }
        truth in_two = 3 * lane < 2 * LANES; /* of these, every third */
        real some = __builtin_shuffle(of[0], of[1], in_two & (3 * lane));
        return __builtin_shuffle(some, of[2], (in_two & lane) | (~in_two & (3 * lane - LANES)));
    }
#endif
    real largest = K(0.0);
    for (int k = 0; k < LANES && k < n; ++k) {
        const SCALAR *c = color + 3 * k;
        SCALAR most = c[0] > c[1] ? c[0] : c[1];
        largest[k] = most > c[2] ? most : c[2];
    }
    return largest;
}

FN void weights_of_kind(int kind, int n, const SCALAR *depth, const SCALAR *alpha,
                        const SCALAR *emission, const SCALAR *color, double near, double far,
                        double depth_scale, SCALAR *out) {
    /* what a depth buffer with this near and far plane would hold (WBOIT eq. 10) */
    const real scale = K(near < far ? far / (far - near) : 0.0), nearest = K(near);
    for (int i = 0; i < n; i += LANES) {
        real bright = K(0.0);
        if (kind == WEIGHT_BLOG)
            bright = largest_of_three(color + 3 * i, n - i) * load_at_most(emission + i, n - i);
        real z = load_at_most(depth + i, n - i);
        real d = clamp(scale * (z - nearest) / z, K(0.0), K(1.0));
        store(out + i,
              blend_weight(kind, z * K(depth_scale), d, load_at_most(alpha + i, n - i), bright));
    }
}

static void blend_weights_stage(int kind, int n, const void *depth, const void *alpha,
                                const void *emission, const void *color, double near, double far,
                                double depth_scale, void *out) {
    switch (kind) { /* a constant kind lets the compiler drop the other formulas */
#define CASE(k) \
    case k: weights_of_kind(k, n, depth, alpha, emission, color, near, far, depth_scale, out); break
        CASE(WEIGHT_BLOG);
        CASE(WEIGHT_EQ7);
        CASE(WEIGHT_EQ8);
        CASE(WEIGHT_EQ9);
        CASE(WEIGHT_EQ10);
        CASE(WEIGHT_PHENOMENOLOGICAL);
#undef CASE
    }
}
