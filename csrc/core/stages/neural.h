/* Stages of networks: what they see of pixels, with lanes over pixels, and what they say of
 * fragments, with lanes over these. */

#define WIDEST 32
#include "kernels/network.h"

#define NODES 2
#include "core/stages/bounded_of_count.h"
#undef NODES
#define NODES 3
#include "core/stages/bounded_of_count.h"
#undef NODES

static void bounded_transmittance_stage(int count, int pixels, const int32_t *offsets,
                                        const void *z, const void *own, const double *rules,
                                        const double *outlines, const void *b0,
                                        const float *network, bool absorbed, void *T) {
    switch (count) {
    case 4:
        bounded_transmittance_of2(pixels, offsets, z, own, rules, outlines, b0, network, absorbed,
                                  T);
        break;
    case 6:
        bounded_transmittance_of3(pixels, offsets, z, own, rules, outlines, b0, network, absorbed,
                                  T);
        break;
    }
}

static void bounded_features_stage(int count, int pixels, const int32_t *offsets, const void *z,
                                   const void *own, const double *rules, const double *outlines,
                                   const void *b0, const float *network, int64_t stride,
                                   void *features) {
    switch (count) {
    case 4:
        bounded_features_of2(pixels, offsets, z, own, rules, outlines, b0, network, stride,
                             features);
        break;
    case 6:
        bounded_features_of3(pixels, offsets, z, own, rules, outlines, b0, network, stride,
                             features);
        break;
    }
}

#ifndef RULES /* float tables only */
static void bounded_by_rows_stage(int count, int pixels, const int32_t *offsets, const float *z,
                                  const float *own, const float *rows, const float *b0,
                                  const float *network, bool absorbed, float *T) {
    switch (count) {
    case 4: bounded_by_rows_of2(pixels, offsets, z, own, rows, b0, network, absorbed, T); break;
    case 6: bounded_by_rows_of3(pixels, offsets, z, own, rows, b0, network, absorbed, T); break;
    }
}
#define BOUNDED_BY_ROWS_STAGE bounded_by_rows_stage
#endif

#ifdef RULES
static void bounded_rows_stage(int count, int pixels, const float *b, const float *b0, double bias,
                               const double *safe, double least, const double *extents,
                               const float *network, float *rows) {
    switch (count) {
    case 4: bounded_rows_of2(pixels, b, b0, bias, safe, least, extents, network, rows); break;
    case 6: bounded_rows_of3(pixels, b, b0, bias, safe, least, extents, network, rows); break;
    }
}

static void bounded_outlines_stage(int count, int pixels, const double *rules, const double *b0,
                                   const double *extents, const float *network, double *outlines) {
    switch (count) {
    case 4: outlines_of2(pixels, rules, b0, extents, network, outlines); break;
    case 6: outlines_of3(pixels, rules, b0, extents, network, outlines); break;
    }
}
#define BOUNDED_OUTLINES_STAGE bounded_outlines_stage
#define BOUNDED_ROWS_STAGE bounded_rows_stage
#define BOUNDED_BY_ROWS_STAGE NULL
#else
#define BOUNDED_OUTLINES_STAGE NULL
#define BOUNDED_ROWS_STAGE NULL
#endif
