/* Stages that sum up over the fragments of each pixel, in the order of arrival and in double.
 *
 * Products and sums of one number a fragment have a lane for each of four pixels, colours for each
 * channel: either way what is added first stays first. */

/* Products of 1 - alpha in `through`, and in `sum` sums of alpha, or of alpha times weight. */
FN void sum_pixels(int pixels, const int32_t *offsets, const SCALAR *alpha, const SCALAR *weight,
                   double *through, double *sum) {
#define OF_FOUR(four) \
    do { \
        quad left = QUAD(1.0), s = {0}; \
        for (int i = 0; i < (four)->count; i += 4) { \
            four_numbers a[4], w[4] = {{0}}; \
            rows_of_four(four, alpha, i, a); \
            if (sum && weight) rows_of_four(four, weight, i, w); \
            for (int j = 0; j < 4; ++j) { \
                if (i + j == (four)->count) break; \
                quad own = quad_from(a[j]); \
                if (through) left *= 1.0 - own; \
                if (sum) s += weight ? own * quad_from(w[j]) : own; \
            } \
        } \
        if (through) put_of_four(four, through, left); \
        if (sum) put_of_four(four, sum, s); \
    } while (0)
#define OF_ONE(p) \
    do { \
        double left = 1.0, s = 0.0; \
        for (int i = offsets[p]; i < offsets[(p) + 1]; ++i) { \
            double own = (double)alpha[i]; \
            if (through) left *= 1.0 - own; \
            if (sum) s += weight ? own * (double)weight[i] : own; \
        } \
        if (through) through[p] = left; \
        if (sum) sum[p] = s; \
    } while (0)
    EACH_OF_EQUAL_COUNTS(pixels, offsets, OF_FOUR, OF_ONE);
#undef OF_FOUR
#undef OF_ONE
}

static void products_stage(int pixels, const int32_t *offsets, const void *alpha, double *total) {
    sum_pixels(pixels, offsets, alpha, NULL, total, NULL);
}

static void weight_sums_stage(int pixels, const int32_t *offsets, const void *alpha,
                              const void *weight, double *sum) {
    if (weight) sum_pixels(pixels, offsets, alpha, weight, NULL, sum);
    else sum_pixels(pixels, offsets, alpha, NULL, NULL, sum);
}

