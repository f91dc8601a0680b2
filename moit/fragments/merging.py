"""Fragments of several as one."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from moit import _core
from moit.checks.exceptions import FragmentsError
from moit.checks.windows import MOST, MOST_PIXELS
from moit.fragments.fragments import ARRAYS, Fragments
from moit.fragments.held import Index, taken
from moit.fragments.ranges import default_range, opaque_fragments, union_of_ranges


def merge(fragments: Iterable[Fragments]) -> Fragments:
    """All the given fragments as one, in that arrival order.

    fragments : at least one. The window is the union of theirs by origin, and pixels that nobody
        covers are empty; depth_range is the union of theirs. The dtype is float64 where one is.
        What has no pixels adds nothing to the window, and what has neither fragments nor a range
        of its own adds nothing to the range; nor does what is all opaque and has the range that
        it has by default, unless all are such. The frame is that of the first that has one.

    Color must be present in all or none; of what only some have, transmission, emission and
    deviation are 0 in the others, and back is their depth. Volumes stay as they are:
    `Fragments.tidy` and questions split them where they overlap. Raises FragmentsError, also where
    windows lie so far apart that their union is mostly empty.

    >>> f = moit.Fragments([0, 2], [1.0, 2.0], [0.5, 0.5])
    >>> len(moit.merge([f, f]))
    4
    """
    if isinstance(fragments, Fragments) or not isinstance(fragments, Iterable):
        raise TypeError(f"merge: expected a list of Fragments, got {type(fragments).__name__}")
    parts = list(fragments)
    for i, part in enumerate(parts):
        if not isinstance(part, Fragments):
            raise TypeError(f"merge: expected Fragments, got {type(part).__name__} at {i}")
    if not parts:
        raise FragmentsError("merge: expected at least one Fragments, got none")
    colored = [part.color is not None for part in parts]
    if any(colored) and not all(colored):
        raise FragmentsError(
            f"merge: color must be present in all or in none; it is at {colored.index(True)} "
            f"and not at {colored.index(False)}"
        )
    top, left, height, width = _union_of_windows(parts)
    dtype = np.result_type(*(part.dtype for part in parts))
    pixel = np.concatenate([_pixels_within(part, top, left, width) for part in parts])
    grouped = _core.group_by_pixel(pixel, height * width)
    assert not isinstance(grouped, int)
    offsets, order = grouped

    lengths = [len(part) for part in parts]
    depth, alpha, color, transmission, back, emission, deviation = (
        [getattr(part, name) for part in parts] for name in ARRAYS
    )
    if any(one is not None for one in back):
        back = [near if one is None else one for near, one in zip(depth, back, strict=True)]
    columns = (depth, alpha, color, transmission, back, emission, deviation)
    joined: Any = tuple(_joined(column, lengths, dtype) for column in columns)
    arrays = taken(joined, order)
    depth_range = union_of_their_ranges(parts, dtype)
    frame = next((part.frame for part in parts if part.frame is not None), None)
    return Fragments._of_checked(offsets, arrays, (height, width), depth_range, (top, left), frame)


def _joined(arrays: Sequence[Any], lengths: list[int], dtype: np.dtype[Any]) -> Any:
    """One after the other, zeros for each that is absent; None if all are."""
    shape = next((a.shape[1:] for a in arrays if a is not None), None)
    if shape is None:
        return None
    zero = np.zeros((1, *shape), dtype)
    pairs = zip(arrays, lengths, strict=True)
    present = [np.broadcast_to(zero, (n, *shape)) if a is None else a for a, n in pairs]
    return np.concatenate(present, dtype=dtype)


def _union_of_windows(parts: list[Fragments]) -> tuple[int, int, int, int]:
    """(top, left, height, width)"""
    parts = [part for part in parts if len(part.offsets) > 1] or parts[:1]
    top, left = (min(part.origin[k] for part in parts) for k in (0, 1))
    height = max(part.origin[0] + part.shape[0] for part in parts) - top
    width = max(part.origin[1] + part.shape[1] for part in parts) - left
    # A pixel costs 8 bytes even where it is empty; a slip in an origin must not take all memory.
    if len(parts) > 1:
        most = max(2**26, 64 * sum(len(part.offsets) for part in parts))
        if height * width > min(most, MOST_PIXELS) or max(height, width) > MOST:
            raise FragmentsError(
                f"merge: the windows lie so far apart that their union has {height} x {width} "
                f"pixels; needed at most {most}"
            )
    return top, left, height, width


def union_of_their_ranges(parts: list[Fragments], dtype: np.dtype[Any]) -> tuple[float, float]:
    """The depth_range that `merge` gives them."""
    ranges = []
    for part in parts:
        if not len(part) and part.depth_range == (1.0, 1.0):
            continue
        arrays = part._arrays()
        all_opaque = bool(len(part)) and bool(opaque_fragments(arrays).all())
        counts = not all_opaque or part.depth_range != default_range(arrays)[0]
        ranges.append((part.depth_range, counts))
        # A float32 depth may lie beyond its range's end by that end's rounding: see `Fragments`.
        if len(part) and part.dtype != dtype:
            near, far = (float(part.dtype.type(end)) for end in part.depth_range)
            ranges.append(((near, far), counts))
    return union_of_ranges(ranges)


def _pixels_within(part: Fragments, top: int, left: int, width: int) -> Index:
    """(N,) the pixel of each fragment in a window of that width that starts at (top, left)."""
    y, x = np.ogrid[: part.shape[0], : part.shape[1]]
    pixel = (y + (part.origin[0] - top)) * width + (x + (part.origin[1] - left))
    return np.repeat(pixel.ravel(), part.counts)
