/* Stages that look at numbers from outside: lanes are neighbours in an array. What is wrong is
 * found one by one (check.c); these say that nothing is. */

FN truth inside(real x, real low, real high) { return (x >= low) & (x <= high); }

static bool all_within_stage(int64_t n, const void *x_, double low_, double high_) {
    const SCALAR *x = x_;
    const real low = K(low_), high = K(high_);
    truth good = EVERYWHERE;
    for (int64_t i = 0; i < n; i += LANES)
        good &= inside(n - i < LANES ? load_some(x + i, (int)(n - i)) : load(x + i), low, high);
    return !any_lane(~good);
}

/* As fmin and fmax of what is held and one more, whose loop GCC 12 cannot compile for aarch64. */
FN double least_of(double held, double more) { return more < held ? more : held; }
FN double greatest_of(double held, double more) { return more > held ? more : held; }

static bool depths_within_stage(int64_t n, const void *x_, const void *alpha_, double low_,
                                double high_, moit_depth_ends *ends) {
    const SCALAR *x = x_, *alpha = alpha_;
    const real low = K(low_), high = K(high_), infinite = K(__builtin_inf());
    const real greatest = K(BY_PRECISION((double)__FLT_MAX__, __DBL_MAX__));
    real near = infinite, far = -infinite, clear_near = near, clear_far = far;
    truth good = EVERYWHERE;
    for (int64_t i = 0; i < n; i += LANES) {
        int some = n - i < LANES ? (int)(n - i) : LANES;
        real d = load_at_most(x + i, some);
        truth opaque = load_at_most(alpha + i, some) == 1.0;
        good &= inside(d, low, high) | (opaque & inside(d, -greatest, greatest));
        near = min(near, d);
        far = max(far, d);
        clear_near = min(clear_near, select(opaque, infinite, d));
        clear_far = max(clear_far, select(opaque, -infinite, d));
    }
    for (int k = 0; k < LANES; ++k) {
        ends->near = least_of(ends->near, (double)near[k]);
        ends->far = greatest_of(ends->far, (double)far[k]);
        ends->clear_near = least_of(ends->clear_near, (double)clear_near[k]);
        ends->clear_far = greatest_of(ends->clear_far, (double)clear_far[k]);
    }
    return !any_lane(~good);
}

static bool none_nearer_stage(int64_t n, const void *back_, const void *depth_) {
    const SCALAR *back = back_, *depth = depth_;
    truth good = EVERYWHERE;
    for (int64_t i = 0; i < n; i += LANES) {
        int some = n - i < LANES ? (int)(n - i) : LANES;
        good &= load_at_most(back + i, some) >= load_at_most(depth + i, some);
    }
    return !any_lane(~good);
}
