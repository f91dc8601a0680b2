"""Fragments: the transparent samples of an image, as every technique takes them."""

from __future__ import annotations

import math
import operator
import os
from collections.abc import Callable, Iterable, Sequence
from typing import Any, NoReturn

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from moit import _core
from moit.arrays import as_array, integers, shape_text
from moit.exceptions import FragmentsError, FragmentsTypeError

Real = NDArray[np.float32] | NDArray[np.float64]
Index = NDArray[np.int64]

# An image's side and its origin are 32-bit integers, as in OpenEXR's windows.
MOST = 2**31 - 1

NEEDED = {
    "depth": "a finite number",
    "alpha": "a number in [0, 1]",
    "color": "a finite number",
    "transmission": "a number in [0, 1]",
}


class Fragments:
    """The transparent samples of an image: per pixel a list in arrival order.

    offsets : (P+1,) integers; pixel p owns fragments offsets[p]:offsets[p+1]. First 0, never
        decreasing, last N.
    depth : (N,) distance from the eye along the view axis, finite, in any unit; larger is farther.
    alpha : (N,) opacity in [0, 1].
    color : (N, 3) linear radiance, not multiplied by alpha; finite, may exceed 1. None: these
        fragments have curves but no image.
    transmission : (N, 3) in [0, 1]: a channel passes 1 - alpha (1 - transmission). None: none.
    shape : (height, width), whose product is P; by default (1, P).
    depth_range : (near, far), what depth warps use, near <= far; by default the least and the
        greatest depth present, (1.0, 1.0) where there are no fragments. A fragment outside a
        given range is an error; ends are rounded to the dtype held before they are compared.
    origin : (y, x), display coordinates of the first pixel.
    dtype : float32 or float64. None: float64 where depth, alpha, color or transmission is a
        float64 array, float32 otherwise.

    Arrays are NumPy's or anything with `__array__`, the buffer protocol or DLPack on the CPU.
    C-contiguous arrays of the right dtype are used without a copy, others are converted once;
    offsets are always copied. What is held is read-only; changes of the caller's array show.

    Raises FragmentsError (a ValueError), which names the argument, the first bad index, what was
    found and what was needed; where a type is wrong the error is a TypeError too.
    """

    offsets: Index
    depth: Real
    alpha: Real
    color: Real | None
    transmission: Real | None
    shape: tuple[int, int]
    depth_range: tuple[float, float]
    origin: tuple[int, int]

    __slots__ = {
        "__weakref__": None,
        "alpha": "(N,) opacity in [0, 1].",
        "color": "(N, 3) linear radiance, not multiplied by alpha, or None.",
        "depth": "(N,) distance along the view axis.",
        "depth_range": "(near, far), what depth warps use.",
        "offsets": "(P+1,) int64: pixel p owns fragments offsets[p]:offsets[p+1].",
        "origin": "(y, x), display coordinates of the first pixel.",
        "shape": "(height, width).",
        "transmission": "(N, 3) in [0, 1], or None.",
    }

    def __init__(
        self,
        offsets: ArrayLike,
        depth: ArrayLike,
        alpha: ArrayLike,
        color: ArrayLike | None = None,
        *,
        transmission: ArrayLike | None = None,
        shape: Sequence[int] | None = None,
        depth_range: Sequence[float] | None = None,
        origin: Sequence[int] = (0, 0),
        dtype: DTypeLike | None = None,
    ) -> None:
        ends = integers(offsets, "offsets")
        if ends.ndim != 1 or len(ends) < 1:
            raise FragmentsError(
                f"offsets: expected (P+1,) with P >= 0 pixels, got {shape_text(ends)}"
            )
        arrays = _real_arrays(depth, alpha, color, transmission, dtype)
        # A copy in bytes: nobody can change what the core's loops rely on.
        held = np.frombuffer(ends.astype(np.int64).tobytes(), np.int64)
        size = (1, len(held) - 1) if shape is None else _size(shape)
        if size[0] * size[1] != len(held) - 1:
            raise FragmentsError(
                f"shape: with offsets of shape {shape_text(held)}, height x width must be "
                f"{len(held) - 1}; got {size[0]} x {size[1]}"
            )
        self._hold(held, *arrays, size, _range(depth_range), _origin(origin))

    def _hold(
        self,
        offsets: Index,
        depth: Real,
        alpha: Real,
        color: Real | None,
        transmission: Real | None,
        shape: tuple[int, int],
        depth_range: tuple[float, float] | None,
        origin: tuple[int, int],
        where: Callable[[int], str] = str,
        check: bool = True,
    ) -> None:
        """Checks and keeps arrays of the right type and shape.

        where : how the index of a fragment reads in a message; other constructors have other
            indices than offsets imply.
        check : False where all numbers come from checked fragments.
        """
        if check:
            near, far = (-math.inf, math.inf) if depth_range is None else depth_range
            fault = _core.check_fragments(offsets, depth, alpha, color, transmission, near, far)
            if fault is not None:
                arrays = {
                    "offsets": offsets,
                    "depth": depth,
                    "alpha": alpha,
                    "color": color,
                    "transmission": transmission,
                }
                _explain(*fault, arrays, depth_range, where)
        if depth_range is None:
            depth_range = (float(depth.min()), float(depth.max())) if len(depth) else (1.0, 1.0)
        held = {
            "offsets": offsets,
            "depth": depth,
            "alpha": alpha,
            "color": color,
            "transmission": transmission,
            "shape": shape,
            "depth_range": depth_range,
            "origin": origin,
        }
        for name, value in held.items():
            if isinstance(value, np.ndarray):
                value = value.view()
                value.flags.writeable = False
            object.__setattr__(self, name, value)

    @classmethod
    def _of_checked(cls, offsets: Index, *held: Any) -> Fragments:
        f = object.__new__(cls)
        f._hold(np.frombuffer(offsets.tobytes(), np.int64), *held, check=False)
        return f

    @classmethod
    def from_pixels(
        cls,
        pixel: ArrayLike,
        depth: ArrayLike,
        alpha: ArrayLike,
        color: ArrayLike | None = None,
        *,
        shape: Sequence[int],
        transmission: ArrayLike | None = None,
        depth_range: Sequence[float] | None = None,
        origin: Sequence[int] = (0, 0),
        dtype: DTypeLike | None = None,
    ) -> Fragments:
        """Fragments from a list in any order, such as the dump of a G-buffer.

        pixel : (N,) integers in [0, height x width): y * width + x of each fragment. Fragments of
            one pixel keep their order.
        shape : (height, width).

        The rest is as for `Fragments`; indices in messages are those of the arrays given.
        """
        size = _size(shape)
        at = integers(pixel, "pixel")
        arrays = _real_arrays(depth, alpha, color, transmission, dtype)
        if at.shape != arrays[0].shape:
            raise FragmentsError(
                f"pixel: with depth of shape {shape_text(arrays[0])}, pixel must have the same; "
                f"got {shape_text(at)}"
            )
        pixels = size[0] * size[1]
        # A copy: the core counts first and then places.
        grouped = _core.group_by_pixel(np.array(at, np.int64), pixels)
        if isinstance(grouped, int):
            raise FragmentsError(
                f"pixel[{grouped}]: found {at[grouped]}; needed a pixel of {size[0]} x {size[1]}, "
                f"at least 0 and below {pixels}"
            )
        offsets, order = grouped
        f = object.__new__(cls)
        f._hold(
            np.frombuffer(offsets.tobytes(), np.int64),
            *_taken(arrays, order),
            size,
            _range(depth_range),
            _origin(origin),
            where=lambda i: str(order[i]),
        )
        return f

    @classmethod
    def from_layers(
        cls,
        depth: ArrayLike,
        alpha: ArrayLike,
        color: ArrayLike | None = None,
        *,
        transmission: ArrayLike | None = None,
        depth_range: Sequence[float] | None = None,
        origin: Sequence[int] = (0, 0),
        dtype: DTypeLike | None = None,
    ) -> Fragments:
        """Fragments from K images, one a layer; a pixel's fragments arrive in the layers' order.

        depth, alpha : (K, height, width). Alpha 0 marks an empty slot, where nothing else matters.
        color, transmission : (K, height, width, 3).

        The rest is as for `Fragments`; indices in messages are (layer, y, x).
        """
        arrays = _real_arrays(depth, alpha, color, transmission, dtype, dimensions=3)
        layers, height, width = arrays[0].shape
        size = _size((height, width))
        taken = np.moveaxis(arrays[1] != 0, 0, -1).reshape(height * width, layers)
        offsets = np.zeros(height * width + 1, np.int64)
        np.cumsum(taken.sum(axis=1), out=offsets[1:])
        pixel, layer = np.nonzero(taken)
        order = layer * (height * width) + pixel
        flat = [a if a is None else a.reshape(-1, *a.shape[3:]) for a in arrays]
        f = object.__new__(cls)
        f._hold(
            np.frombuffer(offsets.tobytes(), np.int64),
            *_taken(flat, order),
            size,
            _range(depth_range),
            _origin(origin),
            where=lambda i: ", ".join(
                str(k) for k in np.unravel_index(order[i], (layers, height, width))
            ),
        )
        return f

    @property
    def counts(self) -> Index:
        """(P,) int64: the number of fragments of each pixel."""
        return np.diff(self.offsets)

    @property
    def dtype(self) -> np.dtype[Any]:
        """float32 or float64: that of depth, alpha, color and transmission."""
        return self.depth.dtype

    def __len__(self) -> int:
        return len(self.depth)

    def __getitem__(self, window: tuple[int | slice, int | slice]) -> Fragments:
        """f[y, x] or f[y0:y1, x0:x1]: the window's fragments, with this depth_range.

        Steps other than 1 raise IndexError, as do single indices out of range; anything but two
        integers or slices raises TypeError.
        """
        if not isinstance(window, tuple) or len(window) != 2:
            raise TypeError("Fragments are indexed by row and column: f[y, x] or f[y0:y1, x0:x1]")
        height, width = self.shape
        y0, y1 = _interval(window[0], height, "row")
        x0, x1 = _interval(window[1], width, "column")
        size = (y1 - y0, x1 - x0)
        begins = self.offsets[:-1].reshape(self.shape)[y0:y1, x0:x1].ravel()
        counts = self.offsets[1:].reshape(self.shape)[y0:y1, x0:x1].ravel() - begins
        offsets = np.zeros(len(begins) + 1, np.int64)
        np.cumsum(counts, out=offsets[1:])
        arrays: Sequence[Real | None] = (self.depth, self.alpha, self.color, self.transmission)
        if size[1] == width and len(begins):
            part = slice(begins[0], begins[0] + offsets[-1])
            arrays = [a if a is None else a[part] for a in arrays]
        else:
            order = np.repeat(begins - offsets[:-1], counts)
            order += np.arange(len(order))
            arrays = _taken(arrays, order)
        origin = (self.origin[0] + y0, self.origin[1] + x0)
        return Fragments._of_checked(offsets, *arrays, size, self.depth_range, origin)

    def _reordered(self, key: Real) -> Fragments:
        order = _core.depth_order(self.offsets, key, _threads())
        arrays = _taken((self.depth, self.alpha, self.color, self.transmission), order)
        return Fragments._of_checked(
            self.offsets, *arrays, self.shape, self.depth_range, self.origin
        )

    def sorted(self) -> Fragments:
        """The same fragments, each pixel's front to back; equal depths keep their order."""
        return self._reordered(self.depth)

    def shuffled(self, seed: Any) -> Fragments:
        """The same fragments, each pixel's in a random order.

        seed : what `numpy.random.default_rng` takes; the same integer gives the same order.
        """
        return self._reordered(np.random.default_rng(seed).random(len(self)))

    def __repr__(self) -> str:
        height, width = self.shape
        words = [f"{height}x{width}", f"{len(self):,} fragments"]
        if len(self):
            words.append(f"at most {self.counts.max():,} a pixel")
        words.append(str(self.dtype))
        words.append(f"depth {self.depth_range[0]:.4g} to {self.depth_range[1]:.4g}")
        words += [name for name in ("color", "transmission") if getattr(self, name) is not None]
        if self.origin != (0, 0):
            words.append(f"origin {self.origin}")
        return f"Fragments({', '.join(words)})"

    def __setattr__(self, name: str, value: object) -> NoReturn:
        raise AttributeError(f"Fragments do not change; {name!r} cannot be set")

    def __delattr__(self, name: str) -> NoReturn:
        raise AttributeError(f"Fragments do not change; {name!r} cannot be deleted")

    def __copy__(self) -> Fragments:
        return self

    def __reduce__(self) -> tuple[Any, ...]:
        held = (getattr(self, name) for name in ("depth", "alpha", "color", "transmission"))
        return _restored, (self.offsets, *held, self.shape, self.depth_range, self.origin)