static void products_and_sums_stage(int pixels, const int32_t *offsets, const void *alpha,
                                    const void *weight, double *total, double *sum) {
    if (weight) sum_pixels(pixels, offsets, alpha, weight, total, sum);
    else sum_pixels(pixels, offsets, alpha, NULL, total, sum);
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

/* What the spread gives four fragments of a pixel, as T holds it. */
FN quad spread_of_four(double factor, quad weight) {
    const quad most = QUAD(BY_PRECISION((double)__FLT_MAX__, __DBL_MAX__));
    quad share = four_of(factor) * weight;
    share = quad_select(share < most, share, most);
    if (factor == 0.0) share = QUAD(1.0);
    return quad_from(__builtin_convertvector(share, four_numbers));
}

/* Three numbers and a one. Reads a fourth unless they are the array's last. */
FN quad colour_and_one(const SCALAR *color, bool last) {
    const quad one = {0, 0, 0, 1};
    if (last) return (quad){(double)color[0], (double)color[1], (double)color[2], 1.0};
    return with_last(load_quad(color), one);
}

/* What is blended: T of each fragment, or what spreads a factor of each pixel, by weights or not.
 * `coloured`, `emits` and `from`, which are constants wherever this is used, say what is there. */
enum { FROM_T, FROM_FACTOR, FROM_WEIGHT };

typedef struct {
    int from;
    bool coloured, emits;
    const SCALAR *alpha, *emission, *T, *color, *weight;
    const double *factor;
} blended;

/* alpha T of four fragments from `i` on; emitted: emission T. */
FN quad weights_of_four(const blended *x, int p, int i, quad *emitted) {
    quad T;
    if (x->from == FROM_T) T = load_quad(x->T + i);
    else
        T = spread_of_four(x->factor[p],
                           x->from == FROM_WEIGHT ? load_quad(x->weight + i) : QUAD(1.0));
    if (x->emits) *emitted = load_quad(x->emission + i) * T;
    return load_quad(x->alpha + i) * T;
}

/* alpha T of n fragments from `i` on, up to three more, in memory: loading a number into all lanes
 * is cheaper there than moving it between them. */
typedef struct {
    double own[COUNTS];
} held_weights;

FN void hold_weights(const blended *x, int p, int i, const int n, held_weights *w) {
    for (int k = 0; k < n; k += 4) {
        quad emitted, own = weights_of_four(x, p, i + k, &emitted);
        memcpy(w->own + k, &own, sizeof own);
    }
    __asm__("" : "+m"(*w)); /* or the compiler moves them between lanes after all */
}

FN quad with_emission(const blended *x, quad own, quad emitted) {
    return x->emits ? with_last(emitted, own) : own;
}

FN quad colour_of(const blended *x, int i, bool last) {
    return x->coloured ? colour_and_one(x->color + 3 * i, last) : (quad){0, 0, 0, 1};
}

FN quad held_added(const blended *x, const held_weights *w, int i, int k) {
    return four_of(w->own[k]) * colour_of(x, i + k, false);
}

/* One pixel of any number; last: its fragments are the arrays' last. */
FN void blend_pixel(const blended *x, int p, const int32_t *offsets, bool last, double *sum) {
    quad s = {0};
    int end = offsets[p + 1];
    for (int i = offsets[p]; i < end; ++i) {
        quad T;
        if (x->from == FROM_T) T = quad_of(x->T[i]);
        else
            T = spread_of_four(x->factor[p],
                               x->from == FROM_WEIGHT ? quad_of(x->weight[i]) : QUAD(1.0));
        quad own = quad_of(x->alpha[i]) * T, emitted = own;
        if (x->emits) emitted = quad_of(x->emission[i]) * T;
        s += with_emission(x, own, emitted) * colour_of(x, i, last && i + 1 == end);
    }
    memcpy(sum + 4 * p, &s, sizeof s);
}

/* Two pixels of n fragments each, that vectors of four may read beyond: one's sums need not wait
 * for the other's. */
FN void blend_two_pixels(const blended *x, const int n, int p, int q, const int32_t *offsets,
                         double *sum) {
    held_weights w, v;
    quad s = {0}, t = {0};
    int i = offsets[p], j = offsets[q];
    hold_weights(x, p, i, n, &w);
    hold_weights(x, q, j, n, &v);
    for (int k = 0; k < n; ++k) {
        s += held_added(x, &w, i, k);
        t += held_added(x, &v, j, k);
    }
    memcpy(sum + 4 * p, &s, sizeof s);
    memcpy(sum + 4 * q, &t, sizeof t);
}

/* Processors guess the end of a loop over few fragments wrong, so the first ones of a pixel are
 * added whether they are there or not, then with no weight. */
enum { FIRST_ONES = 8 };

FN void blend_few(const blended *x, int p, const int32_t *offsets, double *sum) {
    held_weights w;
    int i = offsets[p], n = offsets[p + 1] - i;
    const quad_truth count = (quad_truth){0} + n, place = {0, 1, 2, 3};
    quad s = {0}, emitted;
    for (int k = 0; k < FIRST_ONES; k += 4) {
        quad own = weights_of_four(x, p, i + k, &emitted);
        own = (quad)((quad_truth)own & (place + k < count));
        memcpy(w.own + k, &own, sizeof own);
    }
    __asm__("" : "+m"(w));
    for (int k = 0; k < FIRST_ONES; ++k) s += held_added(x, &w, i, k);
    for (int k = FIRST_ONES; k < n; k += 4) {
        int some = n - k < 4 ? n - k : 4;
        quad own = weights_of_four(x, p, i + k, &emitted);
        memcpy(w.own, &own, sizeof own);
        __asm__("" : "+m"(w));
        for (int l = 0; l < some; ++l) s += four_of(w.own[l]) * colour_of(x, i + k + l, false);
    }
    memcpy(sum + 4 * p, &s, sizeof s);
}

/* How many fragments all pixels from `first` to before `end` have; -1: not the same. */
FN int equal_count(int first, int end, const int32_t *offsets) {
    int n = offsets[first + 1] - offsets[first], differ = 0;
    for (int p = first; p < end; ++p) differ |= (offsets[p + 1] - offsets[p]) ^ n;
    return differ ? -1 : n;
}

/* In order of memory: colours are read for the first time here, and are most of what is read. */
FN void blend_plain(const blended x_, int pixels, const int32_t *offsets, double *sum) {
    const blended *x = &x_;
    int within = pixels, p = 0, end = offsets[pixels];
    while (within > 0 && offsets[within] + FIRST_ONES >= end) --within;
    int n = within > 1 ? equal_count(0, within, offsets) : -1;
    if (n == 1)
        for (; p + 2 <= within; p += 2) blend_two_pixels(x, 1, p, p + 1, offsets, sum);
    else if (n > 1 && n < COUNTS)
        for (; p + 2 <= within; p += 2) blend_two_pixels(x, n, p, p + 1, offsets, sum);
    else if (end < 16 * pixels)
        for (; p < within; ++p) blend_few(x, p, offsets, sum);
    for (; p < pixels; ++p) blend_pixel(x, p, offsets, offsets[p + 1] == end, sum);
}

FN void blend_pixels(const blended x, int pixels, const int32_t *offsets, double *sum) {
    for (int p = 0; p < pixels; ++p)
        blend_pixel(&x, p, offsets, offsets[p + 1] == offsets[pixels], sum);
}

#define BLEND_PIXELS(coloured, emits) \
    blend_pixels((blended){from, coloured, emits, alpha, emission, T, color, weight, factor}, \
                 pixels, offsets, sum)
FN void blend_by(const int from, int pixels, const int32_t *offsets, const SCALAR *alpha,
                 const SCALAR *emission, const SCALAR *T, const SCALAR *weight,
                 const double *factor, const SCALAR *color, double *sum) {
    if (emission == alpha) {
        if (color)
            blend_plain((blended){from, true, false, alpha, emission, T, color, weight, factor},
                        pixels, offsets, sum);
        else BLEND_PIXELS(false, false);
    } else {
        if (color) BLEND_PIXELS(true, true);
        else BLEND_PIXELS(false, true);
    }
}

static void blend_stage(int pixels, const int32_t *offsets, const void *alpha, const void *emission,
                        const void *T, const void *color, double *sum) {
    blend_by(FROM_T, pixels, offsets, alpha, emission, T, NULL, NULL, color, sum);
}

static void spread_blend_stage(int pixels, const int32_t *offsets, const double *factor,
                               const void *weight, const void *alpha, const void *emission,
                               const void *color, double *sum) {
    if (weight)
        blend_by(FROM_WEIGHT, pixels, offsets, alpha, emission, NULL, weight, factor, color, sum);
    else blend_by(FROM_FACTOR, pixels, offsets, alpha, emission, NULL, NULL, factor, color, sum);
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
