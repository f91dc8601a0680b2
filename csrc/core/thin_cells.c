/* Thick fragments as points that cells of depth tell apart.
 *
 * A slice is given a share of absorbance that is linear in warped depth between it and the next.
 * So a point at the mean depth of what an extent has in a cell gives to slices what that part of
 * the extent gives them, whatever cells are joined later. A part of less than a step would be
 * dropped or made a whole one, so parts are added up until they are a step. Masses and means are
 * sums of what is not negative, and nothing cancels. */
#include "core/thin_cells.h"
#include "core/elementary.h"

#include <math.h>

enum { MOST_PANELS = 64, MOST_POINTS = 4 };

/* Legendre's rules over [-1, 1]. */
typedef struct {
    int points;
    double node[MOST_POINTS], weight[MOST_POINTS];
} rule;

static const rule few = {2, {-0.57735026918962576, 0.57735026918962576}, {1.0, 1.0}},
                  more = {
                      4,
                      {-0.86113631159405258, -0.33998104358485626, 0.33998104358485626,
                       0.86113631159405258},
                      {0.34785484513745386, 0.65214515486254614, 0.65214515486254614,
                       0.34785484513745386},
};

/* What all but one point's steps are longer than 1, for absorbance that is rounded to float32. */
#define WHOLE_STEP (1.0 + 0x1p-20)

/* Depth by s, in which cells are even: depth, or its logarithm. */
typedef struct {
    const moit_extent *e;
    bool is_log;
    double near, width; /* of the first cell, and of each */
    double front, back; /* the extent's */
    double smooth;      /* what is no longer than this has integrals by four points to 1e-9 */
    double growth;      /* of depth over that */
    double half,
        grown[MOST_POINTS]; /* half a panel, and how depth grows from its start to its points */
} course;

static course course_of(const moit_extent *e, const moit_cells *cells) {
    course c = {.e = e,
                .is_log = cells->warp == MOIT_WARP_LOG && cells->near > 0.0 && e->front > 0.0};
    double far = c.is_log ? moit_log(cells->far) : cells->far;
    c.near = c.is_log ? moit_log(cells->near) : cells->near;
    c.width = far / cells->cells - c.near / cells->cells;
    c.front = c.is_log ? moit_log(e->front) : e->front;
    c.back = c.is_log ? moit_log(e->back) : e->back;
    double deviation = e->is_gaussian ? 0.5 * e->deviation : HUGE_VAL;
    c.smooth = c.is_log ? fmin(0.5, deviation / e->back) : deviation;
    c.growth = c.is_log ? moit_exp(c.smooth) : 1.0;
    return c;
}

static double depth_at(const course *c, double s) { return c->is_log ? moit_exp(s) : s; }

/* Which cell s is in; the first and the last have what lies beyond. */
static int cell_of(const course *c, double s, int cells) {
    double place = (s - c->near) / c->width;
    return place > 0.0 ? (int)fmin(floor(place), (double)(cells - 1)) : 0;
}

typedef struct {
    double mass, moment; /* of an extent's part, and of where s is in the extent, [0, 1] */
} part;

/* Shares of the extent for each unit of s. */
static void densities_at(const course *c, int points, const double *depth, double *density) {
    moit_shares_at(c->e, points, depth, c->e->front, c->e->back, density);
    for (int j = 0; j < points; ++j)
        density[j] = density[j] / (c->e->back - c->e->front) * (c->is_log ? depth[j] : 1.0);
}

static double density_at(const course *c, double depth) {
    double density;
    densities_at(c, 1, &depth, &density);
    return density;
}

/* Most panels are as long as the one before. */
static void take_half(course *c, const rule *r, double half) {
    if (half == c->half) return;
    c->half = half;
    for (int j = 0; j < r->points; ++j)
        c->grown[j] = c->is_log ? moit_exp(half * (1.0 + r->node[j])) : 1.0;
}

