/* Stages of deep fragments. Behind neural.h and series.h. */

#include "kernels/deep_fragments.h"

enum {
    DEEP_FIRST_Z,
    DEEP_SECOND_Z,
    DEEP_LAST_Z,
    DEEP_B0,
    DEEP_FIRST_A,
    DEEP_SECOND_A,
    DEEP_THROUGH, /* the two nearest */
    DEEP_FRONT,   /* their colour */
    DEEP_NEAR = DEEP_FRONT + 3,
    DEEP_NEAR_COLOR, /* and behind it the other guess's */
    DEEP_TAIL = DEEP_NEAR_COLOR + 6,
    DEEP_SHARE,
    DEEP_COVERED, /* by the tail, in the image */
    DEEP_COLOR,
    DEEP_TOTAL = DEEP_COLOR + 3,
    DEEP_BEHIND_FIRST,
};
_Static_assert((int)DEEP_COLOR == (int)MOIT_DEEP_COLOR, "as stages.h says");
_Static_assert((int)DEEP_BEHIND_FIRST < (int)MOIT_DEEP_RAY, "a ray has room");
enum { DEEP_SUMS = MOIT_DEEP_SUMS };
_Static_assert((int)DEEP_LAST_Z == (int)MOIT_DEEP_LAST_Z && (int)DEEP_B0 == (int)MOIT_DEEP_B0
                   && (int)DEEP_TAIL == (int)MOIT_DEEP_TAIL
                   && (int)DEEP_SHARE == (int)MOIT_DEEP_SHARE
                   && (int)DEEP_COVERED == (int)MOIT_DEEP_COVERED,
               "as stages.h says");
_Static_assert((int)DEEP_NEAR == (int)MOIT_DEEP_NEAR, "of the rays' numbers");

/* The two nearest of n fragments, the earlier of equals first: rank 0 and 1, others 2. */
FN void rank_two(int n, const SCALAR *depth, int32_t *rank, int nearest[2]) {
    int first = 0, second = -1;
    for (int i = 1; i < n; ++i) {
        if (depth[i] < depth[first]) {
            second = first;
            first = i;
        } else if (second < 0 || depth[i] < depth[second]) second = i;
    }
    for (int i = 0; i < n; ++i) rank[i] = 2;
    rank[first] = 0;
    if (second >= 0) rank[second] = 1;
    nearest[0] = first;
    nearest[1] = second;
}

FN double quads_of(int n, const SCALAR *a) {
    quad sum = {0};
    for (int i = 0; i < n; i += 4) {
        quad x = load_quad(a + i);
        if (n - i < 4) x = (quad)((quad_truth)x & ((quad_truth){0, 1, 2, 3} < n - i));
        sum += x;
    }
    return quad_sum(sum);
}

/* The tail's sums as half floats hold them, one fragment blended in after the other. */
FN void blend_tail(int n, const SCALAR *a, const SCALAR *z, const SCALAR *color,
                   const int32_t *rank, const SCALAR *ray, SCALAR *sums) {
    SCALAR held[MOST_TERMS + LANES] = {0};
    for (int i = 0; i < n; i += CHUNK) {
        int count = n - i < CHUNK ? n - i : CHUNK;
        chunk_terms terms = {{0}};
        for (int j = 0; j < count; j += LANES) {
            SCALAR behind[LANES] = {0}, channel[3][LANES] = {{0}};
            for (int k = 0; k < LANES && j + k < count; ++k) {
                if (rank[i + j + k] > 1) behind[k] = a[i + j + k];
                for (int c = 0; color && c < 3; ++c) channel[c][k] = color[3 * (i + j + k) + c];
            }
            real absorbs = load(behind);
            real near = absorbs
                        * even_transmittance(K(ray[DEEP_B0]), K(ray[DEEP_SECOND_Z]),
                                             K(ray[DEEP_LAST_Z]), load(z + i + j));
            store(terms[0] + j, near);
            for (int c = 0; c < 3; ++c) {
                store(terms[1 + c] + j, near * load(channel[c]));
                store(terms[4 + c] + j, absorbs * load(channel[c]));
            }
        }
        blend_chunk(DEEP_SUMS, count, terms, held);
    }
    memcpy(sums, held, DEEP_SUMS * sizeof *sums);
}