def merge(fragments: Iterable[Fragments]) -> Fragments:
    """All the given fragments as one, in that arrival order.

    fragments : at least one. The window is the union of theirs by origin, and pixels that nobody
        covers are empty; depth_range is the union of theirs. The dtype is float64 where one is.

    Color must be present in all or none. Transmission that only some have is 0 in the others.
    Raises FragmentsError, also where windows lie so far apart that their union is mostly empty.
    """
    parts = list(fragments)
    for i, part in enumerate(parts):
        if not isinstance(part, Fragments):
            raise TypeError(f"merge: expected Fragments, got {type(part).__name__} at {i}")
    if not parts:
        raise FragmentsError("merge: needed at least one Fragments, got none")
    colored = [part.color is not None for part in parts]
    if any(colored) and not all(colored):
        raise FragmentsError(
            f"merge: color must be present in all or in none; found it at {colored.index(True)}, "
            f"not at {colored.index(False)}"
        )
    top, left = (min(part.origin[k] for part in parts) for k in (0, 1))
    bottom, right = (max(part.origin[k] + part.shape[k] for part in parts) for k in (0, 1))
    size = (bottom - top, right - left)
    pixels = size[0] * size[1]
    if pixels > max(2**26, 64 * sum(len(part.offsets) for part in parts)) or max(size) > MOST:
        raise FragmentsError(
            f"merge: the windows lie so far apart that their union has {size[0]} x {size[1]} "
            "pixels; needed origins near one another"
        )
    dtype = np.result_type(*(part.dtype for part in parts))
    pixel = np.concatenate([_pixels_within(part, top, left, size[1]) for part in parts])
    offsets, order = _core.group_by_pixel(pixel, pixels)

    def joined(name: str) -> Real | None:
        arrays = [getattr(part, name) for part in parts]
        if all(a is None for a in arrays):
            return None
        arrays = [
            np.zeros((len(p), 3), dtype) if a is None else a
            for a, p in zip(arrays, parts, strict=True)
        ]
        return np.take(np.concatenate(arrays, dtype=dtype), order, axis=0)

    near = min(part.depth_range[0] for part in parts)
    far = max(part.depth_range[1] for part in parts)
    names = ("depth", "alpha", "color", "transmission")
    return Fragments._of_checked(offsets, *map(joined, names), size, (near, far), (top, left))


