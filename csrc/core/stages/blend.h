/* Stages that sum up over the fragments of each pixel, in the order of arrival and in double. */

static void products_stage(int pixels, const int32_t *offsets, const void *alpha_, double *total) {
    const SCALAR *alpha = alpha_;
    for (int p = 0; p < pixels; ++p) {
        double through = 1.0;
        for (int i = offsets[p]; i < offsets[p + 1]; ++i) through *= 1.0 - (double)alpha[i];
        total[p] = through;
    }
}

static void weight_sums_stage(int pixels, const int32_t *offsets, const void *alpha_,
                              const void *weight_, double *sum) {
    const SCALAR *alpha = alpha_, *weight = weight_;
    for (int p = 0; p < pixels; ++p) {
        double s = 0.0;
        for (int i = offsets[p]; i < offsets[p + 1]; ++i)
            s += (double)alpha[i] * (weight ? (double)weight[i] : 1.0);
        sum[p] = s;
    }
}

static void spread_stage(int pixels, const int32_t *offsets, const double *factor,
                         const void *weight_, void *T_) {
    const SCALAR *weight = weight_;
    SCALAR *T = T_;
    for (int p = 0; p < pixels; ++p)
        for (int i = offsets[p]; i < offsets[p + 1]; ++i)
            T[i] = factor[p] == 0.0 ? (SCALAR)1.0
                                    : (SCALAR)(factor[p] * (weight ? (double)weight[i] : 1.0));
}

FN void blend_pixels(int pixels, const int32_t *offsets, const SCALAR *alpha,
                     const SCALAR *emission, const SCALAR *T, const SCALAR *color, double *sum) {
    for (int p = 0; p < pixels; ++p) {
        quad s = {0};
        for (int i = offsets[p]; i < offsets[p + 1]; ++i) {
            double covers = (double)alpha[i] * (double)T[i], emits = covers;
            if (emission != alpha) emits = (double)emission[i] * (double)T[i];
            quad w = {emits, emits, emits, covers}, c = {0, 0, 0, 1};
            if (color)
                c = (quad){(double)color[3 * i], (double)color[3 * i + 1], (double)color[3 * i + 2],
                           1.0};
            s += w * c;
        }
        memcpy(sum + 4 * p, &s, sizeof s);
    }
}

static void blend_stage(int pixels, const int32_t *offsets, const void *alpha, const void *emission,
                        const void *T, const void *color, double *sum) {
    if (emission == alpha) blend_pixels(pixels, offsets, alpha, alpha, T, color, sum);
    else blend_pixels(pixels, offsets, alpha, emission, T, color, sum);
}
