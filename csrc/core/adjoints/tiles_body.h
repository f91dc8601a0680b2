/* Compiled once per table of tiles.h, after lanes.h. */
#include "core/adjoints/tiles.h"

/* Beyond that exp(-x) is nothing, and nothing less is asked for. */
#define MOST_ABSORBED 700.0

/* Numbers from `p` on, of which memory has n: those beyond are 0. */
FN quad some_of(const double *p, int n) {
    quad x = {0.0};
    if (n >= 4) memcpy(&x, p, sizeof x);
    else
        for (int i = 0; i < n; ++i) x[i] = p[i];
    return x;
}

FN void put(double *p, quad x) { memcpy(p, &x, sizeof x); }

static void relative_weights(int pixels, const int32_t *offsets, const double *absorbed,
                             const double *alpha, double *T) {
    int all = offsets[pixels];
    for (int p = 0; p < pixels; ++p) {
        int first = offsets[p], end = offsets[p + 1];
        real least = K(__builtin_huge_val());
        for (int i = first; i < end; i += LANES) {
            truth counts = BOTH(among_first(end - i), load_at_most(alpha + i, all - i) > 0.0);
            least = min(least, select(counts, load(absorbed + i), K(__builtin_huge_val())));
        }
        double of_all = least[0];
        for (int lane = 1; lane < LANES; ++lane)
            of_all = least[lane] < of_all ? least[lane] : of_all;
        if (of_all == __builtin_huge_val()) of_all = 0.0;
        for (int i = first; i < end; i += LANES)
            store(T + i, min(load(absorbed + i) - of_all, K(MOST_ABSORBED)));
    }
    for (int i = 0; i < all; i += LANES) store(T + i, exponential(-load(T + i)));
}

/* Four fragments of a pixel, or as many as `left` are in the tile. What is written beyond the
 * pixel's last is written over. */
FN void pull_four(const moit_pulled_sums *o, const quad by[4], int i, int left) {
    quad T, alpha = some_of(o->alpha + i, left), emission = alpha;
    memcpy(&T, o->T + i, sizeof T);
    if (o->emission != o->alpha) emission = some_of(o->emission + i, left);
    const double *color = o->color + 3 * i;
    quad a = some_of(color, 3 * left), b = some_of(color + 4, 3 * left - 4),
         c = some_of(color + 8, 3 * left - 8);
    quad seen = by[0] * (quad){a[0], a[3], b[2], c[1]};
    seen = seen + by[1] * (quad){a[1], b[0], b[3], c[2]};
    seen = seen + by[2] * (quad){a[2], b[1], c[0], c[3]};
    quad light = emission * T, red = by[0] * light, green = by[1] * light, blue = by[2] * light;
    put(o->by_color + 3 * i, (quad){red[0], green[0], blue[0], red[1]});
    put(o->by_color + 3 * i + 4, (quad){green[1], blue[1], red[2], green[2]});
    put(o->by_color + 3 * i + 8, (quad){blue[2], red[3], green[3], blue[3]});
    put(o->by_emission + i, seen * T);
    put(o->by_alpha + i, by[3] * T);
    quad both = seen * emission + by[3] * alpha;
    put(o->by_T + i, o->absorbed ? -T * both : both);
}

static void pull_sums(const moit_pulled_sums *o) {
    int all = o->offsets[o->pixels];
    for (int p = 0; p < o->pixels; ++p) {
        const double *of = o->by_sum + 4 * p;
        const quad by[4] = {QUAD(of[0]), QUAD(of[1]), QUAD(of[2]), QUAD(of[3])};
        int i = o->offsets[p], end = o->offsets[p + 1];
        for (; i < end && i + 4 <= all; i += 4) pull_four(o, by, i, 4);
        if (i < end) pull_four(o, by, i, all - i);
    }
}

static void pull_absorbance(int n, bool scaled, double most, const double *alpha, const double *by,
                            double *by_alpha) {
    for (int i = 0; i < n; i += LANES) {
        real a = load_at_most(alpha + i, n - i), slope;
        if (scaled) slope = most / (1.0 - most * a);
        else slope = select(a > most, K(0.0), 1.0 / (1.0 - a));
        store(by_alpha + i, load(by_alpha + i) + load(by + i) * slope);
    }
}

static void pull_warp(int n, const moit_warp_map *map, double rise, const double *depth,
                      const double *by_z, double *by_depth) {
    bool bounded = map->warp != MOIT_WARP_NONE, logarithms = map->warp == MOIT_WARP_LOG;
    for (int i = 0; i < n; i += LANES) {
        real at = load_at_most(depth + i, n - i), slope = K(rise);
        if (logarithms) slope = rise / at;
        if (bounded) slope = select((at < map->near) | (at > map->far), K(0.0), slope);
        store(by_depth + i, load(by_depth + i) + load(by_z + i) * slope);
    }
}

const moit_tile_adjoints TILE_TABLE = {relative_weights, pull_sums, pull_absorbance, pull_warp};