def _pixels_within(part: Fragments, top: int, left: int, width: int) -> Index:
    """(N,) the pixel of each fragment in a window of that width that starts at (top, left)."""
    y, x = np.ogrid[: part.shape[0], : part.shape[1]]
    pixel = (y + (part.origin[0] - top)) * width + (x + (part.origin[1] - left))
    return np.repeat(pixel.ravel(), part.counts)


def _restored(offsets: Index, *held: Any) -> Fragments:
    f = object.__new__(Fragments)
    f._hold(np.frombuffer(offsets.tobytes(), np.int64), *held)
    return f


def _threads() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _taken(arrays: Iterable[Real | None], order: Index) -> list[Any]:
    return [a if a is None else np.take(a, order, axis=0) for a in arrays]


def _real_arrays(
    depth: ArrayLike,
    alpha: ArrayLike,
    color: ArrayLike | None,
    transmission: ArrayLike | None,
    dtype: DTypeLike | None,
    dimensions: int = 1,
) -> tuple[Any, Any, Any, Any]:
    """The four arrays, C-contiguous and of one dtype, their shapes checked."""
    given = {"depth": depth, "alpha": alpha, "color": color, "transmission": transmission}
    found = {name: as_array(a, name) for name, a in given.items() if a is not None}
    for name, a in found.items():
        if a.dtype.kind not in "fiu":
            raise FragmentsTypeError(f"{name}: expected real numbers, got {a.dtype}")
    for name in ("depth", "alpha"):
        if name not in found:
            raise FragmentsTypeError(f"{name}: expected an array, got None")
    first = found["depth"]
    if first.ndim != dimensions:
        expected = "(N,)" if dimensions == 1 else "(K, height, width)"
        raise FragmentsError(f"depth: expected {expected}, got {shape_text(first)}")
    for name, a in found.items():
        expected_shape = first.shape if name in ("depth", "alpha") else (*first.shape, 3)
        if a.shape != expected_shape:
            raise FragmentsError(
                f"{name}: with depth of shape {shape_text(first)}, {name} must be "
                f"{shape_text(expected_shape)}; got {shape_text(a)}"
            )
    if dtype is None:
        double = any(a.dtype == np.float64 for a in found.values())
        held: np.dtype[Any] = np.dtype(np.float64 if double else np.float32)
    else:
        held = _dtype(dtype)
    with np.errstate(over="ignore"):  # what became infinite is reported as such
        ready = {
            name: np.require(a.astype(held, copy=False), None, "CA") for name, a in found.items()
        }
    return ready["depth"], ready["alpha"], ready.get("color"), ready.get("transmission")


