/* Lists by tile: counted, then filled. */
#include "core/tile_lists.h"

#include <stdlib.h>
#include <string.h>

moit_status moit_list_by_tile(int columns, int rows, int64_t count,
                              moit_tile_box (*box_of)(const void *context, int64_t i),
                              const void *context, int64_t **first, int32_t **listed) {
    int64_t tiles = (int64_t)columns * rows;
    int64_t *next = *first = calloc((size_t)tiles + 2, sizeof **first);
    if (!next) return MOIT_NO_MEMORY;
    /* first it counts in next[tile + 1], then it lists from next[tile] on */
    for (int fills = 0; fills < 2; ++fills) {
        for (int64_t i = 0; i < count; ++i) {
            moit_tile_box b = box_of(context, i);
            for (int y = b.top; y < b.bottom; ++y)
                for (int x = b.left; x < b.right; ++x) {
                    int64_t *at = &next[(int64_t)y * columns + x + 1];
                    if (fills) (*listed)[*at] = (int32_t)i;
                    ++*at;
                }
        }
        if (fills) break;
        for (int64_t t = 0; t < tiles; ++t) next[t + 1] += next[t];
        *listed = malloc((size_t)(next[tiles] + 1) * sizeof **listed);
        if (!*listed) return MOIT_NO_MEMORY;
        /* listing moves each tile's start to its end, which is where the next one starts */
        memmove(next + 1, next, (size_t)tiles * sizeof *next);
        next[0] = 0;
    }
    return MOIT_OK;
}
