/* Fragments that nobody sends on purpose, put to every technique and every question of the core:
 * what must hold of any. Made to run under sanitizers, for hours if one likes:
 *
 *     hostile [FIRST [COUNT]]
 *
 * tries COUNT cases from number FIRST on, names each that breaks a promise, and the one that ends the
 * process. tests/hostile.py does the same through Python, and asks mpmath. */
#include "hostile_derivatives.h"

enum { USUAL_COUNT = 5000 };

/* ---- What must not matter -------------------------------------------------------------------- */

/* Whether half floats, words or bytes round after every fragment. */
static bool rounds_each(const moit_technique *t) {
    switch (t->kind) {
    case MOIT_WEIGHTED_BLENDED: return t->weighted.bits == 16;
    case MOIT_POWER_MOMENTS:
    case MOIT_BOUNDED_NEURAL:
    case MOIT_TRIGONOMETRIC_MOMENTS: return t->moments.bits == 16 || t->moments.halves;
    case MOIT_FOURIER_OPACITY:
    case MOIT_FUNCTION_MAP:
    case MOIT_HAAR_WAVELETS: return t->series.bits == 16;
    default: return t->kind == MOIT_DEEP_FRAGMENTS || t->kind == MOIT_STRONG;
    }
}

static void swap_numbers(moit_precision precision, void *array, int64_t i, int64_t j, int width) {
    for (int k = 0; array && k < width; ++k) {
        double x = number(precision, array, width * i + k);
        set_number(precision, array, width * i + k, number(precision, array, width * j + k));
        set_number(precision, array, width * j + k, x);
    }
}

/* Of colours and background: what is covered is 1 less a product, and rounds as 1 does. */
static double brightest(const hostile_case *c) {
    double most = 1.0;
    for (int64_t i = 0; i < 3 * c->r.count; ++i)
        most = fmax(most, fabs(number(c->r.f.precision, c->r.color, i)));
    return most;
}

/* Which of several opaque surfaces at one depth is the background is their order: none is culled. */
static void arrival_changes_last_digits_only(hostile_case *c) {
    moit_precision precision = c->r.f.precision;
    moit_arrival arrival = moit_facts_of(c->technique.kind).arrival;
    if (precision != MOIT_FLOAT64 || arrival == MOIT_IN_ORDER || rounds_each(&c->technique)) return;
    if (arrival == MOIT_TIES_IN_ORDER && has_ties(c)) return;
    double *first = composite_of(c, &c->r.f, false);
    for (int64_t p = 0; p < c->r.f.pixels; ++p)
        for (int64_t i = c->r.offsets[p]; i < c->r.offsets[p + 1]; ++i) {
            int64_t j = c->r.offsets[p] + count_of(&c->random, (int)(i - c->r.offsets[p] + 1));
            swap_numbers(precision, c->r.depth, i, j, 1);
            swap_numbers(precision, c->r.alpha, i, j, 1);
            swap_numbers(precision, c->weights, i, j, 1);
            swap_numbers(precision, c->r.color, i, j, 3);
            swap_numbers(precision, c->transmission, i, j, 3);
        }
    double *other = composite_of(c, &c->r.f, false), most = brightest(c);
    /* what passes most may emit much more than it covers, and is scaled with that, last digits of
     * what is covered and all */
    double digits = c->transmission ? 1e-9 : 1e-12;
    for (int64_t k = 0; k < 4 * c->r.f.pixels; ++k)
        if (!(fabs(first[k] - other[k]) <= digits * (most + fabs(first[k])))) {
            broken(c, "order of arrival", other[k], first[k]);
            break;
        }
    free(first);
    free(other);
}

static void instructions_change_no_bit(const hostile_case *c) {
    size_t bytes = (size_t)(4 * c->r.f.pixels) * size_of(c->r.f.precision);
    void *first = composite_of(c, &c->r.f, c->cull_opaque);
    for (int isa = MOIT_ISA_BASE; isa < MOIT_ISA_COUNT; ++isa) {
        if (!moit_isa_supported((moit_isa)isa)) continue;
        moit_run run = {.threads = 1, .isa = (moit_isa)isa};
        void *image = numbers(c, 4 * c->r.f.pixels);
        expect_ok(
            c, "composite",
            moit_composite(&c->r.f, &c->technique, c->cull_opaque, behind, false, image, &run));
        if (memcmp(first, image, bytes)) broken(c, "an instruction set", isa, moit_isa_best());
        free(image);
    }
    free(first);
}