def _dtype(dtype: DTypeLike) -> np.dtype[Any]:
    try:
        held = np.dtype(dtype)
    except TypeError as error:
        raise FragmentsTypeError(f"dtype: expected float32, float64 or None: {error}") from None
    if held not in (np.float32, np.float64):
        raise FragmentsTypeError(f"dtype: expected float32, float64 or None, got {held}")
    return held.newbyteorder("=")


def _pair(value: Any, name: str) -> tuple[Any, Any]:
    try:
        first, second = value
    except (TypeError, ValueError):
        raise FragmentsError(f"{name}: expected a pair, got {value!r:.80}") from None
    return first, second


def _integer_pair(value: Any, name: str) -> tuple[int, int]:
    pair = _pair(value, name)
    try:
        if any(isinstance(v, (bool, np.bool_)) for v in pair):
            raise TypeError
        return operator.index(pair[0]), operator.index(pair[1])
    except TypeError:
        raise FragmentsTypeError(
            f"{name}: expected two integers, got {pair[0]!r:.40} and {pair[1]!r:.40}"
        ) from None


def _size(shape: Any) -> tuple[int, int]:
    height, width = _integer_pair(shape, "shape")
    if not (0 <= height <= MOST and 0 <= width <= MOST):
        raise FragmentsError(
            f"shape: expected (height, width), each at least 0 and at most {MOST}; "
            f"got ({height}, {width})"
        )
    return height, width