static void integrate(course *c, double from, double to, part *sum) {
    double length = to - from, whole = c->back - c->front;
    int panels = (int)fmin(fmax(ceil(length / c->smooth), 1.0), (double)MOST_PANELS);
    double half = 0.5 * (length / panels);
    const rule *r = 4.0 * half > 0.5 * c->smooth ? &more : &few;
    take_half(c, r, half);
    for (int k = 0; k < panels; ++k) {
        double start = from + 2.0 * half * k, first = depth_at(c, start);
        double s[MOST_POINTS], depth[MOST_POINTS], density[MOST_POINTS];
        for (int j = 0; j < r->points; ++j) {
            s[j] = start + half * (1.0 + r->node[j]);
            depth[j] = c->is_log ? first * c->grown[j] : s[j];
        }
        densities_at(c, r->points, depth, density);
        for (int j = 0; j < r->points; ++j) {
            double share = r->weight[j] * half * density[j];
            sum->mass += share;
            sum->moment += share * ((s[j] - c->front) / whole);
        }
    }
}

/* The steps up to the last cut that is not behind `steps` of them: cuts are whole steps from the
 * front up to the middle, and from the back. */
static double cut_before(double steps, double all) {
    double half = floor(0.5 * all / WHOLE_STEP);
    double left = ceil(fmax(all - steps, 0.0) / WHOLE_STEP);
    if (left <= half) return all - left * WHOLE_STEP;
    return fmin(floor(steps / WHOLE_STEP), half) * WHOLE_STEP;
}

/* From s on so many cells have less than half a step together, and are smooth. */
static int stride_at(const course *c, double s, double steps) {
    if (!(2.0 * c->width < c->smooth)) return 1;
    double near = depth_at(c, s), far = c->is_log ? near * c->growth : s + c->smooth;
    double densest = fmin(fmax(near, c->e->mean), far);
    double density = density_at(c, c->e->is_gaussian ? densest : far);
    double length = fmin(c->smooth, 0.5 / fmax(density * steps, 0.5 / c->smooth));
    return (int)fmin(fmax(floor(length / c->width), 1.0), 65536.0);
}

int moit_points_of_cells(const moit_extent *extent, const moit_cells *cells, double steps,
                         moit_give_point *give, void *context) {
    course c = course_of(extent, cells);
    double whole = c.back - c.front;
    if (!(c.width > 0.0 && isfinite(c.width) && whole > 0.0 && isfinite(whole))) {
        give(context, 0.5 * extent->front + 0.5 * extent->back, 1.0);
        return 1;
    }
    int last = cell_of(&c, c.back, cells->cells), points = 0;
    part waits = {0.0, 0.0};            /* of what is behind the last point */
    double from = c.front, given = 0.0; /* shares */
    for (int cell = cell_of(&c, c.front, cells->cells); cell <= last;) {
        int next = cell + stride_at(&c, from, steps);
        bool ends = next > last;
        double to = ends ? c.back : fmin(fmax(c.near + c.width * next, from), c.back);
        part run = {0.0, 0.0};
        integrate(&c, from, to, &run);
        double reached = given + waits.mass + run.mass;
        double share = ends ? 1.0 : cut_before(reached * steps, steps) / steps;
        bool gives = share > given && (ends || run.mass > 0.0);
        /* what of the run is behind a cut within it */
        double left = gives && !ends ? fmin(fmax((reached - share) / run.mass, 0.0), 1.0) : 0.0;
        waits.mass += run.mass * (1.0 - left);
        waits.moment += run.moment * (1.0 - left);
        if (gives) {
            double middle = waits.mass > 0.0 ? waits.moment / waits.mass : 1.0;
            double depth = depth_at(&c, c.front + whole * middle);
            give(context, fmin(extent->back, fmax(extent->front, depth)), share - given);
            ++points;
            given = share;
            waits = (part){run.mass * left, run.moment * left};
        }
        from = to;
        cell = next;
    }
    return points;
}
