/* Volumes of deep images: where they overlap, as samples that do not.
 *
 * A volume fills [depth, back) with a medium of constant density: of opacity alpha it hides
 * 1 - (1 - alpha)^x up to the share x of its depth, and emits its colour evenly. Kainz,
 * Interpreting OpenEXR Deep Pixels; Hillman, The Theory of OpenEXR Deep Samples. What coincides
 * adds its absorbance u = -x log(1 - alpha), and of the light p that each emits, its colour
 * multiplied by alpha, is seen
 *
 *     alpha = 1 - exp(-sum u),    p = (alpha / sum u) sum of p u / alpha,
 *
 * where u / alpha is 1 for alpha 0: light without opacity is dimmed by what it coincides with.
 * Surfaces that coincide mix alike. What is opaque hides what it coincides with; of several that
 * are, the mean is seen. With transmission all of this is so for each channel's own opacity.
 *
 * Where there are Gaussians depth is cut into panels, at their depths and where one of what fills
 * them, or all together, would change too much in one (panels.c), not where they begin and end.
 * What coincides in a panel is mixed by quadrature. What is hidden up to any depth is exact.
 *
 * The cost of a pixel of n fragments is that of sorting, n log n: the sums over what overlaps are
 * kept in a tree, in which a volume that begins or ends changes log n sums. Nothing is subtracted,
 * so that nothing is lost to rounding where a dense volume ends. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/elementary.h"
#include "core/offsets.h"
#include "core/panels.h"
#include "core/parts.h"
#include "core/threads.h"
#include "core/tile.h"

/* What happens at a depth, in this order: half open volumes end, surfaces come before what
 * begins with them (the document sorts by front, then back), volumes begin; a Gaussian has its
 * middle, at which it is asked. */
enum { END, POINT, START, MIDDLE, CUT };

enum { MOST_EVENTS = 3 }; /* of a fragment */

typedef struct {
    double depth;
    int64_t fragment;
    int kind;
} event;

/* What is summed of fragments. Of an opacity there are two numbers: absorbance over length, and
 * how many are opaque, which do not count in the first. Of light in a channel there are two,
 * likewise: p u / alpha over length, and p of what is opaque there. */
typedef struct {
    int opacity[4]; /* where that of all is, and of each channel: the same without transmission */
    int color, emission; /* where they begin, three channels of two numbers; -1: none */
    int width;           /* numbers in all */
} layout;

enum { MOST_WIDTH = 20 };

typedef struct {
    const moit_fragments *f;
    const moit_splitting *how;
    layout sums;
    event *events;        /* MOST_EVENTS for each fragment of a pixel, and the cuts */
    double *tree;         /* node k is the sum of 2k and 2k + 1; node 1 of all; leaves come last */
    size_t room;          /* numbers that there is room for in it */
    int64_t *place;       /* (fragments of a pixel) which leaf a volume is */
    moit_extent *extents; /* (fragments of a pixel) */
    int64_t first;        /* fragment of the pixel */
    bool gaussians;       /* some fragments of the pixel are; then: */
    moit_panels panels;   /* what fills the depth */
    int64_t leaves;       /* the pixel's volumes */
    int64_t active;       /* how many volumes fill the depth just passed */
    int64_t names;        /* the sum of their indices: the one there is, if it is one */
    bool mixes;           /* somewhere there are several */
    bool changes;         /* some pixel is not as it should be */
    double shrink;        /* of depths, lest differences overflow */
    double unit;          /* of light, lest sums overflow: a power of two */
} sweep;

static layout layout_of(const moit_fragments *f) {
    layout sums = {.color = -1, .emission = -1, .width = 2};
    for (int c = 1; f->transmission && c < 4; ++c, sums.width += 2) sums.opacity[c] = sums.width;
    if (f->color) {
        sums.color = sums.width;
        sums.width += 6;
    }
    if (f->emission) {
        sums.emission = sums.width;
        sums.width += 6;
    }
    return sums;
}

static int by_depth(const void *left, const void *right) {
    const event *a = left, *b = right;
    if (a->depth != b->depth) return a->depth < b->depth ? -1 : 1;
    if (a->kind != b->kind) return a->kind - b->kind;
    return (a->fragment > b->fragment) - (a->fragment < b->fragment);
}

