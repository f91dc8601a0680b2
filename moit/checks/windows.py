"""Where an image lies: its size, its origin, parts of it, and the range of its depths."""

from __future__ import annotations

import math
import operator
from typing import Any

import numpy as np

from moit.checks.exceptions import FragmentsError, FragmentsTypeError

# Sides and origins are 32-bit integers, as in OpenEXR's windows.
MOST = 2**31 - 1

# Products of this with the size of anything held per pixel stay within 64 bits.
MOST_PIXELS = 2**40


def size_of(shape: Any) -> tuple[int, int]:
    """(height, width), checked."""
    height, width = _two_integers(shape, "shape")
    if not (0 <= height <= MOST and 0 <= width <= MOST):
        raise FragmentsError(
            f"shape: expected (height, width), each at least 0 and at most {MOST}; "
            f"got ({height}, {width})"
        )
    if height * width > MOST_PIXELS:
        raise FragmentsError(
            f"shape: expected at most {MOST_PIXELS} pixels, got {height} x {width}"
        )
    return height, width


def picture_size(size: Any, most_side: int = MOST) -> tuple[int, int]:
    """(width, height) of a picture to be made, checked."""
    try:
        width, height = (operator.index(side) for side in size)
    except (TypeError, ValueError):
        raise TypeError(f"size: expected two integers (width, height), got {size!r:.80}") from None
    if min(width, height) < 1 or max(width, height) > most_side or width * height > MOST:
        raise ValueError(
            f"size: expected (width, height), each from 1 to {most_side} and together at most "
            f"{MOST} pixels; got ({width}, {height})"
        )
    return width, height


def origin_of(origin: Any) -> tuple[int, int]:
    """(y, x), checked."""
    y, x = _two_integers(origin, "origin")
    if not (-MOST <= y <= MOST and -MOST <= x <= MOST):
        raise FragmentsError(
            f"origin: expected (y, x), each at least {-MOST} and at most {MOST}; got ({y}, {x})"
        )
    return y, x


def range_of(depth_range: Any) -> tuple[float, float]:
    """(near, far), checked."""
    pair = _pair(depth_range, "depth_range")
    try:
        if any(isinstance(end, (str, bytes, bytearray, bool, np.bool_)) for end in pair):
            raise TypeError
        near, far = float(pair[0]), float(pair[1])
    except (TypeError, ValueError, OverflowError):
        raise FragmentsTypeError(
            f"depth_range: expected two numbers, got {pair[0]!r:.40} and {pair[1]!r:.40}"
        ) from None
    if not (math.isfinite(near) and math.isfinite(far) and near <= far):
        raise FragmentsError(
            f"depth_range: expected finite (near, far) with near <= far, got ({near}, {far})"
        )
    return near, far


def interval(index: Any, length: int, name: str) -> tuple[int, int]:
    """(begin, end) of what an integer or a slice means along a side of that length, as in NumPy.

    Raises IndexError for a step other than 1 and for an integer out of range, TypeError for
    anything but integers and slices.
    """
    if isinstance(index, slice):
        if index.step is not None and operator.index(index.step) != 1:
            raise IndexError(f"{name}: a window has step 1, got {index.step}")
        begin, end, _ = slice(index.start, index.stop).indices(length)
        return begin, max(begin, end)
    try:
        if isinstance(index, (bool, np.bool_)):
            raise TypeError
        at = operator.index(index)
    except TypeError:
        raise TypeError(
            f"{name}: expected an integer or a slice, got {type(index).__name__}"
        ) from None
    if not -length <= at < length:
        raise IndexError(f"{name} {at} is out of range for {length}")
    at %= length
    return at, at + 1


def _pair(value: Any, name: str) -> tuple[Any, Any]:
    try:
        first, second = value
    except (TypeError, ValueError):
        raise FragmentsTypeError(f"{name}: expected a pair, got {value!r:.80}") from None
    return first, second


def _two_integers(value: Any, name: str) -> tuple[int, int]:
    pair = _pair(value, name)
    try:
        if any(isinstance(v, (bool, np.bool_)) for v in pair):
            raise TypeError
        return operator.index(pair[0]), operator.index(pair[1])
    except TypeError:
        raise FragmentsTypeError(
            f"{name}: expected two integers, got {pair[0]!r:.40} and {pair[1]!r:.40}"
        ) from None
