/* Stages of splats, in float only. */

#ifdef RULES
#define SPLAT_STAGE NULL
#else
#include "core/splats.h"
#include "kernels/splats.h"

static void splat_stage(const moit_screen_splat *s, int left, int top,
                        const moit_tile_pixels *pixels, bool front_to_back, SCALAR *through,
                        SCALAR *alpha, SCALAR *depth) {
    /* from the tile's corner: what is far from the picture's keeps its digits */
    const real x = K(s->x - left), y = K(s->y - top), opacity = K(s->opacity),
               least = K(front_to_back ? LEAST_SEEN : -1.0);
    real square[3], lane;
    for (int k = 0; k < 3; ++k) square[k] = K(s->square[k]);
    for (int k = 0; k < LANES; ++k) lane[k] = (SCALAR)k;
    const int first = pixels->left / LANES * LANES;
    for (int row = pixels->top; row < pixels->bottom; ++row)
        for (int column = first; column < pixels->right; column += LANES) {
            const int i = row * MOIT_SPLAT_TILE + column;
            real dx = K(column) + lane - x, dy = K(row) - y;
            real away = square_of_splat(dx, dy, square), z = K(s->depth[0]);
            if (!s->flat) {
                real planes[3] = {K(s->along[3]), K(s->along[4]), K(s->along[5])};
                real over = (K(s->along[0]) + K(s->along[1]) * dx + K(s->along[2]) * dy)
                            + square_of_splat(dx, dy, planes);
                away = away / over;
                z = (z + K(s->depth[1]) * dx + K(s->depth[2]) * dy) / over;
            }
            if (depth) store(depth + i, z);
            real here = alpha_of_splat(away, opacity), before = load(through + i);
            /* what would leave less than `least` is left out, and all that follows it */
            real after = before * (1.0 - here);
            truth there = BOTH(BOTH(here > 0.0, z >= K(s->nearest)), before >= 0.0),
                  ends = BOTH(there, after < least);
            store(through + i, select(ends, K(-1.0), select(there, after, before)));
            store(alpha + i, select(ends, K(0.0), select(there, here, K(0.0))));
        }
}
#define SPLAT_STAGE splat_stage
#endif
