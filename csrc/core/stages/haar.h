/* Stages of Haar wavelets: sums of coefficients per pixel, absorbance at ends of cells with lanes
 * over pixels, transmittance with lanes over the fragments of a tile, whatever their pixels. */

#include "kernels/haar_wavelet.h"

/* What fragments of a vector add, lane by lane. */
typedef struct {
    SCALAR cell[LANES];
    SCALAR addend[1 + HAAR_MOST_LEVELS][LANES]; /* scaling, then a wavelet of each level */
} haar_addends;

FN void haar_add_up_to(const int levels, const int density, const SCALAR *z, const SCALAR *a,
                       haar_addends *to) {
    haar_event e = haar_event_of(levels, density, load(z), load(a));
    store(to->cell, e.cell);
    store(to->addend[0], e.scaling);
    for (int p = 0; p < levels; ++p) store(to->addend[1 + p], e.wavelet[p]);
}

FN void haar_sums_of(const int levels, const int density, int pixels, const int32_t *offsets,
                     const SCALAR *a, const SCALAR *z, SCALAR *c) {
    const int cells = 1 << levels;
    haar_addends some;
    int ready = 0; /* fragments before it have their addends computed */
    for (int p = 0; p < pixels; ++p, c += cells) {
        double sum[HAAR_MOST_CELLS] = {0};
        for (int i = offsets[p]; i < offsets[p + 1]; ++i) {
            if (i == ready) {
                haar_add_up_to(levels, density, z + i, a + i, &some);
                ready = i + LANES;
            }
            int lane = i + LANES - ready, cell = (int)some.cell[lane];
            sum[0] += (double)some.addend[0][lane];
            for (int k = 0; k < levels; ++k)
                sum[(1 << k) + (cell >> (levels - k))] += (double)some.addend[1 + k][lane];
        }
        for (int k = 0; k < cells; ++k) c[k] = (SCALAR)sum[k];
    }
}

/* The same into half floats, each fragment blended by itself. Half's largest number stands for what
 * lies beyond it: no light is left there. */
FN void haar_half_sums_of(const int levels, const int density, int pixels, const int32_t *offsets,
                          const SCALAR *a, const SCALAR *z, SCALAR *c) {
    const int cells = 1 << levels;
    haar_addends some;
    int ready = 0;
    for (int p = 0; p < pixels; ++p, c += cells) {
        for (int k = 0; k < cells; ++k) c[k] = (SCALAR)0.0;
        for (int i = offsets[p]; i < offsets[p + 1]; ++i) {
            if (i == ready) {
                haar_add_up_to(levels, density, z + i, a + i, &some);
                ready = i + LANES;
            }
            int lane = i + LANES - ready, cell = (int)some.cell[lane];
            SCALAR *at[1 + HAAR_MOST_LEVELS] = {c};
            SCALAR blended[1 + HAAR_MOST_LEVELS + LANES] = {c[0] + some.addend[0][lane]};
            for (int k = 0; k < levels; ++k) {
                at[1 + k] = c + (1 << k) + (cell >> (levels - k));
                blended[1 + k] = *at[1 + k] + some.addend[1 + k][lane];
            }
            for (int k = 0; k < 1 + levels; k += LANES)
                store(blended + k, min(rounded_to_half(load(blended + k)), K(65504.0)));
            for (int k = 0; k < 1 + levels; ++k) *at[k] = blended[k];
        }
    }
}

FN void haar_cells_of_pixels(const int levels, const int density, int pixels, SCALAR *c) {
    const int cells = 1 << levels;
    for (int p = 0; p < pixels; p += LANES) {
        haar_coefficients stored;
        for (int lane = 0; lane < LANES; ++lane) {
            const SCALAR *own = c + (p + lane < pixels ? p + lane : p) * cells;
            for (int k = 0; k < cells; ++k) stored.c[k][lane] = own[k];
        }
        haar_cells found = haar_cells_of(levels, density, stored);
        for (int lane = 0; lane < LANES && p + lane < pixels; ++lane)
            for (int k = 0; k < cells; ++k) c[(p + lane) * cells + k] = found.end[k][lane];
    }
}

FN void haar_transmittance_of(const int levels, const int density, int pixels,
                              const int32_t *offsets, const SCALAR *z, const SCALAR *own,
                              const SCALAR *ends, bool absorbed, SCALAR *T) {
    const int cells = 1 << levels;
    int p = 0;
    for (int i = 0; i < offsets[pixels]; i += LANES) {
        haar_place place = haar_place_of(levels, density, load_at_most(z + i, offsets[pixels] - i));
        SCALAR cell[LANES], start[LANES], end[LANES];
        store(cell, place.cell);
        for (int lane = 0; lane < LANES; ++lane) {
            while (p < pixels - 1 && i + lane >= offsets[p + 1]) ++p;
            int k = (int)cell[lane];
            start[lane] = k > 0 ? ends[p * cells + k - 1] : (SCALAR)0.0;
            end[lane] = ends[p * cells + k];
        }
        real in_front = haar_absorbance(density, load(start), load(end), place.inside,
                                        own ? load(own + i) : K(0.0));
        store(T + i, absorbed ? in_front : exponential(-in_front));
    }
}

/* Constants let the compiler lay the levels out. */
#define FOR_LEVELS(call) \
    switch (levels) { \
    case 2: call(2); break; \
    case 3: call(3); break; \
    case 4: call(4); break; \
    case 5: call(5); break; \
    }

static void haar_sums_stage(int levels, bool density, bool as_half, int pixels,
                            const int32_t *offsets, const void *a, const void *z, void *c) {
#define HALF_SUMS(n) haar_half_sums_of(n, density, pixels, offsets, a, z, c)
#define SUMS(n) haar_sums_of(n, density, pixels, offsets, a, z, c)
    if (as_half) FOR_LEVELS(HALF_SUMS)
    else FOR_LEVELS(SUMS)
#undef SUMS
#undef HALF_SUMS
}

static void haar_cells_stage(int levels, bool density, int pixels, void *c) {
#define CELLS(n) \
    if (density) haar_cells_of_pixels(n, 1, pixels, c); \
    else haar_cells_of_pixels(n, 0, pixels, c)
    FOR_LEVELS(CELLS)
#undef CELLS
}

static void haar_transmittance_stage(int levels, bool density, int pixels, const int32_t *offsets,
                                     const void *z, const void *own, const void *ends,
                                     bool absorbed, void *T) {
#define TRANSMITTANCE(n) \
    haar_transmittance_of(n, density, pixels, offsets, z, own, ends, absorbed, T)
    FOR_LEVELS(TRANSMITTANCE)
#undef TRANSMITTANCE
}
#undef FOR_LEVELS
