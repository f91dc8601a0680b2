/* Stages of series of depth. Lanes are fragments; the terms of up to a chunk of them are laid out
 * by coefficient, so that sums run in one order whatever the number of lanes. */

#include "kernels/fourier_opacity.h"
#include "kernels/transmittance_function.h"

enum { CHUNK = MOIT_PADDING, MOST_TERMS = 32 };
typedef SCALAR chunk_terms[MOST_TERMS][CHUNK];

/* Of the lanes at `p`, those of the first n; the others are 0. */
FN real first_lanes(real x, int n) {
    truth lane;
    for (int k = 0; k < LANES; ++k) lane[k] = k;
    return (real)((truth)x & (lane < (truth){0} + (bits)n));
}

/* Adds a chunk of n fragments. What the last four have too much is 0. */
FN void add_chunk(const int count, int n, const chunk_terms terms, quad *sum) {
    for (int k = 0; k < count; ++k)
        for (int i = 0; i < n; i += 4) sum[k] += load_quad(terms[k] + i);
}

/* Lanes of a vector loop over n numbers that is to leave whole quads. */
FN int whole_quads(int n) { return (n + 3) / 4 * 4; }

FN double quad_sum(quad s) { return (s[0] + s[1]) + (s[2] + s[3]); }

/* Blends a chunk of n fragments into half floats, one after the other; lanes are coefficients. */
FN void blend_chunk(const int count, int n, const chunk_terms terms, SCALAR *held) {
    SCALAR row[MOST_TERMS + LANES] = {0};
    for (int i = 0; i < n; ++i) {
        for (int k = 0; k < count; ++k) row[k] = terms[k][i];
        for (int k = 0; k < count; k += LANES)
            store(held + k, half_sum(load(held + k), load(row + k)));
    }
}

/* ---- Fourier opacity maps -------------------------------------------------------------------- */

FN void fourier_chunk(const int count, int n, const SCALAR *a, const SCALAR *z, chunk_terms terms) {
    const int harmonics = (count - 1) / 2;
    for (int i = 0; i < whole_quads(n); i += LANES) {
        real weight = first_lanes(load(a + i), n - i), d = first_lanes(load(z + i), n - i);
        fourier_series s = series_of_surface(harmonics, weight, d);
        store(terms[0] + i, s.mean);
        for (int k = 0; k < harmonics; ++k) {
            store(terms[1 + 2 * k] + i, s.cosine[k]);
            store(terms[2 + 2 * k] + i, s.sine[k]);
        }
    }
}

FN void fourier_sums_of(const int count, bool half, int pixels, const int32_t *offsets,
                        const SCALAR *a, const SCALAR *z, SCALAR *b) {
    for (int p = 0; p < pixels; ++p, b += count) {
        if (offsets[p] == offsets[p + 1]) {
            memset(b, 0, (size_t)count * sizeof *b);
            continue;
        }
        chunk_terms terms;
        quad sum[MOST_TERMS];
        SCALAR held[MOST_TERMS + LANES];
        for (int k = 0; k < count; ++k) sum[k] = (quad){0};
        for (int k = 0; k < count + LANES; ++k) held[k] = 0;
        for (int i = offsets[p], end = offsets[p + 1]; i < end; i += CHUNK) {
            int n = end - i < CHUNK ? end - i : CHUNK;
            fourier_chunk(count, n, a + i, z + i, terms);
            if (half) blend_chunk(count, n, terms, held);
            else add_chunk(count, n, terms, sum);
        }
        for (int k = 0; k < count; ++k) b[k] = half ? held[k] : (SCALAR)quad_sum(sum[k]);
    }
}

static void fourier_sums_stage(int count, bool half, int pixels, const int32_t *offsets,
                               const void *a, const void *z, void *b) {
    switch (count) { /* a constant count lets the compiler unroll */
    case 7: fourier_sums_of(7, half, pixels, offsets, a, z, b); break;
    case 15: fourier_sums_of(15, half, pixels, offsets, a, z, b); break;
    default: fourier_sums_of(count, half, pixels, offsets, a, z, b);
    }
}

