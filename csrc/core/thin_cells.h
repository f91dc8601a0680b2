/* Thick fragments as points that cells of depth tell apart. */
#ifndef MOIT_THIN_CELLS_H
#define MOIT_THIN_CELLS_H

#include "core/extents.h"

typedef struct {
    moit_warp warp;
    double near, far; /* that cells are of */
    int cells;        /* even in warped depth */
} moit_cells;

/* Where a point goes, and its share of the fragment's absorbance; these add up to 1. */
typedef void moit_give_point(void *context, double depth, double share);

/* An extent's points from front to back, its absorbance being so many `steps`. What is linear in
 * warped depth within each cell, as what two slices around a cell are given, is of the points what
 * it is of the extent, but for less than a step: all points but one are of whole steps, so that
 * only one of them is rounded where steps are counted. Returns how many there are, at least 1. */
int moit_points_of_cells(const moit_extent *extent, const moit_cells *cells, double steps,
                         moit_give_point *give, void *context);

#endif
