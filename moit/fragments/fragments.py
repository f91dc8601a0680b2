"""Fragments: the transparent samples of an image, as every technique takes them."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from typing import Any, ClassVar, NoReturn

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from moit import _core
from moit.checks.arrays import Arrays, integers, real_arrays
from moit.checks.exceptions import FragmentsError, FragmentsTypeError
from moit.checks.windows import MOST, MOST_PIXELS, interval, origin_of, range_of, size_of
from moit.fragments.display import fragments_html
from moit.fragments.frame import Frame
from moit.system.environment import thread_count

Real = NDArray[np.float32] | NDArray[np.float64]
Index = NDArray[np.int64]

ARRAYS = ("depth", "alpha", "color", "transmission")


class Fragments:
    """The transparent samples of an image: per pixel a list in arrival order.

    offsets : (P+1,) integers; pixel p owns fragments offsets[p]:offsets[p+1]. First 0, never
        decreasing, last N.
    depth : (N,) distance from the eye along the view axis, finite, in any unit; larger is farther.
    alpha : (N,) opacity in [0, 1].
    color : (N, 3) linear radiance, not multiplied by alpha; finite, may exceed 1. None: these
        fragments have curves but no image.
    transmission : (N, 3) in [0, 1]: a channel passes 1 - alpha (1 - transmission), and the
        fragment adds alpha color all the same; `coverage` is what it takes away. None: none.
    shape : (height, width), whose product is P; by default (1, P).
    depth_range : (near, far), what depth warps use, near <= far; by default the least and the
        greatest depth present, (1.0, 1.0) where there are no fragments. A fragment outside a
        given range is an error; ends are rounded to the dtype held before they are compared.
    origin : (y, x), display coordinates of the first pixel.
    dtype : float32 or float64. None: float64 where depth, alpha, color or transmission is a
        float64 array, float32 otherwise.
    frame : the display window, the pixel aspect and the metadata of the file that they come from,
        for the file that is made of them. None: from none. No answer hangs on it.

    Arrays are NumPy's or anything with `__array__`, the buffer protocol or DLPack on the CPU.
    C-contiguous arrays of the right dtype are used without a copy, others are converted once;
    offsets are always copied. What is held is read-only; changes of the caller's array show.

    Raises FragmentsError (a ValueError), which names the argument, the first bad index, what was
    found and what was needed; where a type is wrong the error is a TypeError too.

    >>> f = moit.Fragments([0, 2], [1.0, 2.0], [0.5, 0.5], [[1, 0, 0], [0, 1, 0]])
    >>> f.shape, len(f)
    ((1, 1), 2)
    """

    offsets: Index
    depth: Real
    alpha: Real
    color: Real | None
    transmission: Real | None
    shape: tuple[int, int]
    depth_range: tuple[float, float]
    origin: tuple[int, int]
    frame: Frame | None

    __slots__ = {
        "__weakref__": None,
        "alpha": "(N,) opacity in [0, 1].",
        "color": "(N, 3) linear radiance, not multiplied by alpha, or None.",
        "depth": "(N,) distance along the view axis.",
        "depth_range": "(near, far), what depth warps use.",
        "frame": "A moit.Frame: display window, pixel aspect, metadata; or None.",
        "offsets": "(P+1,) int64: pixel p owns fragments offsets[p]:offsets[p+1].",
        "origin": "(y, x), display coordinates of the first pixel.",
        "shape": "(height, width).",
        "transmission": "(N, 3) in [0, 1], or None.",
    }

    # What makes a picture (height, width, 3) for notebooks, and says what it shows: moit.questions
    # puts it here, so that fragments know nothing of techniques.
    _shown_as: ClassVar[Callable[[Fragments], tuple[NDArray[Any], str]] | None] = None

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
        frame: Frame | None = None,
    ) -> None:
        ends = integers(offsets, "offsets")
        if ends.ndim != 1 or len(ends) < 1:
            raise FragmentsError(f"offsets: expected (P+1,) with P >= 0, got {ends.shape}")
        size = (1, len(ends) - 1) if shape is None else size_of(shape)
        if size[0] * size[1] != len(ends) - 1:
            raise FragmentsError(
                f"shape: with offsets of shape {ends.shape}, height x width must be "
                f"{len(ends) - 1}; got {size[0]} x {size[1]}"
            )
        arrays = real_arrays(depth, alpha, color, transmission, dtype)
        if frame is not None and not isinstance(frame, Frame):
            raise FragmentsTypeError(f"frame: expected a Frame, got {type(frame).__name__}")
        self._check(ends.astype(np.int64), arrays, size, depth_range, origin, frame=frame)

    def _check(
        self,
        offsets: Index,
        arrays: Arrays,
        shape: tuple[int, int],
        depth_range: Sequence[float] | None,
        origin: Sequence[int],
        place: Callable[[int], str] = str,
        frame: Frame | None = None,
    ) -> None:
        """Looks at every number, then holds the arrays, which have the right types and shapes.

        place : the index of a fragment as messages give it: that in what the caller passed.
        """
        window = origin_of(origin)
        given = None if depth_range is None else range_of(depth_range)
        offsets = _frozen(offsets)
        near, far = given or (-math.inf, math.inf)
        fault = _core.check_fragments(offsets, *arrays, near, far)
        if fault is not None:
            _explain(*fault, offsets, dict(zip(ARRAYS, arrays, strict=True)), given, place)
        depth = arrays[0]
        if given is None:
            given = (float(depth.min()), float(depth.max())) if len(depth) else (1.0, 1.0)
        self._hold(offsets, arrays, shape, given, window, frame)

    def _hold(
        self,
        offsets: Index,
        arrays: Arrays,
        shape: tuple[int, int],
        depth_range: tuple[float, float],
        origin: tuple[int, int],
        frame: Frame | None = None,
    ) -> None:
        held = (offsets, *_each(arrays, _read_only), shape, depth_range, origin, frame)
        names = ("offsets", *ARRAYS, "shape", "depth_range", "origin", "frame")
        for name, value in zip(names, held, strict=True):
            object.__setattr__(self, name, value)

    @classmethod
    def _of_checked(
        cls,
        offsets: Index,
        arrays: Arrays,
        shape: tuple[int, int],
        depth_range: tuple[float, float],
        origin: tuple[int, int],
        frame: Frame | None = None,
    ) -> Fragments:
        """Fragments whose numbers come from others and need no second look."""
        f = object.__new__(cls)
        f._hold(_frozen(offsets), arrays, shape, depth_range, origin, frame)
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
        size = size_of(shape)
        at = integers(pixel, "pixel")
        arrays = real_arrays(depth, alpha, color, transmission, dtype)
        if at.shape != (len(arrays[0]),):
            raise FragmentsError(
                f"pixel: with depth of shape ({len(arrays[0])},), pixel must have the same; "
                f"got {at.shape}"
            )
        # A copy: the core counts first and then places.
        grouped = _core.group_by_pixel(np.array(at, np.int64), size[0] * size[1])
        if isinstance(grouped, int):
            raise FragmentsError(
                f"pixel[{grouped}]: found {at[grouped]}; needed at least 0 and below "
                f"{size[0]} x {size[1]} = {size[0] * size[1]}"
            )
        offsets, order = grouped
        f = object.__new__(cls)
        f._check(
            offsets,
            _taken(arrays, order),
            size,
            depth_range,
            origin,
            place=lambda i: str(order[i]),
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
        arrays = real_arrays(depth, alpha, color, transmission, dtype, dimensions=3)
        layers, height, width = arrays[0].shape
        pixels = height * width
        size = size_of((height, width))
        # Transposed, the slots of a pixel lie side by side.
        present = np.not_equal(arrays[1], 0).reshape(layers, pixels).T
        offsets = np.zeros(pixels + 1, np.int64)
        np.cumsum(present.sum(axis=1), out=offsets[1:])
        pixel, layer = np.nonzero(present)
        order = layer * pixels + pixel
        flat = _each(arrays, lambda a: a.reshape(layers * pixels, *a.shape[3:]))
        f = object.__new__(cls)
        f._check(
            offsets,
            _taken(flat, order),
            size,
            depth_range,
            origin,
            place=lambda i: ", ".join(map(str, np.unravel_index(order[i], arrays[0].shape))),
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

    @property
    def coverage(self) -> Real:
        """(N,) the net coverage: the mean over the channels of alpha (1 - transmission), in the
        dtype held; alpha itself where there is no transmission."""
        if self.transmission is None:
            return self.alpha
        opacity = self.alpha.astype(np.float64)[:, None] * (
            1 - self.transmission.astype(np.float64)
        )
        red, green, blue = opacity.astype(self.dtype).astype(np.float64).T
        net: Real = (red + ((green - red) + (blue - red)) / 3).astype(self.dtype)
        return net

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
        y0, y1 = interval(window[0], height, "row")
        x0, x1 = interval(window[1], width, "column")
        size = (y1 - y0, x1 - x0)
        begins = self.offsets[:-1].reshape(self.shape)[y0:y1, x0:x1].ravel()
        counts = self.offsets[1:].reshape(self.shape)[y0:y1, x0:x1].ravel() - begins
        offsets = np.zeros(len(begins) + 1, np.int64)
        np.cumsum(counts, out=offsets[1:])
        if size[1] == width and len(begins):  # whole rows lie side by side
            part = slice(begins[0], begins[0] + offsets[-1])
            arrays = _each(self._arrays(), lambda a: a[part])
        else:
            order = np.repeat(begins - offsets[:-1], counts)
            order += np.arange(len(order))
            arrays = _taken(self._arrays(), order)
        origin = (self.origin[0] + y0, self.origin[1] + x0)
        return Fragments._of_checked(offsets, arrays, size, self.depth_range, origin, self.frame)

    def _arrays(self) -> Arrays:
        return self.depth, self.alpha, self.color, self.transmission

    def _reordered(self, key: Real) -> Fragments:
        order = _core.depth_order(self.offsets, key, thread_count(None))
        arrays = _taken(self._arrays(), order)
        return Fragments._of_checked(
            self.offsets, arrays, self.shape, self.depth_range, self.origin, self.frame
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

    def _repr_html_(self) -> str:
        shown_as = type(self)._shown_as
        return fragments_html(self, *(shown_as(self) if shown_as else (None, "")))

    def __setattr__(self, name: str, value: object) -> NoReturn:
        raise AttributeError(f"Fragments do not change; {name!r} cannot be set")

    def __delattr__(self, name: str) -> NoReturn:
        raise AttributeError(f"Fragments do not change; {name!r} cannot be deleted")

    def __copy__(self) -> Fragments:
        return self

    def __reduce__(self) -> tuple[Any, ...]:
        facts = (self.shape, self.depth_range, self.origin, self.frame)
        return _restored, (type(self), self.offsets, self._arrays(), *facts)


def merge(fragments: Iterable[Fragments]) -> Fragments:
    """All the given fragments as one, in that arrival order.

    fragments : at least one. The window is the union of theirs by origin, and pixels that nobody
        covers are empty; depth_range is the union of theirs. The dtype is float64 where one is.
        What has no pixels adds nothing to the window, and what has neither fragments nor a range
        of its own adds nothing to the range. The frame is that of the first that has one.

    Color must be present in all or none; transmission that only some have is 0 in the others.
    Raises FragmentsError, also where windows lie so far apart that their union is mostly empty.

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
    columns = zip(*(part._arrays() for part in parts), strict=True)
    depth, alpha, color, transmission = (_joined(column, lengths, dtype) for column in columns)
    arrays = _taken((depth, alpha, color, transmission), order)
    depth_range = _union_of_ranges(parts, dtype)
    frame = next((part.frame for part in parts if part.frame is not None), None)
    return Fragments._of_checked(offsets, arrays, (height, width), depth_range, (top, left), frame)


