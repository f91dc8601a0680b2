/* Backwards through neural moment transparency, kernels/neural_moments.h: the network, and what it
 * sees: a place between its pixel's ends, and sums of powers of depth. The ends move with the
 * nearest and the farthest fragment, as if 16 bits held them as they are. */
#include "core/elementary.h"
#include "core/adjoints/networks.h"
#include "core/techniques/table.h"

#include <math.h>

enum { FEATURES = 7, MOMENTS = 4 };

/* A pixel: its ends as held, the total absorbance, and what the network sees of it; and derivatives
 * by its ends, b0 and sums of powers 1 to 4. */
typedef struct {
    double nearest, farthest, total, seen[FEATURES];
    double by_nearest, by_farthest, by_b0, by_sum[MOMENTS + 1];
} pixel_state;

/* Half a step of what ends are held in, at least. */
static double blur_of(bool words) { return words ? 0x1p-15 : 0x1p-11; }

/* z as moments are taken of it, and how fast that moves with z and the ends. */
typedef struct {
    double at, by_z, by_nearest, by_farthest;
} own_place;

static own_place place_of(bool words, const pixel_state *s, double z) {
    double extent = s->farthest - s->nearest;
    if (!words) return (own_place){z, 1.0, 0.0, 0.0};
    if (!(extent > 0.0)) return (own_place){0};
    double at = ((z - s->nearest) - (s->farthest - z)) / extent;
    if (at < -1.0 || at > 1.0) return (own_place){at < -1.0 ? -1.0 : 1.0, 0.0, 0.0, 0.0};
    return (own_place){at, 2.0 / extent, (at - 1.0) / extent, -(1.0 + at) / extent};
}

/* Of such a place the share of the extent, exponentially, that lies in front, and how fast it moves
 * with the place and the ends. */
static own_place relative_place(bool words, const pixel_state *s, double at) {
    double farthest = words ? 1.0 : s->farthest, extent = s->farthest - s->nearest;
    if (!(extent > 0.0)) return (own_place){0};
    double least = moit_exp(words ? -2.0 : -extent), room = 1.0 - least, past = at - farthest;
    double here = moit_exp(past < 0.0 ? past : 0.0), share = (here - least) / room;
    if (share < 0.0 || share > 1.0) return (own_place){share < 0.0 ? 0.0 : 1.0, 0.0, 0.0, 0.0};
    double by_at = past < 0.0 ? here / room : 0.0, by_extent = least * (1.0 - share) / room;
    if (words) return (own_place){share, by_at, 0.0, 0.0};
    return (own_place){share, by_at, -by_extent, by_extent - by_at};
}

/* By T at z, which adds to by_z. */
static void pull_place(const moit_technique *technique, pixel_state *s, double z, double by,
                       double *by_z, double *by_w) {
    bool words = technique->neural.range_in_words;
    double blur = blur_of(words);
    if (z < s->nearest - blur) return;
    if (z > s->farthest + blur) {
        s->by_b0 -= s->total * by;
        return;
    }
    own_place place = place_of(words, s, z), share = relative_place(words, s, place.at);
    moit_network_shape network = {technique->neural.network, FEATURES, 32, 16};
    double by_seen[FEATURES] = {0.0};
    s->seen[0] = share.at;
    moit_network_activity a = moit_ask_network(&network, s->seen);
    if (a.share < s->total) {
        s->by_b0 -= s->total * by;
        return;
    }
    moit_pull_network(&network, s->seen, &a, by, by_seen, by_w);
    for (int k = 0; k <= MOMENTS; ++k) s->by_sum[k] += by_seen[2 + k];
    double by_at = by_seen[0] * share.by_z;
    *by_z += by_at * place.by_z;
    s->by_nearest += by_at * place.by_nearest + by_seen[0] * share.by_nearest;
    s->by_farthest += by_at * place.by_farthest + by_seen[0] * share.by_farthest;
}

/* From sums over the pixel's fragments, and its ends, to these. */
static void pull_sums(bool words, const pixel_state *s, int n, const double *a, const double *z,
                      double *by_z, double *by_a) {
    double by_nearest = s->by_nearest, by_farthest = s->by_farthest;
    int nearest = 0, farthest = 0;
    for (int i = 0; i < n; ++i) {
        own_place place = place_of(words, s, z[i]);
        double power = 1.0, sum = s->by_sum[0], rise = 0.0;
        for (int k = 1; k <= MOMENTS; ++k) {
            rise += k * s->by_sum[k] * power;
            power *= place.at;
            sum += s->by_sum[k] * power;
        }
        by_a[i] += s->by_b0 + sum;
        by_z[i] += a[i] * rise * place.by_z;
        by_nearest += a[i] * rise * place.by_nearest;
        by_farthest += a[i] * rise * place.by_farthest;
        if (z[i] < z[nearest]) nearest = i;
        if (z[i] > z[farthest]) farthest = i;
    }
    by_z[nearest] += by_nearest;
    by_z[farthest] += by_farthest;
}

void moit_neural_pull_back(const moit_job *job, moit_tile *tile, const moit_adjoint *by) {
    const double *rays = (const double *)(const void *)moit_neural_rays(job, tile), *b = tile->b;
    bool words = job->technique->neural.range_in_words;
    moit_adjoint_begin(job, tile, by);
    for (int p = 0; p < tile->pixels; ++p) {
        const double *ray = rays + p * MOIT_NEURAL_RAY;
        int first = tile->offsets[p], n = tile->offsets[p + 1] - first;
        if (n == 0) continue;
        moit_readings at = moit_readings_of(job, tile, by, p, false);
        pixel_state s = {.nearest = ray[0], .farthest = ray[1], .total = tile->total[p]};
        s.seen[1] = ray[2];
        s.seen[2] = ray[3];
        for (int k = 0; k < MOMENTS; ++k) s.seen[3 + k] = ray[3] * b[p * MOMENTS + k];
        s.by_b0 = -s.total * by->total[p];
        for (int i = 0; i < at.n; ++i)
            pull_place(job->technique, &s, at.z[i], at.by[i], at.by_z + i, by->network);
        pull_sums(words, &s, n, (const double *)tile->absorbance + first,
                  (const double *)tile->z + first, by->work[1] + first, by->work[2] + first);
    }
    moit_adjoint_of_absorbance(job, tile, by);
    moit_adjoint_of_warp(job, tile, by);
}
