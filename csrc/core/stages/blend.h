/* Stages that sum up over the fragments of each pixel, in the order of arrival and in double.
 *
 * Products and sums of one number a fragment have a lane for each of four pixels, colours for each
 * channel: either way what is added first stays first. */

/* Products of 1 - alpha in `through`, and in `sum` sums of alpha, or of alpha times weight. */
FN void sum_pixels(int pixels, const int32_t *offsets, const SCALAR *alpha, const SCALAR *weight,
                   double *through, double *sum) {
#define OF_FOUR(four, most, equal) \
    do { \
        quad left = QUAD(1.0), s = {0}; \
        for (int i = 0; i < (most); i += 4) { \
            four_numbers a[4], w[4] = {{0}}; \
            rows_of_four(four, alpha, i, a); \
            if (sum && weight) rows_of_four(four, weight, i, w); \
            for (int j = 0; j < 4; ++j) { \
                if (i + j == (most)) break; \
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

#ifdef RULES /* double tables only */
/* -expm1(n log1p(-mean)) of 0 <= mean < 1, in lanes that ask: tables are looked up in one by one,
 * which is as fast as series of pairs in four lanes. */
FN real covered_by_layers(truth asks, real mean, real n) {
    real covered = K(0.0);
    for (int k = 0; k < LANES; ++k)
        if (asks[k]) covered[k] = -moit_expm1(n[k] * moit_log1p(-mean[k]));
    return covered;
}

/* The same of few whole layers, mean (1 + (1 - mean) (1 + ..)): sums of what is positive lose no
 * digits. */
enum { FEW_LAYERS = 16 };

FN real covered_by_few(real mean, real n) {
    real through = 1.0 - mean, shares = K(0.0);
    for (int k = 0; k < FEW_LAYERS; ++k) {
        truth more = n > K(k);
        BREAK_UNLESS(more);
        shares = select(more, 1.0 + through * shares, shares);
    }
    return mean * shares;
}

/* As moit_averaged_coverage says. */
FN real averaged_coverage(real sum, real n) {
    real mean = select(n > 0.0, sum / max(n, K(0x1p-1022)), K(0.0));
    real within_one = select(mean < 1.0, mean, K(0.0));
    real within_few = min(n, K(FEW_LAYERS));
    truth few = nearest_integer(within_few) == n;
    real covered = covered_by_few(within_one, select(few, n, K(0.0)));
    if (any_lane(~few)) covered = select(few, covered, covered_by_layers(~few, within_one, n));
    covered = select(mean < 1.0, covered, K(1.0));
    covered = select(BOTH(covered > sum, n >= 1.0), sum, covered);
    return select((sum < 0x1p-60) | BOTH(n == 1.0, sum < 1.0), sum, covered);
}

static void averaged_coverage_stage(int pixels, const double *sum, const double *n,
                                    double *covered) {
    for (int p = 0; p < pixels; p += LANES)
        store_at_most(
            covered + p,
            averaged_coverage(load_at_most(sum + p, pixels - p), load_at_most(n + p, pixels - p)),
            pixels - p);
}
#define AVERAGED_COVERAGE_STAGE averaged_coverage_stage
#else
#define AVERAGED_COVERAGE_STAGE NULL
#endif

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

/* What the spread gives, as T holds it. */
FN quad spread_of_four(quad factor, quad weight) {
    const quad most = QUAD(BY_PRECISION((double)__FLT_MAX__, __DBL_MAX__));
    quad share = factor * weight;
    share = quad_select(share < most, share, most);
    share = quad_select(factor == 0.0, QUAD(1.0), share);
    return quad_from(__builtin_convertvector(share, four_numbers));
}

/* Three numbers and a one. Reads a fourth unless they are the array's last. */
FN quad colour_and_one(const SCALAR *color, bool last) {
    const quad one = {0, 0, 0, 1};
    if (last) return (quad){(double)color[0], (double)color[1], (double)color[2], 1.0};
    return with_last(load_quad(color), one);
}

/* What is blended: T of each fragment, or what spreads a factor of each pixel, by weights or not,
 * or such that they sum to what all cover, or what fragments let through in the order of their
 * arrival or of their depth: then they are found here. `coloured`, `emits` and `from`, which are
 * constants wherever this is used, say what is there. */
enum { FROM_T, FROM_FACTOR, FROM_WEIGHT, FROM_COVERED, FROM_ARRIVAL, FROM_RANK };

typedef struct {
    int from;
    bool coloured, emits;
    const SCALAR *alpha, *emission, *T, *color, *weight;
    const double *factor;
    const int32_t *rank;
    double *total;
} blended;

/* alpha T of the group's fragments, a row of four for each; of an order by rank. */
typedef struct {
    quad own[COUNTS];
} held_weights;

FN void hold_passed(const blended *x, const four_pixels *four, const int most, held_weights *w) {
    quad left = QUAD(1.0);
    for (int i = (most - 1) & ~3; i >= 0; i -= 4) {
        four_numbers a[4];
        rows_of_four(four, x->alpha, i, a);
        for (int j = 3; j >= 0; --j) {
            if (i + j >= most) continue;
            quad own = quad_from(a[j]);
            w->own[i + j] = own * quad_from(__builtin_convertvector(left, four_numbers));
            left *= 1.0 - own;
        }
    }
    put_of_four(four, x->total, left);
}

FN void hold_ranked(const blended *x, const four_pixels *four, const int most, held_weights *w) {
    SCALAR ranked[4][COUNTS];
    quad left = QUAD(1.0);
    put_in_order(four, most, four->equal, x->alpha, x->rank, ranked);
    for (int i = 0; i < most; ++i) {
        quad own =
            quad_from((four_numbers){ranked[0][i], ranked[1][i], ranked[2][i], ranked[3][i]});
        w->own[i] = own * quad_from(__builtin_convertvector(left, four_numbers));
        left *= 1.0 - own;
    }
    put_of_four(four, x->total, left);
}

/* What a weight of 1 counts where `sum` is the pixel's, as weighted.c has it. */
FN quad share_of_sum(quad covered, quad sum) {
    const quad most = QUAD(__DBL_MAX__), one = QUAD(1.0);
    quad_truth any = sum > 0.0;
    quad share = covered / quad_select(any, sum, one);
    share = quad_select(share < most, share, most);
    return quad_select(any, share, quad_select(covered > 0.0, one, (quad){0}));
}

FN void hold_covered(const blended *x, const four_pixels *four, const int most, held_weights *w) {
    quad left = QUAD(1.0), sum = {0}, given[COUNTS];
    for (int i = 0; i < most; i += 4) {
        four_numbers a[4], weight[4];
        rows_of_four(four, x->alpha, i, a);
        rows_of_four(four, x->weight, i, weight);
        for (int j = 0; j < 4; ++j) {
            if (i + j == most) break;
            quad own = quad_from(a[j]);
            given[i + j] = quad_from(weight[j]);
            w->own[i + j] = own;
            left *= 1.0 - own;
            sum += own * given[i + j];
        }
    }
    put_of_four(four, x->total, left);
    quad factor = share_of_sum(1.0 - left, sum);
    for (int i = 0; i < most; ++i) w->own[i] *= spread_of_four(factor, given[i]);
}

FN void hold_spread(const blended *x, const four_pixels *four, const int most, held_weights *w) {
    quad factor = QUAD(1.0), T = factor;
    if (x->from != FROM_T) factor = of_four(four, x->factor);
    if (x->from == FROM_FACTOR) T = spread_of_four(factor, T);
    for (int i = 0; i < most; i += 4) {
        four_numbers a[4], given[4];
        rows_of_four(four, x->alpha, i, a);
        if (x->from == FROM_T) rows_of_four(four, x->T, i, given);
        if (x->from == FROM_WEIGHT) rows_of_four(four, x->weight, i, given);
        for (int j = 0; j < 4; ++j) {
            if (i + j == most) break;
            if (x->from == FROM_T) T = quad_from(given[j]);
            if (x->from == FROM_WEIGHT) T = spread_of_four(factor, quad_from(given[j]));
            w->own[i + j] = quad_from(a[j]) * T;
        }
    }
}

/* A weight is loaded into all lanes: cheaper than moving it between them. */
FN quad weighted_colour(const blended *x, const double *w, const SCALAR *color, const int32_t *rank,
                        int k) {
    return four_of(w[4 * (x->from == FROM_RANK ? rank[k] : k)])
           * colour_and_one(color + 3 * k, false);
}

FN void blend_four(const blended *x, const four_pixels *four, const int most, const bool equal,
                   int end, double *sum) {
    held_weights w;
    quad s[4] = {{0}};
    const SCALAR *color[4];
    const int32_t *rank[4];
    bool together = equal;
    for (int lane = 0; lane < 4; ++lane) {
        color[lane] = x->color + 3 * four->start[lane];
        rank[lane] = x->from == FROM_RANK ? x->rank + four->start[lane] : NULL;
    }
    if (!equal && x->from != FROM_RANK) /* colours of others count nothing */
        together = (four->start[0] + most < end) & (four->start[1] + most < end)
                   & (four->start[2] + most < end) & (four->start[3] + most < end);
    if (x->from == FROM_ARRIVAL) hold_passed(x, four, most, &w);
    else if (x->from == FROM_RANK) hold_ranked(x, four, most, &w);
    else if (x->from == FROM_COVERED) hold_covered(x, four, most, &w);
    else hold_spread(x, four, most, &w);
    __asm__("" : "+m"(w)); /* or the compiler moves them between lanes after all */
    const double *own = (const double *)w.own;
    if (together) { /* one's sums need not wait for another's */
        for (int k = 0; k < most; ++k)
            for (int lane = 0; lane < 4; ++lane)
                s[lane] += weighted_colour(x, own + lane, color[lane], rank[lane], k);
    } else {
        for (int lane = 0; lane < 4; ++lane)
            for (int k = 0; k < four->count[lane]; ++k)
                s[lane] += weighted_colour(x, own + lane, color[lane], rank[lane], k);
    }
    for (int lane = 0; lane < four->there; ++lane)
        memcpy(sum + 4 * four->pixel[lane], s + lane, sizeof *s);
}

/* One pixel of any number; last: its fragments are the arrays' last. Of T, or what is spread. */
FN void blend_pixel(const blended *x, int p, const int32_t *offsets, bool last, double *sum) {
    quad s = {0};
    int end = offsets[p + 1];
    for (int i = offsets[p]; i < end; ++i) {
        quad T;
        if (x->from == FROM_FACTOR || x->from == FROM_WEIGHT)
            T = spread_of_four(four_of(x->factor[p]),
                               x->from == FROM_WEIGHT ? quad_of(x->weight[i]) : QUAD(1.0));
        else T = quad_of(x->T[i]);
        quad own = quad_of(x->alpha[i]) * T, weight = own, colour = {0, 0, 0, 1};
        if (x->emits) weight = with_last(quad_of(x->emission[i]) * T, own);
        if (x->coloured) colour = colour_and_one(x->color + 3 * i, last && i + 1 == end);
        s += weight * colour;
    }
    memcpy(sum + 4 * p, &s, sizeof s);
}

/* T of one pixel's fragments whose weights sum to what all cover, and its total. */
FN void spread_in_pixel(const blended *x, int p, const int32_t *offsets, SCALAR *T) {
    double left = 1.0, sum = 0.0;
    for (int i = offsets[p]; i < offsets[p + 1]; ++i) {
        double own = (double)x->alpha[i];
        left *= 1.0 - own;
        sum += own * (double)x->weight[i];
    }
    x->total[p] = left;
    quad factor = share_of_sum(four_of(1.0 - left), four_of(sum));
    for (int i = offsets[p]; i < offsets[p + 1]; ++i)
        T[i] = (SCALAR)spread_of_four(factor, quad_of(x->weight[i]))[0];
}

/* Colours come from memory, and are most of what does: those of the next tile, which lie behind
 * this one's, are asked for while this one's are blended. */
typedef struct {
    const char *next;
} fetched;

FN void fetch_ahead(fetched *f, int fragments) {
    const char *end = f->next + 3 * sizeof(SCALAR) * (size_t)fragments;
    for (; f->next < end; f->next += 64) __builtin_prefetch(f->next, 0, 2);
}

FN void blend_few(const blended x_, int pixels, const int32_t *offsets, SCALAR *T, int32_t *order,
                  double *sum) {
    const blended *x = &x_;
    fetched ahead = {(const char *)(x->color + 3 * offsets[pixels])};
#define OF_FOUR(four, most, equal) \
    do { \
        fetch_ahead(&ahead, 4 * (most)); \
        blend_four(x, four, most, equal, offsets[pixels], sum); \
    } while (0)
#define OF_ONE(p) \
    do { \
        if (x->from == FROM_ARRIVAL) x->total[p] = passed_in_arrival(p, offsets, x->alpha, T); \
        if (x->from == FROM_COVERED) spread_in_pixel(x, p, offsets, T); \
        if (x->from == FROM_RANK) \
            x->total[p] = passed_in_order(p, offsets, x->alpha, x->rank, order, T); \
        blend_pixel(x, p, offsets, offsets[(p) + 1] == offsets[pixels], sum); \
    } while (0)
    EACH_OF_EQUAL_COUNTS(pixels, offsets, OF_FOUR, OF_ONE);
#undef OF_FOUR
#undef OF_ONE
}

FN void blend_pixels(const blended x, int pixels, const int32_t *offsets, double *sum) {
    for (int p = 0; p < pixels; ++p)
        blend_pixel(&x, p, offsets, offsets[p + 1] == offsets[pixels], sum);
}

/* What is found here: T and `order` are scratch. */
static void covered_blend_stage(int pixels, const int32_t *offsets, const void *alpha,
                                const void *weight, const void *color, void *T, double *total,
                                double *sum) {
    blend_few((blended){FROM_COVERED, true, false, .alpha = alpha, .T = T, .color = color,
                        .weight = weight, .total = total},
              pixels, offsets, T, NULL, sum);
}

static void arrival_blend_stage(int pixels, const int32_t *offsets, const void *alpha,
                                const void *color, void *T, double *total, double *sum) {
    blend_few((blended){FROM_ARRIVAL, true, false, .alpha = alpha, .T = T, .color = color,
                        .total = total},
              pixels, offsets, T, NULL, sum);
}

static void ranked_blend_stage(int pixels, const int32_t *offsets, const void *alpha,
                               const void *color, const int32_t *rank, int32_t *order, void *T,
                               double *total, double *sum) {
    blend_few((blended){FROM_RANK, true, false, .alpha = alpha, .T = T, .color = color,
                        .rank = rank, .total = total},
              pixels, offsets, T, order, sum);
}

#define BLENDED(coloured, emits) \
    (blended) { .from = from, coloured, emits, alpha, emission, T, color, weight, factor }
FN void blend_by(const int from, int pixels, const int32_t *offsets, const SCALAR *alpha,
                 const SCALAR *emission, const SCALAR *T, const SCALAR *weight,
                 const double *factor, const SCALAR *color, double *sum) {
    const bool emits = emission != alpha;
    if (color && !emits) blend_few(BLENDED(true, false), pixels, offsets, NULL, NULL, sum);
    else blend_pixels(BLENDED(color != NULL, emits), pixels, offsets, sum);
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
