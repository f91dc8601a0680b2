"""Anchors: fragments that matter most occlude exactly, cells between them hold the rest."""

from __future__ import annotations

import dataclasses
from typing import Any, ClassVar

import numpy as np

from moit import _core
from moit.catalog.options import whole, within
from moit.catalog.reconstruction import WarpedDepth

MOST_KEPT = _core.numbers()["MOST_KEPT"]
MOST_CELLS = _core.numbers()["MOST_CELLS"]
MOST_GAMMA = 32.0  # beyond, all but the nearest are of no importance


@dataclasses.dataclass(frozen=True)
class Anchors(WarpedDepth):
    """The fragments that matter most occlude exactly, and absorbance in cells between them.

    kept : 1 to 16 fragments of a pixel, anywhere on the ray: those with the greatest
        alpha exp(-gamma u), u being warped depth in [0, 1].
    cells : 1 to 16 equal parts of the pixel's extent, which with the depths that are kept cut it
        into `kept` + `cells` cells for the absorbance of all others.
    gamma : 0 to 32: how much nearness counts beside alpha. From 3 to 6 it makes little difference;
        a looser depth_range asks for more.
    warp : "log" (depth must be positive), "linear", or "none": depth lies in [0, 1] already.
    depth_range : what maps to [0, 1]: "image", the fragments' depth_range, or "pixel", each pixel's
        own extent.
    normalize : what is kept counts as it is; the colours of all others are scaled to cover what is
        left, by a quarter to four, and then all so that weights sum to what is covered. That takes
        a second accumulator of colours.
    max_alpha : in (0, 1): larger alpha is taken for this in logarithms.

    Three passes, without order: the greatest keys (6 bits of importance, 16 of depth, 10 of the
    root of 1 - alpha) by atomic maxima, and the pixel's extent; sums of absorbance by atomic
    additions; then shading. Keys and sums are whole numbers, so an answer has the same bits in
    whatever order fragments arrive. A fragment that is not kept sees what is kept in front of it,
    the cells in front of its own, and of its own cell, without itself, as much as it lies inside.
    A cell tells up to 20 nepers, in steps of 1/2048. Fragments that let all but a thousandth
    through are never kept. Of several with the least key that is kept, those without a place are
    counted in cells, as are all others. Transmittance is as the state says, before colours are
    scaled. Bounds are what the state proves: kept ones to the rounding of their alpha, and a
    cell's absorbance anywhere in it. Ours.

    bits_per_pixel : keys of 32 bits, cells and extents of 16, and 64 for the second accumulator.

    >>> str(moit.Anchors(4, cells=2))
    'anchors4(cells=2)'
    """

    kept: int
    cells: int = 4
    gamma: float = 4.0

    kind: ClassVar[str] = "anchors"
    counted: ClassVar[str] = "kept"
    source: ClassVar[str] = "ours"

    def __post_init__(self) -> None:
        whole(self, "kept", 1, MOST_KEPT)
        whole(self, "cells", 1, MOST_CELLS)
        within(self, "gamma", 0, MOST_GAMMA)
        super().__post_init__()

    @property
    def excludes_self(self) -> bool:
        return True

    @property
    def bits_per_pixel(self) -> float | None:
        held = 32 * self.kept + 16 * (self.kept + self.cells) + 32
        return held + 64 * self.normalize + self._extent_bits

    def fields_for_core(self, dtype: np.dtype[Any]) -> dict[str, Any]:
        return {
            **super().fields_for_core(dtype),
            "count": self.kept,
            "cells": self.cells,
            "gamma": self.gamma,
        }
