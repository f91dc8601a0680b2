"""Arrays that Fragments hold: which fragment is where, copies that do not change, and faults."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NoReturn

import numpy as np
from numpy.typing import ArrayLike, NDArray

from moit import _core
from moit.checks.arrays import Arrays, integers
from moit.checks.exceptions import FragmentsError, FragmentsTypeError

Index = NDArray[np.int64]


def frozen(offsets: Index) -> Index:
    """A copy that nobody can change: the core's loops rely on offsets."""
    return _core.frozen(offsets)


def read_only(array: NDArray[Any]) -> NDArray[Any]:
    view = array.view()
    view.flags.writeable = False
    return view


def each_of(arrays: Arrays, changed: Callable[[NDArray[Any]], NDArray[Any]]) -> Arrays:
    depth, alpha, *others = arrays
    color, transmission, back, emission, deviation = (
        None if a is None else changed(a) for a in others
    )
    return changed(depth), changed(alpha), color, transmission, back, emission, deviation


def taken(arrays: Arrays, order: Index) -> Arrays:
    return each_of(arrays, lambda a: np.take(a, order, axis=0))


def places_of(
    pixel: ArrayLike | None,
    x: ArrayLike | None,
    y: ArrayLike | None,
    count: int,
    size: tuple[int, int],
) -> Index:
    """(N,) where each fragment is: y * width + x, which the core holds against the pixels."""
    if (pixel is None) == (x is None) or (x is None) != (y is None):
        given = {"pixel": pixel, "x": x, "y": y}
        names = [name for name, value in given.items() if value is not None]
        raise FragmentsTypeError(
            f"pixel: expected integers, or x and y in its place; "
            f"got {' and '.join(names) or 'none of them'}"
        )
    if pixel is not None:
        return _indices(pixel, "pixel", count)
    column, row = _indices(x, "x", count), _indices(y, "y", count)
    for name, at, length in (("x", column, size[1]), ("y", row, size[0])):
        outside = (at < 0) | (at >= length)
        if outside.any():
            i = int(outside.argmax())
            raise FragmentsError(
                f"{name}[{i}]: found {at[i]}; needed at least 0 and below {length}"
            )
    return row * size[1] + column


def _indices(value: ArrayLike | None, name: str, count: int) -> Index:
    """(N,) a copy in int64, in which no product of two sides of an image wraps."""
    at = integers(value, name)
    if at.shape != (count,):
        raise FragmentsError(
            f"{name}: with depth of shape ({count},), {name} must have the same; got {at.shape}"
        )
    return np.array(at, np.int64)


def explain(
    name: str,
    index: int,
    offsets: Index,
    arrays: dict[str, Any],
    depth_range: tuple[float, float] | None,
    place: Callable[[int], str],
) -> NoReturn:
    """Raises what `_core.check_fragments` found: number `index` of the flat array `name`."""
    if name == "offsets":
        found = offsets[index]
        if index == 0 and found != 0:
            needed = "0"
        elif index and found < offsets[index - 1]:
            needed = f"at least offsets[{index - 1}] = {offsets[index - 1]}"
        else:
            needed = f"the number of fragments, len(depth) = {len(arrays['depth'])}"
        raise FragmentsError(f"offsets[{index}]: found {found}; needed {needed}")
    array = arrays[name]
    found = array.reshape(-1)[index]
    if name in ("alpha", "transmission"):
        needed = "a number in [0, 1]"
    elif name == "back" and found < arrays["depth"][index]:
        needed = f"at least depth, {arrays['depth'][index]}"
    elif name == "deviation" and not (np.isfinite(found) and found >= 0):
        needed = f"a finite {array.dtype}, at least 0"
    elif name == "deviation":
        needed = "0 where back is behind depth"
    elif name == "back" and depth_range is not None and np.isfinite(found):
        needed = f"a depth within depth_range = {depth_range}"
    elif name == "depth" and depth_range is not None and np.isfinite(found):
        needed = f"a depth within depth_range = {depth_range}"
    else:
        needed = f"a finite {array.dtype}"
    at = place(index) if array.ndim == 1 else f"{place(index // 3)}, {index % 3}"
    raise FragmentsError(f"{name}[{at}]: found {found}; needed {needed}")