/* Numbers changed after they were checked. */
static void change_numbers(hostile_case *c) {
    const double others[] = {NOT_A_NUMBER, INFINITE, -INFINITE, 1e300, -1e300, 0.0, -1.0, 3e38};
    void *const arrays[] = {c->r.depth, c->r.alpha, c->r.color};
    for (int times = 1 + count_of(&c->random, 3); times > 0; --times) {
        int which = count_of(&c->random, 3), every = one_in(&c->random, 2) ? 1 : 4;
        double x = others[count_of(&c->random, 8)];
        if (c->r.f.precision == MOIT_FLOAT32 && isfinite(x)) x = fmax(fmin(x, 3e38), -3e38);
        for (int64_t i = 0; i < c->r.count; i += every)
            set_number(c->r.f.precision, arrays[which], which == 2 ? 3 * i : i, x);
    }
}

/* ---- Two precisions -------------------------------------------------------------------------- */

static void *as_doubles(const void *array, int64_t count) {
    double *wide = answer_room(count, sizeof *wide);
    for (int64_t i = 0; i < count; ++i) wide[i] = number(MOIT_FLOAT32, array, i);
    return wide;
}

/* Techniques that keep no state between which two precisions choose differently. Weights that are
 * given may make shares that single precision does not hold. */
static bool is_plain(const moit_technique *t) {
    switch (t->kind) {
    case MOIT_WEIGHTED_BLENDED:
        return t->weighted.bits == 32 && t->weighted.weight != MOIT_WEIGHT_GIVEN;
    case MOIT_SORTED:
    case MOIT_ALPHA_BLEND:
    case MOIT_WEIGHTED_SUM:
    case MOIT_WEIGHTED_AVERAGE:
    case MOIT_DEPTH_PEELING:
    case MOIT_KBUFFER:
    case MOIT_HYBRID:
    case MOIT_STOCHASTIC:
    case MOIT_HASHED_ALPHA: return true;
    default: return false;
    }
}

static void double_shows_what_single_does(const hostile_case *c) {
    if (c->r.f.precision != MOIT_FLOAT32 || !is_plain(&c->technique)) return;
    /* lots hang on net coverages, which are rounded */
    if (moit_facts_of(c->technique.kind).is_random && c->transmission) return;
    hostile_case wide = *c;
    int64_t n = c->r.count;
    wide.r.f.precision = MOIT_FLOAT64;
    wide.r.f.depth = wide.r.depth = as_doubles(c->r.depth, n);
    wide.r.f.alpha = wide.r.alpha = as_doubles(c->r.alpha, n);
    wide.r.f.color = wide.r.color = as_doubles(c->r.color, 3 * n);
    if (c->transmission)
        wide.r.f.transmission = wide.transmission = as_doubles(c->transmission, 3 * n);
    if (c->weights) wide.technique.weighted.weights = wide.weights = as_doubles(c->weights, n);
    wide.r.offsets = NULL; /* the arrays of another */
    float *single = composite_of(c, &c->r.f, c->cull_opaque);
    double *other = composite_of(&wide, &wide.r.f, c->cull_opaque), most = brightest(c);
    for (int64_t k = 0; k < 4 * c->r.f.pixels; ++k)
        if (!(fabs((double)single[k] - other[k]) <= 1e-4 * most + 1e-6 * fabs(other[k]))) {
            broken(c, "single precision", (double)single[k], other[k]);
            break;
        }
    free(single);
    free(other);
    free_case(&wide);
}

/* ---- Volumes --------------------------------------------------------------------------------- */