FN void fourier_transmittance_of(const int count, int pixels, const int32_t *offsets,
                                 const SCALAR *z, const SCALAR *own, const SCALAR *b, bool absorbed,
                                 SCALAR *T) {
    const int harmonics = (count - 1) / 2;
    for (int p = 0; p < pixels; ++p, b += count) {
        if (offsets[p] == offsets[p + 1]) continue;
        fourier_series s;
        s.mean = K(b[0]);
        for (int k = 0; k < harmonics; ++k) {
            s.cosine[k] = K(b[1 + 2 * k]);
            s.sine[k] = K(b[2 + 2 * k]);
        }
        s = integrated(harmonics, s);
        for (int i = offsets[p]; i < offsets[p + 1]; i += LANES) {
            real in_front =
                series_absorbance(harmonics, s, load(z + i), own ? load(own + i) : K(0.0));
            store(T + i, absorbed ? in_front : exponential(-in_front));
        }
    }
}

static void fourier_transmittance_stage(int count, int pixels, const int32_t *offsets,
                                        const void *z, const void *own, const void *b,
                                        bool absorbed, void *T) {
    switch (count) {
    case 7: fourier_transmittance_of(7, pixels, offsets, z, own, b, absorbed, T); break;
    case 15: fourier_transmittance_of(15, pixels, offsets, z, own, b, absorbed, T); break;
    default: fourier_transmittance_of(count, pixels, offsets, z, own, b, absorbed, T);
    }
}

/* ---- Transmittance function maps ------------------------------------------------------------- */

FN void function_sums_of(const int count, bool half, int pixels, const int32_t *offsets,
                         const SCALAR *alpha, const SCALAR *T, const SCALAR *z, SCALAR *b,
                         double *total) {
    const int all = offsets[pixels];
    for (int p = 0; p < pixels; ++p, b += count) {
        if (offsets[p] == offsets[p + 1]) {
            memset(b, 0, (size_t)count * sizeof *b);
            b[0] = 1;
            continue;
        }
        chunk_terms terms;
        quad sum[MOST_TERMS];
        for (int k = 0; k < count; ++k) sum[k] = (quad){0};
        for (int i = offsets[p], end = offsets[p + 1]; i < end; i += CHUNK) {
            int n = end - i < CHUNK ? end - i : CHUNK;
            for (int j = 0; j < whole_quads(n); j += LANES) {
                int at = i + j < all ? i + j : all - 1;
                real w = load_at_most(alpha + at, all - at) * load(T + at);
                cosine_series s =
                    series_of_drop(count, first_lanes(w, n - j), first_lanes(load(z + at), n - j));
                for (int k = 0; k < count; ++k) store(terms[k] + j, s.c[k]);
            }
            add_chunk(count, n, terms, sum);
        }
        cosine_series s;
        for (int k = 0; k < count; ++k) s.c[k] = K(quad_sum(sum[k]));
        s = projected(count, s, K(total[p]));
        for (int k = 0; k < count; ++k) b[k] = (half ? rounded_to_half(s.c[k]) : s.c[k])[0];
        if (half) total[p] = (double)rounded_to_half(K(total[p]))[0];
    }
}

static void function_sums_stage(int count, bool half, int pixels, const int32_t *offsets,
                                const void *alpha, const void *T, const void *z, void *b,
                                double *total) {
    switch (count) {
    case 8: function_sums_of(8, half, pixels, offsets, alpha, T, z, b, total); break;
    default: function_sums_of(count, half, pixels, offsets, alpha, T, z, b, total);
    }
}

FN void function_transmittance_of(const int count, int pixels, const int32_t *offsets,
                                  const SCALAR *z, const SCALAR *alpha, double max_alpha,
                                  const SCALAR *b, const double *total, SCALAR *T) {
    const int all = offsets[pixels];
    for (int p = 0; p < pixels; ++p, b += count) {
        if (offsets[p] == offsets[p + 1]) continue;
        cosine_series s;
        for (int k = 0; k < count; ++k) s.c[k] = K(b[k]);
        for (int i = offsets[p]; i < offsets[p + 1]; i += LANES) {
            real own = alpha ? min(load_at_most(alpha + i, all - i), K(max_alpha)) : K(0.0);
            store(T + i, function_transmittance(count, s, K(total[p]), load(z + i), own));
        }
    }
}

static void function_transmittance_stage(int count, int pixels, const int32_t *offsets,
                                         const void *z, const void *alpha, double max_alpha,
                                         const void *b, const double *total, void *T) {
    switch (count) {
    case 8: function_transmittance_of(8, pixels, offsets, z, alpha, max_alpha, b, total, T); break;
    default: function_transmittance_of(count, pixels, offsets, z, alpha, max_alpha, b, total, T);
    }
}
