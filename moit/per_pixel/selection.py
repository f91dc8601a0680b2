"""Some pixels of fragments, wherever they are."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from moit import _core
from moit.fragments.fragments import Fragments

Places = NDArray[np.int64]


def pixels_of(f: Fragments, pixels: Places, threads: int) -> Fragments:
    """The fragments of pixels (K,) in one row, with this depth_range; of all pixels, `f` itself."""
    if len(pixels) == len(f.counts):
        return f
    offsets, depth, alpha, color, transmission = _core.take_pixels(f, pixels, threads)
    arrays = (depth, alpha, color, transmission)
    return Fragments._of_checked(offsets, arrays, (1, len(pixels)), f.depth_range, (0, 0))


def fragments_of(f: Fragments, pixels: Places) -> Places:
    """Where the fragments of pixels are, in the pixels' order."""
    begins, counts = f.offsets[pixels], f.counts[pixels]
    ends = np.cumsum(counts)
    return np.repeat(begins - (ends - counts), counts) + np.arange(counts.sum())