/* Few events, as most pixels have, are sorted without calls. */
static void sort_events(event *events, int64_t count) {
    if (count > 32) {
        qsort(events, (size_t)count, sizeof *events, by_depth);
        return;
    }
    for (int64_t i = 1; i < count; ++i) {
        event one = events[i];
        int64_t at = i;
        for (; at > 0 && by_depth(&one, &events[at - 1]) < 0; --at) events[at] = events[at - 1];
        events[at] = one;
    }
}

/* ---- Numbers of fragments -------------------------------------------------------------------- */

static double number(const sweep *w, const void *array, int64_t i) {
    return moit_number(w->f->precision, array, i);
}

static double front_of(const sweep *w, int64_t i) { return w->extents[i - w->first].front; }

static double back_of(const sweep *w, int64_t i) { return w->extents[i - w->first].back; }

static bool is_gaussian(const sweep *w, int64_t i) { return w->extents[i - w->first].is_gaussian; }

static bool is_volume(const sweep *w, int64_t i) { return front_of(w, i) < back_of(w, i); }

static double opacity_of(const sweep *w, int64_t i, int k) { return moit_opacity_of(w->f, i, k); }

static double length_of(const sweep *w, double near, double far) {
    return far * w->shrink - near * w->shrink;
}

static void put(const sweep *w, void *array, int64_t i, double x) {
    moit_put_number(w->f->precision, array, i, x);
}

/* The least number of the precision that is not nearer: what is cut in front of a depth stays in
 * front of it. */
static void put_depth(const sweep *w, void *array, int64_t i, double depth) {
    if (w->f->precision == MOIT_FLOAT64) ((double *)array)[i] = depth;
    else {
        float held = (float)depth;
        ((float *)array)[i] = (double)held < depth ? nextafterf(held, HUGE_VAL) : held;
    }
}

/* The next number: who looks at depths alone sees a surface in front of what begins with it. */
static void put_behind(const sweep *w, void *array, int64_t i) {
    if (w->f->precision == MOIT_FLOAT64)
        ((double *)array)[i] = nextafter(((double *)array)[i], HUGE_VAL);
    else ((float *)array)[i] = nextafterf(((float *)array)[i], HUGE_VAL);
}

static void put_fragment(const sweep *w, int64_t i, const moit_pieces *out, int64_t at) {
    moit_copy_fragment(w->f, i, out, at);
}

static void note_first(const moit_pieces *out, int64_t i, int64_t at) {
    if (out && out->first) out->first[i] = at;
}

/* ---- Parts and mixtures ---------------------------------------------------------------------- */

/* One volume between two depths. */
static void put_part(const sweep *w, int64_t i, double near, double far, const moit_pieces *out,
                     int64_t at) {
    moit_put_part(w->f, i, moit_share_between(&w->extents[i - w->first], near, far), out, at);
    put_depth(w, out->depth, at, near);
    if (out->back) put_depth(w, out->back, at, far);
}

/* Twice of each channel what w->sums says: `scale` times the light of fragment i. */
static void put_light(const sweep *w, double *to, const void *light, int64_t i, double scale,
                      double length) {
    for (int c = 0; c < 3; ++c) {
        double own = opacity_of(w, i, c + 1);
        double p = number(w, light, 3 * i + c) / w->unit * scale;
        to[2 * c] = own == 1.0  ? 0.0
                    : own > 0.0 ? p * (-moit_log1p(-own) / own) / length
                                : p / length;
        to[2 * c + 1] = own == 1.0 ? p : 0.0;
    }
}

static void summand_of(const sweep *w, int64_t i, double length, double *to) {
    const layout *sums = &w->sums;
    if (length < 0x1p-900) length = 0x1p-900; /* quotients stay finite */
    for (int k = 0; k < (w->f->transmission ? 4 : 1); ++k) {
        double own = opacity_of(w, i, k);
        to[sums->opacity[k]] = own == 1.0 ? 0.0 : -moit_log1p(-own) / length;
        to[sums->opacity[k] + 1] = own == 1.0;
    }
    if (sums->color >= 0)
        put_light(w, to + sums->color, w->f->color, i, number(w, w->f->alpha, i), length);
    if (sums->emission >= 0) put_light(w, to + sums->emission, w->f->emission, i, 1.0, length);
}