def _origin(origin: Any) -> tuple[int, int]:
    y, x = _integer_pair(origin, "origin")
    if not (-MOST <= y <= MOST and -MOST <= x <= MOST):
        raise FragmentsError(
            f"origin: expected (y, x), each at least {-MOST} and at most {MOST}; got ({y}, {x})"
        )
    return y, x


def _range(depth_range: Any) -> tuple[float, float] | None:
    if depth_range is None:
        return None
    pair = _pair(depth_range, "depth_range")
    try:
        if any(isinstance(v, (str, bytes, bool, np.bool_)) for v in pair):
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


def _interval(index: Any, length: int, name: str) -> tuple[int, int]:
    """[begin, end) of what an integer or a slice means along a side of that length."""
    if isinstance(index, slice):
        begin, end, step = index.indices(length)
        if step != 1:
            raise IndexError(f"{name}: windows have step 1, got {step}")
        return begin, max(begin, end)
    if isinstance(index, (bool, np.bool_)):
        raise TypeError(f"{name}: expected an integer or a slice, got {index!r}")
    try:
        at = operator.index(index)
    except TypeError:
        raise TypeError(
            f"{name}: expected an integer or a slice, got {type(index).__name__}"
        ) from None
    if not -length <= at < length:
        raise IndexError(f"{name} {at} is out of range for {length}")
    at %= length
    return at, at + 1


def _explain(
    name: str,
    index: int,
    arrays: dict[str, Any],
    depth_range: tuple[float, float] | None,
    where: Callable[[int], str],
) -> NoReturn:
    """Raises what `_core.check_fragments` found: number `index` of the flat array `name`."""
    array = arrays[name]
    found = array.reshape(-1)[index]
    if name == "offsets":
        if index == 0 and found != 0:
            needed = "0"
        elif index and found < array[index - 1]:
            needed = f"at least offsets[{index - 1}] = {array[index - 1]}"
        else:
            needed = f"the number of fragments, len(depth) = {len(arrays['depth'])}"
        raise FragmentsError(f"offsets[{index}]: found {found}; needed {needed}")
    place = where(index) if array.ndim == 1 else f"{where(index // 3)}, {index % 3}"
    needed = NEEDED[name]
    if name == "depth" and depth_range is not None and np.isfinite(found):
        needed = f"a depth within depth_range = {depth_range}"
    raise FragmentsError(f"{name}[{place}]: found {found}; needed {needed}")
