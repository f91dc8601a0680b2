"""What is opaque, and the depth range of what is not."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from moit.checks.arrays import Arrays

REACH = 3.0  # deviations that a Gaussian reaches in a range that nobody gave


def opaque_fragments(arrays: Arrays) -> NDArray[np.bool_]:
    """(N,) whether nothing of any channel gets through."""
    alpha, transmission = arrays[1], arrays[3]
    opaque: NDArray[np.bool_] = alpha == 1
    if transmission is not None and opaque.any():
        opaque &= (transmission == 0).all(axis=1)
    return opaque


def default_range(arrays: Arrays) -> tuple[tuple[float, float], bool]:
    """The depth_range of fragments that are given none, and whether it is that of something
    transparent, beside which what is opaque does not count."""
    span, transparent = stated_range(arrays)
    depth, deviation = arrays[0], arrays[6]
    if deviation is None or not transparent or not deviation.any():
        return span, transparent
    thick = (deviation > 0) & ~opaque_fragments(arrays)
    middle, reach = (a[thick].astype(np.float64) for a in (depth, deviation))
    if not len(middle):
        return span, transparent
    most = float(np.finfo(depth.dtype).max)
    with np.errstate(over="ignore"):
        reach = REACH * reach
        first = np.where(middle > 0, np.maximum(middle - reach, middle / 8), middle - reach)
        near, far = max(float(first.min()), -most), min(float((middle + reach).max()), most)
    return (min(span[0], near), max(span[1], far)), True


def stated_range(arrays: Arrays) -> tuple[tuple[float, float], bool]:
    """The same of depth and back alone, whatever the deviations are."""
    depth, back, opaque = arrays[0], arrays[4], opaque_fragments(arrays)
    if not len(depth):
        return (1.0, 1.0), False
    rest = ~opaque if opaque.any() else np.s_[:]
    transparent = len(depth[rest]) > 0
    shown = rest if transparent else np.s_[:]
    near, far = depth[shown], (depth if back is None else back)[shown]
    return (float(near.min()), float(far.max())), transparent


def union_of_ranges(ranges: Iterable[tuple[tuple[float, float], bool]]) -> tuple[float, float]:
    """Of ranges, each with whether it counts beside others; what does not, counts alone."""
    found = list(ranges)
    counting = [span for span, counts in found if counts] or [span for span, _ in found]
    counting = counting or [(1.0, 1.0)]
    return min(near for near, _ in counting), max(far for _, far in counting)


def with_far_background(arrays: Arrays) -> Arrays:
    """The same with opaque fragments at infinity as far away as numbers go."""
    opaque = opaque_fragments(arrays)

    def reached(depth: NDArray[Any]) -> NDArray[Any]:
        return np.where(np.isposinf(depth) & opaque, np.finfo(depth.dtype).max, depth)

    depth, alpha, color, transmission, back, *others = arrays
    emission, deviation = others
    ends = None if back is None else reached(back)
    return reached(depth), alpha, color, transmission, ends, emission, deviation