typedef struct {
    double alpha;
    double opaque;  /* how many are */
    double visible; /* of light that is spread over the length */
} opacity;

static opacity opacity_in(const sweep *w, const double *sum, int k, double length) {
    double u = sum[w->sums.opacity[k]] * length, opaque = sum[w->sums.opacity[k] + 1];
    double alpha = opaque > 0.0 ? 1.0 : -moit_expm1(-u);
    return (opacity){alpha, opaque, u > 0.0 ? alpha / u : 1.0};
}

static double light_in(const sweep *w, const double *sum, const opacity *own, double length) {
    return w->unit * (own->opaque > 0.0 ? sum[1] / own->opaque : sum[0] * length * own->visible);
}

static void put_mixed(const sweep *w, const moit_mixture *mixed, double near, double far,
                      const moit_pieces *out, int64_t at) {
    double alpha = mixed->alpha;
    put_depth(w, out->depth, at, near);
    if (out->back) put_depth(w, out->back, at, far);
    put(w, out->alpha, at, alpha);
    for (int c = 0; c < 3; ++c) {
        if (out->transmission)
            put(w, out->transmission, 3 * at + c,
                alpha > 0.0 ? fmax(0.0, 1.0 - mixed->opacity[c] / alpha) : 0.0);
        if (out->color) put(w, out->color, 3 * at + c, alpha > 0.0 ? mixed->color[c] / alpha : 0.0);
        if (out->emission) put(w, out->emission, 3 * at + c, mixed->emission[c]);
    }
}

/* What sums over a length are, as one fragment. */
static void put_mixture(const sweep *w, const double *sum, double near, double far, double length,
                        const moit_pieces *out, int64_t at) {
    opacity net = opacity_in(w, sum, 0, length);
    moit_mixture mixed = {.alpha = net.alpha};
    for (int c = 0; c < 3; ++c) {
        opacity own = w->f->transmission ? opacity_in(w, sum, c + 1, length) : net;
        mixed.opacity[c] = own.alpha;
        if (out->color) mixed.color[c] = light_in(w, sum + w->sums.color + 2 * c, &own, length);
        if (out->emission)
            mixed.emission[c] = light_in(w, sum + w->sums.emission + 2 * c, &own, length);
    }
    put_mixed(w, &mixed, near, far, out, at);
}

/* ---- The volumes that fill a depth ----------------------------------------------------------- */

static bool clear_tree(sweep *w) {
    size_t numbers = (size_t)(2 * w->leaves * w->sums.width);
    if (numbers > w->room) {
        free(w->tree);
        w->room = numbers;
        w->tree = malloc(numbers * sizeof *w->tree);
        if (!w->tree) return false;
    }
    memset(w->tree, 0, numbers * sizeof *w->tree);
    return true;
}

/* Puts the fragment's numbers into its leaf, or 0 where it ends, and sums up to the root. */
static void change_leaf(sweep *w, int64_t leaf, int64_t i, bool begins) {
    int width = w->sums.width;
    int64_t node = w->leaves + leaf;
    double *to = w->tree + node * width;
    if (begins) summand_of(w, i, length_of(w, front_of(w, i), back_of(w, i)), to);
    else memset(to, 0, (size_t)width * sizeof *to);
    for (node /= 2; node > 0; node /= 2) {
        const double *below = w->tree + 2 * node * width;
        double *sum = w->tree + node * width;
        for (int k = 0; k < width; ++k) sum[k] = below[k] + below[k + width];
    }
}

static void change_active(sweep *w, int64_t i, bool begins) {
    if (w->gaussians && begins) moit_panels_begin(&w->panels, i, &w->extents[i - w->first]);
    else if (w->gaussians) moit_panels_end(&w->panels, i);
    else if (w->mixes) change_leaf(w, w->place[i - w->first], i, begins);
    w->active += begins ? 1 : -1;
    w->names += begins ? i : -i;
}