static void deep_capture_stage(int pixels, const int32_t *offsets, const void *depth_,
                               const void *alpha_, const void *a_, const void *z_,
                               const void *color_, int32_t *rank, void *rays_) {
    const SCALAR *depth = depth_, *alpha = alpha_, *a = a_, *z = z_, *color = color_;
    SCALAR *ray = rays_;
    for (int p = 0; p < pixels; ++p, ray += MOIT_DEEP_RAY) {
        int start = offsets[p], n = offsets[p + 1] - start, nearest[2] = {-1, -1};
        memset(ray, 0, MOIT_DEEP_RAY * sizeof *ray);
        ray[DEEP_THROUGH] = 1;
        if (n == 0) continue;
        rank_two(n, depth + start, rank + start, nearest);
        SCALAR last = z[start];
        for (int i = start + 1; i < start + n; ++i) last = z[i] > last ? z[i] : last;
        ray[DEEP_LAST_Z] = rounded_to_half(K(last))[0];
        ray[DEEP_B0] = (SCALAR)quads_of(n, a + start);
        for (int k = 0; k < 2 && nearest[k] >= 0; ++k) {
            int at = start + nearest[k];
            SCALAR seen = ray[DEEP_THROUGH] * alpha[at];
            ray[DEEP_FIRST_Z + k] = z[at];
            if (k == 0) ray[DEEP_SECOND_Z] = z[at];
            ray[DEEP_FIRST_A + k] = a[at];
            for (int c = 0; color && c < 3; ++c) ray[DEEP_FRONT + c] += seen * color[3 * at + c];
            ray[DEEP_THROUGH] = ray[DEEP_THROUGH] * (1 - alpha[at]);
            if (k == 0) ray[DEEP_BEHIND_FIRST] = ray[DEEP_THROUGH];
        }
        if (n > 2)
            blend_tail(n, a + start, z + start, color ? color + 3 * start : NULL, rank + start, ray,
                       ray + DEEP_NEAR);
    }
}

/* A number of the rays from `from` on, a ray a lane; beyond the last those of the first. */
FN real ray_lanes(const SCALAR *rays, int from, int pixels, int number) {
    SCALAR lanes[LANES];
    for (int k = 0; k < LANES; ++k)
        lanes[k] = rays[(from + k < pixels ? from + k : from) * MOIT_DEEP_RAY + number];
    return load(lanes);
}

FN void set_ray_lanes(SCALAR *rays, int from, int pixels, int number, real x) {
    for (int k = 0; k < LANES && from + k < pixels; ++k)
        rays[(from + k) * MOIT_DEEP_RAY + number] = x[k];
}

FN values deep_features_of(const SCALAR *rays, int p, int pixels, real tail) {
    return deep_features(
        tail, ray_lanes(rays, p, pixels, DEEP_NEAR), ray_lanes(rays, p, pixels, DEEP_FIRST_Z),
        ray_lanes(rays, p, pixels, DEEP_SECOND_Z), ray_lanes(rays, p, pixels, DEEP_LAST_Z));
}

