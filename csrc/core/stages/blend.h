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
    /* beyond, what weighs next to nothing beside what weighs nothing would be infinite */
    const double most = BY_PRECISION((double)__FLT_MAX__, __DBL_MAX__);
    SCALAR *T = T_;
    for (int p = 0; p < pixels; ++p)
        for (int i = offsets[p]; i < offsets[p + 1]; ++i) {
            double share = factor[p] * (weight ? (double)weight[i] : 1.0);
            T[i] = factor[p] == 0.0 ? (SCALAR)1.0 : (SCALAR)(share < most ? share : most);
        }
}

/* Four times a number. */
FN quad quad_of(SCALAR x) { return quad_from((four_numbers){x, x, x, x}); }

/* x but for the last of four, which is that of y. */
FN quad with_last(quad x, quad y) {
    const quad_truth last = {0, 0, 0, -1};
    return (quad)(((quad_truth)x & ~last) | ((quad_truth)y & last));
}

/* Three numbers and a one. Reads a fourth unless they are the array's last. */
FN quad colour_and_one(const SCALAR *color, bool last) {
    const quad one = {0, 0, 0, 1};
    if (last) return (quad){(double)color[0], (double)color[1], (double)color[2], 1.0};
    return with_last(load_quad(color), one);
}

FN void blend_pixels(int pixels, const int32_t *offsets, const SCALAR *alpha,
                     const SCALAR *emission, const SCALAR *T, const SCALAR *color, double *sum) {
    const int end = offsets[pixels];
    for (int p = 0; p < pixels; ++p) {
        quad s = {0};
        for (int i = offsets[p]; i < offsets[p + 1]; ++i) {
            quad through = quad_of(T[i]), w = quad_of(alpha[i]) * through, c = {0, 0, 0, 1};
            if (emission != alpha) w = with_last(quad_of(emission[i]) * through, w);
            if (color) c = colour_and_one(color + 3 * i, i + 1 == end);
            s += w * c;
        }
        memcpy(sum + 4 * p, &s, sizeof s);
    }
}

/* The same where there are few fragments a pixel: processors guess the end of a loop over few
 * wrong, so the first ones are added whether they are there or not, then as 0. */
enum { FIRST_ONES = 8 };

FN void blend_few(int pixels, const int32_t *offsets, const SCALAR *alpha, const SCALAR *T,
                  const SCALAR *color, double *sum) {
    const int end = offsets[pixels];
    int p = 0;
    for (; p < pixels && offsets[p] + FIRST_ONES < end; ++p) {
        int i = offsets[p], n = offsets[p + 1] - i;
        const quad_truth count = (quad_truth){0} + n;
        quad s = {0};
        for (int k = 0; k < FIRST_ONES; k += 4) {
            quad w = load_quad(alpha + i + k) * load_quad(T + i + k);
            for (int j = k; j < k + 4; ++j) {
                double own = w[j - k];
                quad product =
                    (quad){own, own, own, own} * colour_and_one(color + 3 * (i + j), false);
                s += (quad)((quad_truth)product & (count > (quad_truth){j, j, j, j}));
            }
        }
        for (int j = FIRST_ONES; j < n; ++j)
            s += quad_of(alpha[i + j]) * quad_of(T[i + j])
                 * colour_and_one(color + 3 * (i + j), i + j + 1 == end);
        memcpy(sum + 4 * p, &s, sizeof s);
    }
    blend_pixels(pixels - p, offsets + p, alpha, alpha, T, color, sum + 4 * p);
}

static void blend_stage(int pixels, const int32_t *offsets, const void *alpha, const void *emission,
                        const void *T, const void *color, double *sum) {
    if (emission != alpha) blend_pixels(pixels, offsets, alpha, emission, T, color, sum);
    else if (color && offsets[pixels] < FIRST_ONES * pixels)
        blend_few(pixels, offsets, alpha, T, color, sum);
    else blend_pixels(pixels, offsets, alpha, alpha, T, color, sum);
}

FN quad quad_select(quad_truth t, quad a, quad b) {
    return (quad)((t & (quad_truth)a) | (~t & (quad_truth)b));
}

FN void over_pixels(int pixels, const int32_t *place, const double *total, const double *sums,
                    const int scaling, const double *background, const bool per_pixel,
                    SCALAR *out) {
    const quad one = QUAD(1.0), colour = {background[0], background[1], background[2], 0.0};
    for (int p = 0; p < pixels; ++p) {
        int64_t pixel = place ? place[p] : p;
        const double *b = background + 3 * pixel;
        quad behind = per_pixel ? (quad){b[0], b[1], b[2], 0.0} : colour, sum = {0}, T = one;
        if (sums) {
            memcpy(&sum, sums + 4 * p, sizeof sum);
            T = QUAD(total[p]);
        }
        quad weight = QUAD(sum[3]), scale = one;
        if (scaling == SCALE_ALL) { /* what covers nothing may emit all the same */
            quad_truth covers = weight > 0.0;
            scale = quad_select(covers, one - T, one) / quad_select(covers, weight, one);
        }
        if (scaling == SCALE_EXCESS) {
            quad_truth exceeds = weight - (one - T) > 0x1p-15;
            scale = quad_select(exceeds, one - T, one) / quad_select(exceeds, weight, one);
        }
        four_numbers x =
            __builtin_convertvector(with_last(T * behind + scale * sum, one - T), four_numbers);
        memcpy(out + 4 * pixel, &x, sizeof x);
    }
}

static void over_stage(int pixels, const int32_t *place, const double *total, const double *sums,
                       int scaling, const double *background, bool per_pixel, void *out) {
#define CASE(name, n, b) \
    if (scaling == (n) && per_pixel == (b)) \
    over_pixels(pixels, place, total, name, n, background, b, out)
    if (!sums) {
        CASE(NULL, SCALE_NOT, false);
        CASE(NULL, SCALE_NOT, true);
        return;
    }
    CASE(sums, SCALE_NOT, false);
    CASE(sums, SCALE_NOT, true);
    CASE(sums, SCALE_ALL, false);
    CASE(sums, SCALE_ALL, true);
    CASE(sums, SCALE_EXCESS, false);
    CASE(sums, SCALE_EXCESS, true);
#undef CASE
}
