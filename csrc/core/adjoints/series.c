/* Backwards through series of depth: Fourier opacity maps, wavelets, transmittance function maps.
 * What they compute: kernels/fourier_opacity.h, haar_wavelet.h and transmittance_function.h. Where
 * an answer is clamped it has the derivative of what it is clamped to. */
#include "core/elementary.h"
#include "core/adjoints/blocks.h"
#include "core/techniques/table.h"

#include <math.h>
#include <string.h>

#define PI 3.141592653589793238

enum { MOST_TERMS = 32 };

/* ---- Fourier opacity maps -------------------------------------------------------------------- */

/* cos(2 pi k d) and sin(2 pi k d), k = 1 .. harmonics. */
typedef struct {
    double cosine[MOST_TERMS], sine[MOST_TERMS]; /* of maps of functions all but one */
} waves;

static void find_waves(int harmonics, double turns, waves *w) {
    double c = moit_cos(2.0 * PI * turns), s = moit_sin(2.0 * PI * turns), re = 1.0, im = 0.0;
    for (int k = 0; k < harmonics; ++k) {
        double next = re * c - im * s;
        im = re * s + im * c;
        re = next;
        w->cosine[k] = re;
        w->sine[k] = im;
    }
}

/* By a pixel's sums, from what was read of them. */
static void read_fourier(int harmonics, const double *b, const moit_readings *at, double *by_b) {
    double mean = b[0];
    waves w;
    for (int i = 0; mean > 0.0 && i < at->n; ++i) {
        double d = at->z[i], own = at->own ? at->own[i] : 0.0, by = at->by[i];
        double in_front = mean * d, slope = mean, own_share = d, own_slope = 1.0;
        find_waves(harmonics, d, &w);
        for (int k = 0; k < harmonics; ++k) {
            double part = 1.0 / (PI * (k + 1)), c = b[1 + 2 * k], s = b[2 + 2 * k];
            in_front += part * (c * w.sine[k] + s * (1.0 - w.cosine[k]));
            slope += 2.0 * (c * w.cosine[k] + s * w.sine[k]);
            own_share += part * w.sine[k];
            own_slope += 2.0 * w.cosine[k];
        }
        double x = in_front - own * own_share;
        if (x < 0.0) continue;
        if (x > fmax(mean - own, 0.0)) {
            if (mean > own) {
                by_b[0] += by;
                if (at->own) at->by_own[i] -= by;
            }
            continue;
        }
        at->by_z[i] += by * (slope - own * own_slope);
        if (at->own) at->by_own[i] -= by * own_share;
        by_b[0] += by * d;
        for (int k = 0; k < harmonics; ++k) {
            by_b[1 + 2 * k] += by * w.sine[k] / (PI * (k + 1));
            by_b[2 + 2 * k] += by * (1.0 - w.cosine[k]) / (PI * (k + 1));
        }
    }
}

static void pull_fourier_sums(int harmonics, const double *by_b, int n, const double *a,
                              const double *z, double *by_a, double *by_z) {
    waves w;
    for (int i = 0; i < n; ++i) {
        double sum = by_b[0], slope = 0.0;
        find_waves(harmonics, z[i], &w);
        for (int k = 0; k < harmonics; ++k) {
            double c = by_b[1 + 2 * k], s = by_b[2 + 2 * k];
            sum += c * w.cosine[k] + s * w.sine[k];
            slope += 2.0 * PI * (k + 1) * (s * w.cosine[k] - c * w.sine[k]);
        }
        by_a[i] += sum;
        by_z[i] += a[i] * slope;
    }
}

/* From absorbances and z on; the total of pixels that read blocks' is the product of 1 - alpha. */
static void finish(const moit_job *job, moit_tile *tile, const moit_adjoint *by) {
    moit_adjoint_of_absorbance(job, tile, by);
    if (by->blocks && !job->technique->full_total) moit_adjoint_of_totals(tile, by, by->total);
    moit_adjoint_of_warp(job, tile, by);
}

void moit_fourier_pull_back(const moit_job *job, moit_tile *tile, const moit_adjoint *by) {
    int count = job->technique->count, harmonics = (count - 1) / 2;
    const double *a = tile->absorbance, *z = tile->z;
    moit_adjoint_begin(job, tile, by);
    for (int p = 0; p < tile->pixels; ++p) {
        moit_readings at = moit_readings_of(job, tile, by, p, job->technique->series.exclude_self);
        double by_b[MOST_TERMS] = {-tile->total[p] * by->total[p]};
        int first = tile->offsets[p], n = tile->offsets[p + 1] - first;
        if (by->blocks && !job->technique->full_total) by_b[0] = 0.0;
        read_fourier(harmonics, (const double *)(void *)tile->own + p * count, &at, by_b);
        if (by->blocks) {
            double mixed[MOST_TERMS], taken[MOST_TERMS];
            moit_mix_blocks(job, tile, p, count, mixed);
            double by_total = moit_give_sums(job, tile, by, p, mixed, 0, tile->double_b0[p], by_b);
            moit_take_sums(tile, by, p, taken);
            taken[0] += by_total;
            memcpy(by_b, taken, (size_t)count * sizeof *by_b);
        }
        pull_fourier_sums(harmonics, by_b, n, a + first, z + first, by->work[2] + first,
                          by->work[1] + first);
    }
    finish(job, tile, by);
}