static void deep_resolve_stage(const float *network, int pixels, void *rays_) {
    SCALAR *rays = rays_;
    for (int p = 0; p < pixels; p += LANES) {
        real through = ray_lanes(rays, p, pixels, DEEP_THROUGH),
             near = ray_lanes(rays, p, pixels, DEEP_NEAR);
        real tail = tail_absorbance(ray_lanes(rays, p, pixels, DEEP_B0),
                                    ray_lanes(rays, p, pixels, DEEP_FIRST_A),
                                    ray_lanes(rays, p, pixels, DEEP_SECOND_A));
        values seen = deep_features_of(rays, p, pixels, tail);
        real share = deep_share(network, seen, near);
        real covered = through * covered_by(tail);
        set_ray_lanes(rays, p, pixels, DEEP_TAIL, tail);
        set_ray_lanes(rays, p, pixels, DEEP_SHARE, share);
        set_ray_lanes(rays, p, pixels, DEEP_COVERED, covered);
        set_ray_lanes(rays, p, pixels, DEEP_TOTAL, through * seen.x[2]);
        for (int c = 0; c < 3; ++c) {
            real color =
                deep_color(covered, share, ray_lanes(rays, p, pixels, DEEP_NEAR_COLOR + c), near,
                           ray_lanes(rays, p, pixels, DEEP_NEAR_COLOR + 3 + c), tail);
            set_ray_lanes(rays, p, pixels, DEEP_COLOR + c,
                          ray_lanes(rays, p, pixels, DEEP_FRONT + c) + color);
        }
    }
}

/* T of a pixel's fragments from i on, if the share were `share`. */
FN real deep_lanes(const SCALAR *ray, real share, const SCALAR *alpha, const SCALAR *a,
                   const SCALAR *z, const int32_t *rank, int i, int left) {
    real b0 = K(ray[DEEP_B0]), last = K(ray[DEEP_LAST_Z]);
    real even = even_transmittance(b0, K(ray[DEEP_SECOND_Z]), last, load(z + i));
    real T =
        deep_transmittance(K(ray[DEEP_THROUGH]), K(ray[DEEP_COVERED]), share, K(ray[DEEP_NEAR]),
                           K(ray[DEEP_TAIL]), load(a + i), even, load_at_most(alpha + i, left));
    for (int k = 0; k < LANES && k < left; ++k)
        if (rank[i + k] < 2) T[k] = rank[i + k] ? ray[DEEP_BEHIND_FIRST] : 1;
    return T;
}

static void deep_transmittance_stage(int pixels, const int32_t *offsets, const void *alpha,
                                     const void *a, const void *z, const int32_t *rank,
                                     const void *rays, void *T_) {
    const SCALAR *ray = rays;
    SCALAR *T = T_;
    for (int p = 0; p < pixels; ++p, ray += MOIT_DEEP_RAY)
        for (int i = offsets[p]; i < offsets[p + 1]; i += LANES)
            store(T + i,
                  deep_lanes(ray, K(ray[DEEP_SHARE]), alpha, a, z, rank, i, offsets[p + 1] - i));
}

static void deep_features_stage(int pixels, const int32_t *offsets, const void *alpha,
                                const void *a, const void *z, const int32_t *rank, const void *rays,
                                int64_t stride, void *features_) {
    const SCALAR *ray = rays;
    SCALAR *features = features_;
    for (int p = 0; p < pixels; ++p, ray += MOIT_DEEP_RAY) {
        values seen = deep_features(K(ray[DEEP_TAIL]), K(ray[DEEP_NEAR]), K(ray[DEEP_FIRST_Z]),
                                    K(ray[DEEP_SECOND_Z]), K(ray[DEEP_LAST_Z]));
        for (int i = offsets[p]; i < offsets[p + 1]; i += LANES) {
            int left = offsets[p + 1] - i;
            truth mixed = K(ray[DEEP_NEAR]) > 0.0;
            real all = deep_lanes(ray, K(0.0), alpha, a, z, rank, i, left);
            real near = deep_lanes(ray, select(mixed, K(1.0), K(0.0)), alpha, a, z, rank, i, left);
            for (int k = 0; k < DEEP_FEATURES; ++k)
                store_at_most(features + k * stride + i, seen.x[k], left);
            store_at_most(features + DEEP_FEATURES * stride + i, all, left);
            store_at_most(features + (DEEP_FEATURES + 1) * stride + i, near - all, left);
        }
    }
}