/* All that fills what lies between two depths, as one piece. A fragment that nothing cuts or
 * overlaps stays as it is, bit for bit. */
static void put_piece(sweep *w, double near, double far, const moit_pieces *out, int64_t at) {
    int64_t i = w->names;
    if (w->active > 1 && w->gaussians) {
        moit_mixture mixed = moit_mix_panel(&w->panels, near, far);
        put_mixed(w, &mixed, near, far, out, at);
    } else if (w->active > 1)
        put_mixture(w, w->tree + w->sums.width, near, far, length_of(w, near, far), out, at);
    else if (near == front_of(w, i) && far == back_of(w, i) && !is_gaussian(w, i))
        put_fragment(w, i, out, at);
    else put_part(w, i, fmax(near, front_of(w, i)), fmin(far, back_of(w, i)), out, at);
}

/* Surfaces at one depth: events e to end. */
static void put_coincident(const sweep *w, int64_t e, int64_t end, const moit_pieces *out,
                           int64_t at) {
    if (end == e + 1) {
        note_first(out, w->events[e].fragment, at);
        put_fragment(w, w->events[e].fragment, out, at);
        return;
    }
    int width = w->sums.width;
    double depth = w->events[e].depth, sum[MOST_WIDTH] = {0.0}, one[MOST_WIDTH];
    for (int64_t k = e; k < end; ++k) {
        note_first(out, w->events[k].fragment, at);
        summand_of(w, w->events[k].fragment, 1.0, one);
        for (int n = 0; n < width; ++n) sum[n] += one[n];
    }
    put_mixture(w, sum, depth, depth, 1.0, out, at);
}

/* ---- Pixels ---------------------------------------------------------------------------------- */

/* Whether fragments [first, last) of a pixel are as they should be. */
static bool stays(const sweep *w, int64_t first, int64_t last) {
    for (int64_t i = first; i < last; ++i) {
        if (is_volume(w, i) && (!w->how->tidy || is_gaussian(w, i))) return false;
        if (!w->how->tidy || i == first) continue;
        double behind = back_of(w, i - 1), front = front_of(w, i);
        bool meets = !is_volume(w, i - 1) && !is_volume(w, i);
        if (front < behind || (front == behind && meets)) return false;
    }
    return true;
}

/* Sets the unit of a pixel's light. */
static void find_unit(sweep *w, int64_t first, int64_t last) {
    double most = 0.0;
    for (int64_t n = 3 * first; n < 3 * last; ++n) {
        if (w->f->color) most = fmax(most, fabs(number(w, w->f->color, n)));
        if (w->f->emission) most = fmax(most, fabs(number(w, w->f->emission, n)));
    }
    int exponent = 1;
    if (most > 0.0) frexp(most, &exponent);
    w->unit = ldexp(1.0, exponent < -1000 ? -1000 : exponent > 1000 ? 1000 : exponent);
    w->panels.unit = w->unit;
}

/* Fills the events of a pixel, in order; returns how many. */
static int64_t find_events(sweep *w, int64_t first, int64_t last) {
    double near = HUGE_VAL, far = -HUGE_VAL;
    w->gaussians = false;
    int64_t count = 0, volumes = 0, active = 0;
    for (int64_t i = first; i < last; ++i) {
        double front = front_of(w, i), back = back_of(w, i);
        w->place[i - first] = volumes;
        w->gaussians |= is_gaussian(w, i);
        w->events[count++] = (event){front, i, front < back ? START : POINT};
        if (front >= back) continue;
        w->events[count++] = (event){back, i, END};
        if (is_gaussian(w, i)) { /* a piece begins at its middle, so that it is not the end */
            double mean = w->extents[i - first].mean;
            w->events[count++] = (event){fmin(mean, nextafter(back, -HUGE_VAL)), i, MIDDLE};
        }
        near = fmin(near, front);
        far = fmax(far, back);
        ++volumes;
    }
    const double *cut = w->how->cut, *end = cut + w->how->cuts;
    for (; cut < end && *cut < far; ++cut)
        if (*cut > near) w->events[count++] = (event){*cut, -1, CUT};
    sort_events(w->events, count);

    w->shrink = isfinite(far - near) ? 1.0 : 0.25;
    w->mixes = false;
    for (int64_t e = 0; e < count; ++e) {
        active += (w->events[e].kind == START) - (w->events[e].kind == END);
        w->mixes |= active > 1;
    }
    w->leaves = volumes;
    w->active = w->names = w->panels.count = 0;
    return count;
}

