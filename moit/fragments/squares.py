"""Squares of pixels that an image is cut into, as csrc/core/squares.c has them."""

from __future__ import annotations

import dataclasses

from moit.fragments.fragments import Fragments


@dataclasses.dataclass(frozen=True)
class Squares:
    """Squares of so many pixels a side, which count from display coordinates (0, 0): the first has
    left and top pixels beyond the image."""

    side: int
    left: int
    top: int
    across: int
    down: int

    @property
    def count(self) -> int:
        return self.across * self.down


def squares_of(f: Fragments, side: int) -> Squares:
    """Those that an image is cut into."""
    height, width = f.shape
    top, left = (origin % side for origin in f.origin)
    across, down = (left + width + side - 1) // side, (top + height + side - 1) // side
    return Squares(side, left, top, across, down)