def _joined(arrays: Sequence[Any], lengths: list[int], dtype: np.dtype[Any]) -> Any:
    """One after the other, (length, 3) zeros for each that is absent; None if all are."""
    if all(a is None for a in arrays):
        return None
    zero = np.zeros((1, 3), dtype)
    pairs = zip(arrays, lengths, strict=True)
    present = [np.broadcast_to(zero, (n, 3)) if a is None else a for a, n in pairs]
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


def _union_of_ranges(parts: list[Fragments], dtype: np.dtype[Any]) -> tuple[float, float]:
    ranges = [part.depth_range for part in parts if len(part) or part.depth_range != (1.0, 1.0)]
    # A float32 depth may lie beyond its range's end by that end's rounding: see `Fragments`.
    for part in parts:
        if len(part) and part.dtype != dtype:
            near, far = (float(part.dtype.type(end)) for end in part.depth_range)
            ranges.append((near, far))
    ranges = ranges or [(1.0, 1.0)]
    return min(near for near, _ in ranges), max(far for _, far in ranges)


def _pixels_within(part: Fragments, top: int, left: int, width: int) -> Index:
    """(N,) the pixel of each fragment in a window of that width that starts at (top, left)."""
    y, x = np.ogrid[: part.shape[0], : part.shape[1]]
    pixel = (y + (part.origin[0] - top)) * width + (x + (part.origin[1] - left))
    return np.repeat(pixel.ravel(), part.counts)