/* Whether an event need not end a panel. */
static bool is_soft(const sweep *w, const event *one) {
    if (one->kind != START && one->kind != END) return false;
    const moit_extent *e = &w->extents[one->fragment - w->first];
    return one->kind == START ? moit_begins_softly(e) : moit_ends_softly(e);
}

/* Where what fills the depth from `near` on becomes one piece, and the events within, of which
 * those that begin fill it too. */
static double panel_end(sweep *w, double near, int64_t *next, int64_t count) {
    const event *e = w->events + *next, *end = w->events + count;
    if (!w->gaussians) return e->depth;
    double reach = moit_panels_reach(&w->panels, near);
    for (; e < end && e->depth < reach && is_soft(w, e); ++e) {
        if (e->kind == END) continue;
        double own = moit_panel_reach(&w->extents[e->fragment - w->first], near);
        if (!(own > e->depth)) break; /* so narrow that a panel has to begin with it */
        reach = fmin(reach, own);
        change_active(w, e->fragment, true);
    }
    *next = e - w->events;
    if (e == end) return e[-1].depth; /* all ends in it */
    /* what is thinner than numbers tell apart has one piece */
    if (!(reach > near)) reach = nextafter(near, HUGE_VAL);
    return fmin(reach, e->depth);
}

/* The same as split_pixel where no fragment has an extent, tidy: most images are so. */
static int64_t mix_surfaces(sweep *w, int64_t first, int64_t last, const moit_pieces *out,
                            int64_t at) {
    int64_t count = last - first, begin = at;
    bool tidy = true;
    for (int64_t k = 0; k < count; ++k) {
        w->events[k] = (event){number(w, w->f->depth, first + k), first + k, POINT};
        tidy &= k == 0 || w->events[k - 1].depth < w->events[k].depth;
    }
    if (!tidy) {
        w->changes = true;
        sort_events(w->events, count);
        if (out) find_unit(w, first, last);
    }
    for (int64_t e = 0, points; e < count; ++at) {
        for (points = e++; e < count && w->events[e].depth == w->events[points].depth;) ++e;
        if (out) put_coincident(w, points, e, out, at);
    }
    return at - begin;
}

/* How many pieces the fragments [first, last) of one pixel give, -1 where memory does not do;
 * writes them from out->depth[at] on where `out` is not NULL. */
static int64_t split_pixel(sweep *w, int64_t first, int64_t last, const moit_pieces *out,
                           int64_t at) {
    int64_t begin = at;
    if (w->how->tidy && !w->f->back && !w->f->deviation)
        return mix_surfaces(w, first, last, out, at);
    w->first = first;
    for (int64_t i = first; i < last; ++i) w->extents[i - first] = moit_extent_of(w->f, i);
    if (stays(w, first, last)) {
        for (int64_t i = first; out && i < last; ++i) {
            note_first(out, i, at + i - first);
            put_fragment(w, i, out, at + i - first);
        }
        return last - first;
    }
    int64_t count = find_events(w, first, last);
    if (out || w->gaussians) find_unit(w, first, last);
    w->changes = true;
    w->mixes = w->mixes && out;
    if (w->mixes && !w->gaussians && !clear_tree(w)) return -1;
    double depth = w->events[0].depth;
    for (int64_t e = 0; e < count;) {
        for (; e < count && w->events[e].depth == depth && w->events[e].kind == END; ++e)
            change_active(w, w->events[e].fragment, false);
        bool surfaces = false;
        while (e < count && w->events[e].depth == depth && w->events[e].kind == POINT) {
            int64_t points = e;
            surfaces = true;
            do ++e;
            while (w->how->tidy && e < count && w->events[e].depth == depth
                   && w->events[e].kind == POINT);
            if (out) put_coincident(w, points, e, out, at);
            ++at;
        }
        for (; e < count && w->events[e].depth == depth; ++e) {
            if (w->events[e].kind == CUT) continue;
            int64_t i = w->events[e].fragment;
            if (w->events[e].kind == START) change_active(w, i, true);
            if (w->events[e].kind == MIDDLE || !is_gaussian(w, i)) note_first(out, i, at);
        }
        double near = depth;
        int64_t passed = e;
        if (w->active) depth = panel_end(w, near, &e, count);
        else if (e < count) depth = w->events[e].depth;
        if (!w->active) continue; /* what is active ends at a later event */
        if (out) put_piece(w, near, depth, out, at);
        if (out && surfaces && !w->how->tidy) put_behind(w, out->depth, at);
        ++at;
        for (; passed < e; ++passed)
            if (w->events[passed].kind == END) change_active(w, w->events[passed].fragment, false);
    }
    return at - begin;
}

