/* What is drawn, listed by the tiles of a picture. */
#ifndef MOIT_TILE_LISTS_H
#define MOIT_TILE_LISTS_H

#include "moit.h"

/* Tiles [left, right) of rows [top, bottom); none where an end is not beyond its start. */
typedef struct moit_tile_box {
    int left, top, right, bottom;
} moit_tile_box;

/* Of `count` things, the i-th in the tiles of box_of(context, i), all of them in the picture:
 * *listed, things of each tile in their order, those of tile t from (*first)[t] to (*first)[t + 1].
 * Both are the caller's to free, also where there was no memory. */
moit_status moit_list_by_tile(int columns, int rows, int64_t count,
                              moit_tile_box (*box_of)(const void *context, int64_t i),
                              const void *context, int64_t **first, int32_t **listed);

#endif