/* Pieces of volumes let through what the volumes do, and are what they must be. */
static void volumes_keep_their_total(hostile_case *c) {
    moit_fragments f = c->r.f;
    int64_t n = c->r.count;
    bool adds = one_in(&c->random, 2);
    c->back = numbers(c, n);
    c->emission = draw_shares(c, 0.25);
    for (int64_t i = 0; i < n; ++i) {
        double front = number(f.precision, c->r.depth, i), far = fmax(f.far, front);
        double share = ONE_OF(&c->random, 0.0, 1e-7, 0.3, 1.0);
        double end = fmin(fmax(front + share * (far / 2.0 - front / 2.0) * 2.0, front), far);
        set_number(f.precision, c->back, i, end);
        if (number(f.precision, c->back, i) < front) set_number(f.precision, c->back, i, front);
    }
    f.back = c->back;
    f.emission = adds ? c->emission : NULL;
    if (moit_check_fragments(&f, n).array == MOIT_BACK) return; /* opaque ones may lie anywhere */
    const double *cut = NULL;
    double cuts[2] = {f.near, f.near + (f.far / 2.0 - f.near / 2.0)};
    if (one_in(&c->random, 3) && cuts[0] < cuts[1]) cut = cuts;
    const moit_splitting how = {.tidy = one_in(&c->random, 2), .cuts = cut ? 2 : 0, .cut = cut};
    int64_t *offsets = answer_room(f.pixels + 1, sizeof *offsets);
    bool changes = false;
    moit_run run = plain_run();
    expect_ok(c, "piece offsets", moit_piece_offsets(&f, &how, offsets, &changes, &run));
    int64_t pieces = offsets[f.pixels];
    if (pieces < 0 || pieces > (2 + how.cuts) * n) broken(c, "pieces", (double)pieces, (double)n);
    const moit_pieces out = {
        .depth = numbers(c, pieces),
        .alpha = numbers(c, pieces),
        .color = numbers(c, 3 * pieces),
        .transmission = f.transmission ? numbers(c, 3 * pieces) : NULL,
        .back = numbers(c, pieces),
        .emission = adds ? numbers(c, 3 * pieces) : NULL,
        .first = answer_room(n, sizeof *out.first),
    };
    expect_ok(c, "split", moit_split_volumes(&f, &how, offsets, &out, &run));
    moit_fragments made = f;
    made.offsets = offsets;
    made.depth = out.depth;
    made.alpha = out.alpha;
    made.color = out.color;
    made.transmission = out.transmission;
    made.back = out.back;
    made.emission = out.emission;
    moit_fault fault = moit_check_fragments(&made, pieces);
    if (fault.array != MOIT_NO_ARRAY) broken(c, "a piece", fault.array, (double)fault.index);
    for (int64_t p = 0; p < f.pixels && !f.transmission; ++p) {
        long double whole = 1.0L, cut_up = 1.0L;
        for (int64_t i = c->r.offsets[p]; i < c->r.offsets[p + 1]; ++i)
            whole *= 1.0L - (long double)number(f.precision, c->r.alpha, i);
        for (int64_t i = offsets[p]; i < offsets[p + 1]; ++i)
            cut_up *= 1.0L - (long double)number(f.precision, out.alpha, i);
        double slack = 4.0 * epsilon(f.precision) * (double)(pieces + 1);
        if (!(fabsl(whole - cut_up) <= (long double)slack))
            broken(c, "total of pieces", (double)cut_up, (double)whole);
    }
    free(offsets);
    free(out.depth);
    free(out.alpha);
    free(out.color);
    free(out.transmission);
    free(out.back);
    free(out.emission);
    free(out.first);
}

/* ---- Runs ------------------------------------------------------------------------------------ */

static void try_case(uint64_t seed) {
    present = seed;
    unchecked = false;
    told = 0;
    hostile_case c = draw_case(seed);
    moit_fault fault = moit_check_fragments(&c.r.f, c.r.count);
    if (fault.array != MOIT_NO_ARRAY)
        broken(&c, "the case itself", fault.array, (double)fault.index);
    ask_everything(&c);
    ask_for_derivatives(&c);
    double_shows_what_single_does(&c);
    if (one_in(&c.random, 4)) volumes_keep_their_total(&c);
    if (one_in(&c.random, 8)) instructions_change_no_bit(&c);
    arrival_changes_last_digits_only(&c);
    if (one_in(&c.random, 4)) {
        unchecked = true;
        change_numbers(&c);
        ask_everything(&c);
        ask_for_derivatives(&c);
    }
    free_case(&c);
}

/* The sanitizers' own, where there are any: called before they end the process. */
void __sanitizer_set_death_callback(void (*callback)(void)) __attribute__((weak));

static void name_the_case(void) {
    fprintf(stderr, "case %llu ended the process\n", (unsigned long long)present);
}

int main(int count, char **words) {
    uint64_t first = count > 1 ? strtoull(words[1], NULL, 10) : 0;
    uint64_t cases = count > 2 ? strtoull(words[2], NULL, 10) : USUAL_COUNT;
    if (__sanitizer_set_death_callback) __sanitizer_set_death_callback(name_the_case);
    for (uint64_t i = 0; i < cases; ++i) try_case(first + i);
    return verdict();
}
