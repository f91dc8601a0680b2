/* Stages of neural moment transparency: what a pixel's network sees, with lanes over pixels, and
 * what it says of fragments, with lanes over these. Behind neural.h. */

#include "kernels/neural_moments.h"

/* Each pixel's extent as held, the first numbers of its ray, and depths as moments are taken of
 * them. */
FN void neural_extents_of(const int words, int pixels, const int32_t *offsets, const SCALAR *z,
                          SCALAR *ray, SCALAR *own) {
    for (int p = 0; p < pixels; ++p, ray += MOIT_NEURAL_RAY) {
        int start = offsets[p], end = offsets[p + 1];
        SCALAR nearest = 0, farthest = 0;
        if (start < end) nearest = farthest = z[start];
        for (int i = start + 1; i < end; ++i) {
            nearest = z[i] < nearest ? z[i] : nearest;
            farthest = z[i] > farthest ? z[i] : farthest;
        }
        /* the same as of rounded depths, as rounding keeps their order */
        neural_extent e = held_extent(words, K(nearest), K(farthest));
        ray[0] = e.nearest[0];
        ray[1] = e.farthest[0];
        for (int i = start; i < end; i += LANES)
            store(own + i, neural_depth(words, e, load(z + i)));
    }
}

static void neural_extents_stage(bool words, int pixels, const int32_t *offsets, const void *z,
                                 void *rays, void *own) {
    if (words) neural_extents_of(1, pixels, offsets, z, rays, own);
    else neural_extents_of(0, pixels, offsets, z, rays, own);
}

/* What lanes need of their rays, row by row. */
typedef struct {
    SCALAR nearest[BLOCK_ROW], farthest[BLOCK_ROW], total[BLOCK_ROW];
    SCALAR begun[NEURAL_FIRST]
                [BLOCK_ROW]; /* the first layer, as far as a pixel's fragments share it */
} neural_rows;

/* A number of the rays of a block from `r` on; beyond the last those of the first. */
FN real lanes_of_block(const ray_block *block, int r, const SCALAR *numbers, int width) {
    SCALAR lanes[LANES];
    for (int k = 0; k < LANES; ++k)
        lanes[k] = numbers[block->pixel[r + k < block->rays ? r + k : 0] * width];
    return load(lanes);
}

FN values neural_rows_of(const ray_block *block, const SCALAR *rays, const SCALAR *b, int r,
                         neural_rows *rows) {
    real power[4], b0 = lanes_of_block(block, r, rays + 3, MOIT_NEURAL_RAY);
    for (int k = 0; k < 4; ++k) power[k] = lanes_of_block(block, r, b + k, 4);
    store(rows->nearest + r, lanes_of_block(block, r, rays, MOIT_NEURAL_RAY));
    store(rows->farthest + r, lanes_of_block(block, r, rays + 1, MOIT_NEURAL_RAY));
    store(rows->total + r, exponential(-b0));
    return neural_features(lanes_of_block(block, r, rays + 2, MOIT_NEURAL_RAY), b0, power[0],
                           power[1], power[2], power[3]);
}

FN neural_extent extent_at(const int words, const neural_rows *rows, int ray, truth lane) {
    neural_extent e;
    e.nearest = lanes_of_row(rows->nearest + ray, lane);
    e.farthest = lanes_of_row(rows->farthest + ray, lane);
    e.blur = extent_blur(words);
    return e;
}

FN void neural_transmittance_of(const int words, const float *network, int pixels,
                                const int32_t *offsets, const SCALAR *z, const SCALAR *rays,
                                const SCALAR *b, SCALAR *T) {
    ray_block block;
    neural_rows rows;
    for (int p = 0; p < pixels;) {
        p = next_block(&block, p, pixels, offsets);
        for (int r = 0; r < block.rays; r += LANES) {
            values begun = neural_ray(network, neural_rows_of(&block, rays, b, r, &rows));
            for (int k = 0; k < NEURAL_FIRST; ++k) store(rows.begun[k] + r, begun.x[k]);
        }
        for (int i = block.first; i < block.end; i += LANES) {
            truth lane;
            int ray = first_ray(&block, i, &lane);
            values begun;
            for (int k = 0; k < NEURAL_FIRST; ++k)
                begun.x[k] = lanes_of_row(rows.begun[k] + ray, lane);
            neural_extent e = extent_at(words, &rows, ray, lane);
            real at = load(z + i);
            real said = neural_share(network, begun, relative_depth(words, e, at));
            store(T + i, neural_transmittance(e, lanes_of_row(rows.total + ray, lane), at, said));
        }
    }
}

static void neural_transmittance_stage(bool words, const float *network, int pixels,
                                       const int32_t *offsets, const void *z, const void *rays,
                                       const void *b, void *T) {
    if (words) neural_transmittance_of(1, network, pixels, offsets, z, rays, b, T);
    else neural_transmittance_of(0, network, pixels, offsets, z, rays, b, T);
}

static void neural_features_stage(bool words, int pixels, const int32_t *offsets, const void *z_,
                                  const void *rays, const void *b, int64_t stride,
                                  void *features_) {
    const SCALAR *z = z_;
    SCALAR *features = features_;
    ray_block block;
    neural_rows rows;
    for (int p = 0; p < pixels;) {
        p = next_block(&block, p, pixels, offsets);
        for (int r = 0; r < block.rays; r += LANES) {
            values seen = neural_rows_of(&block, rays, b, r, &rows);
            for (int k = 1; k < NEURAL_FEATURES; ++k) store(rows.begun[k] + r, seen.x[k - 1]);
        }
        for (int i = block.first; i < block.end; i += LANES) {
            truth lane;
            int ray = first_ray(&block, i, &lane), left = block.end - i;
            neural_extent e = extent_at(words, &rows, ray, lane);
            store_at_most(features + i, relative_depth(words, e, load(z + i)), left);
            for (int k = 1; k < NEURAL_FEATURES; ++k)
                store_at_most(features + k * stride + i, lanes_of_row(rows.begun[k] + ray, lane),
                              left);
        }
    }
}
