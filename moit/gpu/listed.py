"""Pictures whose fragments a GPU lists and the host reads, some rows at a time if need be."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
from numpy.typing import NDArray

from moit.fragments.fragments import Fragments
from moit.geometry.rasterizer import in_range
from moit.gpu.meshes import Drawing

Array = NDArray[Any]


class Listed:
    """The fragments of a picture, as moit.geometry.rasterizer.Picture has them.

    span, coplanar : as `in_range` takes them.
    """

    def __init__(
        self, drawing: Drawing, span: tuple[float, float] | None, coplanar: float | None = None
    ) -> None:
        self.drawing, self.span, self.coplanar = drawing, span, coplanar
        self.size = drawing.width, drawing.height
        with drawing.device:
            drawing.draw_occluders(np.zeros(3), cutouts=False)
            counted = drawing.count_fragments(with_solid=True)
            counts = np.empty(drawing.width * drawing.height + 1, np.uint32)
            counted.read(counts)
        of_rows = counts[:-1].reshape(drawing.height, drawing.width).sum(axis=1, dtype=np.int64)
        self.before = np.concatenate([[0], np.cumsum(of_rows)])
        self.last_asked = [(0, drawing.height)]

    def bands(self, most: int) -> list[tuple[int, int]]:
        """Rows [top, bottom) of no more fragments than `most`, but at least one row."""
        self.last_asked = self._bands_within(0, self.size[1], most)
        return self.last_asked

    def rows(self, top: int, bottom: int) -> Fragments:
        """Of rows [top, bottom), with the depth_range of the whole."""
        f = self._own(top, bottom)
        if (top, bottom) == (0, self.size[1]):
            return f
        return Fragments._of_checked(
            f.offsets, f._arrays(), f.shape, self._depth_range, (top, 0), f.frame
        )

    def whole(self) -> Fragments:
        return self.rows(0, self.size[1])

    @functools.cached_property
    def _depth_range(self) -> tuple[float, float]:
        """Of all rows, which are listed once more for it, so that no more is held at once."""
        near, far = (float(np.float32(end)) for end in self.span or (np.inf, -np.inf))
        for band in self.last_asked:
            f = self._own(*band)
            if len(f):
                near, far = min(near, f.depth_range[0]), max(far, f.depth_range[1])
        return (near, far) if near <= far else (1.0, 1.0)

    def _own(self, top: int, bottom: int) -> Fragments:
        """Those of rows, with the depth_range that they would have alone."""
        parts = [
            self._read(*band)
            for band in self._bands_within(top, bottom, self.drawing.most_fragments)
        ]
        counts = np.concatenate([part[0] for part in parts])
        arrays = [np.concatenate(some) for some in zip(*(part[1] for part in parts), strict=True)]
        if len(arrays) == 4:  # a Gaussian ends where it is, as surfaces do
            arrays.insert(3, arrays[0])
        offsets = np.concatenate([[0], np.cumsum(counts, dtype=np.int64)])
        one: Any = (offsets, *arrays)
        return in_range(one, self.span, (self.size[0], bottom - top), self.coplanar)

    def _bands_within(self, top: int, bottom: int, most: int) -> list[tuple[int, int]]:
        found = []
        while top < bottom:
            end = int(np.searchsorted(self.before, self.before[top] + most, side="right")) - 1
            found.append((top, min(max(end, top + 1), bottom)))
            top = found[-1][1]
        return found

    def _read(self, top: int, bottom: int) -> tuple[Array, list[Array]]:
        """Counts of the pixels of rows, and depth, alpha, colour and deviation of fragments."""
        drawing, width = self.drawing, self.size[0]
        with drawing.device:
            lists = drawing.list_fragments(with_solid=True, rows=(top, bottom))
            offsets = np.empty(width * (bottom - top) + 1, np.uint32)
            lists.offsets.read(offsets, 4 * width * top)
            buffers = [lists.depth, lists.alpha, lists.color]
            shapes: list[Any] = [lists.count, lists.count, (lists.count, 3)]
            if lists.deviation is not None:
                buffers.append(lists.deviation)
                shapes.append(lists.count)
            arrays = [np.empty(shape, np.float32) for shape in shapes]
            for buffer, array in zip(buffers, arrays, strict=True):
                if array.size:
                    buffer.read(array)
        return np.diff(offsets), arrays