def _restored(
    cls: type[Fragments],
    offsets: Index,
    arrays: Arrays,
    shape: tuple[int, int],
    depth_range: tuple[float, float],
    origin: tuple[int, int],
    frame: Frame | None = None,
) -> Fragments:
    f = object.__new__(cls)
    f._check(offsets, arrays, shape, depth_range, origin, frame=frame)
    return f


def _frozen(offsets: Index) -> Index:
    """A copy that nobody can change: the core's loops rely on offsets."""
    if isinstance(offsets.base, bytes):
        return offsets
    return np.frombuffer(offsets.tobytes(), np.int64)


def _read_only(array: NDArray[Any]) -> NDArray[Any]:
    view = array.view()
    view.flags.writeable = False
    return view


def _each(arrays: Arrays, changed: Callable[[NDArray[Any]], NDArray[Any]]) -> Arrays:
    depth, alpha, *others = arrays
    color, transmission = (None if a is None else changed(a) for a in others)
    return changed(depth), changed(alpha), color, transmission


def _taken(arrays: Arrays, order: Index) -> Arrays:
    return _each(arrays, lambda a: np.take(a, order, axis=0))


def _explain(
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
    elif name == "depth" and depth_range is not None and np.isfinite(found):
        needed = f"a depth within depth_range = {depth_range}"
    else:
        needed = f"a finite {array.dtype}"
    at = place(index) if array.ndim == 1 else f"{place(index // 3)}, {index % 3}"
    raise FragmentsError(f"{name}[{at}]: found {found}; needed {needed}")