/* ---- Wavelets -------------------------------------------------------------------------------- */

typedef struct {
    int cell;
    double inside, rise; /* rise: of the place in cells by z */
} cell_place;

static cell_place cell_of(int cells, bool density, double z) {
    double steps = density ? cells : cells - 1, x = z * steps;
    bool outside = !(x >= 0.0 && x <= cells);
    x = x > 0.0 ? fmin(x, cells) : 0.0;
    int cell = x < cells - 1 ? (int)x : cells - 1;
    return (cell_place){cell, x - cell, outside ? 0.0 : steps};
}

/* By the ends of cells, from what was read between them. */
static void read_cells(int cells, bool density, const double *end, const moit_readings *at,
                       double *by_end) {
    for (int i = 0; i < at->n; ++i) {
        cell_place place = cell_of(cells, density, at->z[i]);
        double own = at->own ? at->own[i] : 0.0, by = at->by[i], inside = place.inside;
        double start = place.cell > 0 ? end[place.cell - 1] : 0.0, step = end[place.cell] - start;
        double share = density ? inside : inside * (1.0 - inside);
        if (start + step * inside - own * share < 0.0) continue;
        if (place.cell > 0) by_end[place.cell - 1] += by * (1.0 - inside);
        by_end[place.cell] += by * inside;
        at->by_z[i] += by * place.rise * (step - own * (density ? 1.0 : 1.0 - 2.0 * inside));
        if (at->own) at->by_own[i] -= by * share;
    }
}

/* A surface adds all that it absorbs to the ends of cells behind its own, and to that of its own,
 * which holds the mean over the cell, what of this lies behind the surface; of densities all. The
 * series gives that exactly, so what happens between is left out. */
static void pull_cells(int cells, bool density, const double *by_end, int n, const double *a,
                       const double *z, double *by_a, double *by_z) {
    double behind[MOST_TERMS + 1] = {0.0};
    for (int k = cells; k-- > 0;) behind[k] = behind[k + 1] + by_end[k];
    for (int i = 0; i < n; ++i) {
        cell_place place = cell_of(cells, density, z[i]);
        double by_own = by_end[place.cell];
        by_a[i] +=
            density ? behind[place.cell] : behind[place.cell + 1] + (1.0 - place.inside) * by_own;
        if (!density) by_z[i] -= a[i] * place.rise * by_own;
    }
}

void moit_haar_pull_back(const moit_job *job, moit_tile *tile, const moit_adjoint *by) {
    bool density = job->technique->series.density;
    int levels = 0, cells = 1;
    for (; cells < job->technique->count; cells *= 2) ++levels;
    const double *a = tile->absorbance, *z = tile->z;
    moit_adjoint_begin(job, tile, by);
    for (int p = 0; p < tile->pixels; ++p) {
        moit_readings at = moit_readings_of(job, tile, by, p, job->technique->series.exclude_self);
        double by_end[MOST_TERMS] = {0.0};
        int first = tile->offsets[p], n = tile->offsets[p + 1] - first;
        by_end[cells - 1] = -tile->total[p] * by->total[p];
        if (by->blocks && !job->technique->full_total) by_end[cells - 1] = 0.0;
        read_cells(cells, density, (const double *)(void *)tile->own + p * cells, &at, by_end);
        if (by->blocks) {
            double mixed[MOST_TERMS], taken[MOST_TERMS];
            moit_mix_blocks(job, tile, p, cells, mixed);
            job->precise->haar_cells(levels, density, 1, mixed);
            double own = tile->double_b0[p];
            double by_total = moit_give_sums(job, tile, by, p, mixed, cells - 1, own, by_end);
            moit_take_sums(tile, by, p, taken);
            taken[cells - 1] += by_total;
            memcpy(by_end, taken, (size_t)cells * sizeof *by_end);
        }
        pull_cells(cells, density, by_end, n, a + first, z + first, by->work[2] + first,
                   by->work[1] + first);
    }
    finish(job, tile, by);
}

/* ---- Transmittance function maps ------------------------------------------------------------- */

/* By the coefficients and the total, from the transmittances that were read. own: opacities, or
 * NULL. */
