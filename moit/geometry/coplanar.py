"""Surfaces that lie in one plane but for rounding: which of them is in front says draw order."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from moit.geometry.drawing import Emitted

Array = NDArray[Any]


def by_draw_order(arrays: Emitted, tolerance: float) -> Emitted:
    """Fragments of all surfaces, of which those that differ by up to `tolerance` get one depth.

    The nearest opaque fragment of a pixel, and what lies so near to it, get its depth; what is
    behind is left out, and of several opaque ones among them the first that was drawn is kept, and
    comes first. From the nearest one on others do the same with those behind them.
    """
    offsets, depth, alpha, color, *thick = arrays
    counts = np.diff(offsets)
    pixel = np.repeat(np.arange(len(counts)), counts)
    away = depth.astype(np.float64)
    opaque = alpha == 1
    wall = np.full(len(counts), np.inf)
    np.minimum.at(wall, pixel[opaque], away[opaque])
    keep = away <= wall[pixel] + tolerance
    first = np.flatnonzero(opaque & keep)  # of a pixel's, in draw order
    first = first[np.unique(pixel[first], return_index=True)[1]]
    keep &= ~opaque
    keep[first] = True

    level = away.copy()
    near_wall = keep & (away >= wall[pixel] - tolerance)
    level[near_wall] = wall[pixel[near_wall]]
    left = np.flatnonzero(keep & ~near_wall)
    left = left[np.lexsort((away[left], pixel[left]))]
    while len(left):
        own = pixel[left]
        begins = np.append(True, own[1:] != own[:-1])
        nearest = away[left[begins]][np.cumsum(begins) - 1]
        together = away[left] <= nearest + tolerance
        level[left[together]] = nearest[together]
        left = left[~together]

    order = np.flatnonzero(keep)
    order = order[np.lexsort((~opaque[order], pixel[order]))]
    ends = np.concatenate([[0], np.cumsum(np.bincount(pixel[order], minlength=len(counts)))])
    level = level.astype(depth.dtype)
    if thick:  # what is moved is moved as a whole
        thick[0] = np.where(thick[0] > depth, np.maximum(thick[0], level), level)
    arrays = (level, alpha, color, *thick)
    return ends, *(one[order] for one in arrays)