typedef struct {
    const moit_fragments *f;
    const moit_splitting *how;
    int64_t *offsets; /* of the pieces; their numbers are put at p + 1 where `out` is NULL */
    const moit_pieces *out;
    _Atomic bool changes; /* some pixel */
} split_job;

enum { BLOCK = 1024 }; /* pixels of one work item */

static moit_status split_block(void *context, int64_t item, int thread) {
    (void)thread;
    split_job *job = context;
    const int64_t *offsets = job->f->offsets;
    int64_t first = item * BLOCK, most = 1;
    int64_t last = first + BLOCK < job->f->pixels ? first + BLOCK : job->f->pixels;
    for (int64_t p = first; p < last; ++p) {
        int64_t n = offsets[p + 1] - offsets[p];
        if (n > most) most = n;
    }
    int64_t each = job->f->deviation ? MOST_EVENTS : 2;
    size_t fills = job->f->deviation ? (size_t)most : 1;
    moit_status status = MOIT_OK;
    sweep w = {.f = job->f,
               .how = job->how,
               .sums = layout_of(job->f),
               .events = malloc((size_t)(each * most + job->how->cuts) * sizeof(event)),
               .place = malloc((size_t)most * sizeof(int64_t)),
               .extents = malloc((size_t)most * sizeof(moit_extent)),
               .panels = {.f = job->f, .filling = malloc(fills * sizeof(moit_filling))}};
    if (!w.events || !w.place || !w.extents || !w.panels.filling) status = MOIT_NO_MEMORY;
    for (int64_t p = first; status == MOIT_OK && p < last; ++p) {
        int64_t at = job->out ? job->offsets[p] : 0;
        int64_t pieces = split_pixel(&w, offsets[p], offsets[p + 1], job->out, at);
        if (pieces < 0) status = MOIT_NO_MEMORY;
        else if (!job->out) job->offsets[p + 1] = pieces;
    }
    if (w.changes) job->changes = true;
    free(w.events);
    free(w.place);
    free(w.extents);
    free(w.panels.filling);
    free(w.tree);
    return status;
}

static int64_t blocks_of(int64_t pixels) { return (pixels + BLOCK - 1) / BLOCK; }

moit_status moit_piece_offsets(const moit_fragments *fragments, const moit_splitting *how,
                               int64_t *offsets, bool *changes, const moit_run *run) {
    split_job job = {.f = fragments, .how = how, .offsets = offsets};
    moit_status status = moit_parallel_for(run, blocks_of(fragments->pixels), split_block, &job);
    if (status != MOIT_OK) return status;
    *changes = job.changes;
    moit_offsets_of_counts(offsets, fragments->pixels);
    return MOIT_OK;
}

moit_status moit_split_volumes(const moit_fragments *fragments, const moit_splitting *how,
                               const int64_t *offsets, const moit_pieces *pieces,
                               const moit_run *run) {
    split_job job = {.f = fragments, .how = how, .offsets = (int64_t *)offsets, .out = pieces};
    return moit_parallel_for(run, blocks_of(fragments->pixels), split_block, &job);
}