static void read_function(int count, const double *c, double total, double max_alpha,
                          const moit_readings *at, double *by_c, double *by_total) {
    waves w;
    for (int i = 0; i < at->n; ++i) {
        double d = at->z[i], given = at->own ? at->own[i] : 0.0, own = fmin(given, max_alpha);
        double sum = c[0], slope = 0.0, shown = 1.0 - d, shown_slope = -1.0;
        double left = 1.0 - own, by = at->by[i], by_own = 0.0;
        find_waves(count - 1, 0.5 * d, &w);
        for (int k = 1; k < count; ++k) {
            double cosine = w.cosine[k - 1], sine = w.sine[k - 1];
            sum += c[k] * sqrt(2.0) * cosine;
            slope -= c[k] * sqrt(2.0) * PI * k * sine;
            shown -= 2.0 / (PI * k) * sine * cosine;
            shown_slope -= 2.0 * (cosine * cosine - sine * sine);
        }
        double rest = 1.0 - own * shown;
        bool most = rest < left;
        if (most) rest = left;
        double T = sum / rest, least = total / left;
        if (T > 1.0 || least > 1.0) continue;
        if (T < least) {
            *by_total += by / left;
            by_own = by * least / left;
        } else {
            by_c[0] += by / rest;
            for (int k = 1; k < count; ++k) by_c[k] += by / rest * sqrt(2.0) * w.cosine[k - 1];
            by_own = by * T / rest * (most ? 1.0 : shown);
            at->by_z[i] += by / rest * (slope + (most ? 0.0 : T * own * shown_slope));
        }
        if (at->own && given <= max_alpha) at->by_own[i] += by_own;
    }
}

/* A drop of alpha T at z adds to the coefficients; by T, and to by_alpha and by_z. */
static void pull_drops(int count, const double *by_c, int n, const double *alpha, const double *T,
                       const double *z, double *by_T, double *by_alpha, double *by_z) {
    waves at;
    for (int i = 0; i < n; ++i) {
        double sum = by_c[0] * z[i], slope = by_c[0];
        find_waves(count - 1, 0.5 * z[i], &at);
        for (int k = 1; k < count; ++k) {
            sum += by_c[k] * sqrt(2.0) / (PI * k) * at.sine[k - 1];
            slope += by_c[k] * sqrt(2.0) * at.cosine[k - 1];
        }
        by_T[i] = alpha[i] * sum;
        by_alpha[i] += T[i] * sum;
        by_z[i] += alpha[i] * T[i] * slope;
    }
}

/* Of blocks, which have what maps take of 1: from the derivatives by the coefficients and the total
 * that pixel p reads to those by what its own block's maps have, and its own total. */
static void pull_taken(const moit_job *job, const moit_tile *tile, const moit_adjoint *by, int p,
                       double by_map, double *by_c, double *by_total) {
    int count = job->technique->count;
    double by_read[MOST_TERMS + 1], mixed[MOST_TERMS + 1], taken[MOST_TERMS + 1];
    const double *read = moit_function_map_blocks.state(job, tile, 0).numbers;
    for (int k = 0; k < count; ++k) by_read[k] = k ? by_c[k] : -by_c[0];
    by_read[count] = read[p * (count + 1) + count] > 1.0 ? 0.0 : -by_map;
    moit_mix_blocks(job, tile, p, count + 1, mixed);
    *by_total -= moit_give_sums(job, tile, by, p, mixed, count, 1.0 - tile->total[p], by_read);
    moit_take_sums(tile, by, p, taken);
    for (int k = 0; k < count; ++k) by_c[k] = k ? taken[k] : -taken[0];
    *by_total -= taken[count];
}

void moit_function_map_pull_back(const moit_job *job, moit_tile *tile, const moit_adjoint *by) {
    int count = job->technique->count;
    moit_adjoint_begin(job, tile, by);
    for (int p = 0; p < tile->pixels; ++p) {
        int first = tile->offsets[p], n = tile->offsets[p + 1] - first;
        int32_t *order = tile->order + first;
        const double *alpha = (const double *)tile->alpha + first;
        const double *z = (const double *)tile->z + first;
        double *T = by->work[0] + first, *by_T = by->work[2] + first, *by_alpha = by->alpha + first;
        double by_c[MOST_TERMS] = {0.0}, by_total = by->total[p], through = 1.0;
        moit_readings at = moit_readings_of(job, tile, by, p, job->technique->series.exclude_self);
        if (at.own) at.own = alpha;
        at.by_own = by_alpha;
        double by_map = 0.0, map_total = by->blocks ? tile->double_b0[p] : tile->total[p];
        read_function(count, (const double *)(void *)tile->own + p * count, map_total,
                      job->max_alpha, &at, by_c, by->blocks ? &by_map : &by_total);
        if (by->blocks) pull_taken(job, tile, by, p, by_map, by_c, &by_total);
        for (int i = 0; i < n; ++i) order[tile->rank[first + i]] = i;
        for (int k = 0; k < n; ++k) {
            T[order[k]] = through;
            through *= 1.0 - alpha[order[k]];
        }
        pull_drops(count, by_c, n, alpha, T, z, by_T, by_alpha, by->work[1] + first);
        moit_adjoint_of_products(n, order, alpha, by_T, by_total + by_c[0], by_alpha, T);
    }
    moit_adjoint_of_warp(job, tile, by);
}
