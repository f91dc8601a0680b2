"""Fragments: the transparent samples of an image, as every technique takes them."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, ClassVar, NoReturn

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from moit import _core
from moit.checks.arrays import Arrays, integers, real_arrays
from moit.checks.exceptions import FragmentsError, FragmentsTypeError
from moit.checks.randomness import generator_of
from moit.checks.windows import interval, origin_of, range_of, size_of
from moit.fragments.display import fragments_html
from moit.fragments.frame import Frame
from moit.fragments.held import Index, each_of, explain, frozen, places_of, read_only, taken
from moit.fragments.ranges import default_range, with_far_background
from moit.fragments.records import columns as record_columns
from moit.system.environment import thread_count

Real = NDArray[np.float32] | NDArray[np.float64]

ARRAYS = ("depth", "alpha", "color", "transmission", "back", "emission", "deviation")
NO_CUTS: NDArray[np.float64] = np.zeros(0)


class Fragments:
    """The transparent samples of an image: per pixel a list in arrival order.

    offsets : (P+1,) integers; pixel p owns fragments offsets[p]:offsets[p+1]. First 0, never
        decreasing, last N.
    depth : (N,) distance from the eye along the view axis, finite, in any unit; larger is farther.
        Of opaque fragments also infinite: that is held as the greatest number of the dtype.
    alpha : (N,) opacity in [0, 1].
    color : (N, 3) linear radiance, not multiplied by alpha; finite, may exceed 1. None: these
        fragments have curves but no image.
    transmission : (N, 3) in [0, 1]: a channel passes 1 - alpha (1 - transmission), and the
        fragment adds alpha color all the same; `coverage` is what it takes away. None: none.
    back : (N,) the depth at which each fragment ends, at least depth. One that ends behind its
        depth is a volume, which fills what lies between with a medium of constant density; one
        that does not is a surface. None: all are surfaces.
    emission : (N, 3) linear radiance that a fragment adds to alpha color, whatever its alpha; so
        light without opacity has alpha 0. Needs color. None: none.
    deviation : (N,) at least 0: a fragment of any is a Gaussian, whose absorbance is spread along
        depth as a normal distribution of that standard deviation about its depth, of what lies
        within depth_range; all of its alpha is there. It has no back behind its depth. What is
        opaque is a surface whatever its deviation. None: all 0.
    shape : (height, width), whose product is P; by default (1, P).
    depth_range : (near, far), what depth warps use, near <= far; by default the least and the
        greatest depth or back of what is transparent, of all where all is opaque, (1.0, 1.0) where
        there are no fragments. Gaussians reach 3 deviations there, but no nearer than an eighth of
        a positive depth: what is not in front of the eye cannot be warped. A transparent fragment
        outside a given range is an error, ends being rounded to the dtype held before they are
        compared; opaque ones, which let nothing through in any channel, may lie anywhere: they are
        background, not part of what is warped.
    origin : (y, x), display coordinates of the first pixel.
    dtype : float32 or float64. None: float64 where any of the arrays of depth, alpha and so on is
        of float64, float32 otherwise.
    frame : the display window, the pixel aspect and the metadata of the file that they come from,
        for the file that is made of them. None: from none. No answer hangs on it.

    Questions see volumes in pieces: they are cut where others of their pixel begin or end, and at
    the depths that are asked; pieces that coincide are mixed (Kainz, Interpreting OpenEXR Deep
    Pixels), and each is taken for a surface at its front. So "sorted" and the bounds of all
    techniques are those of the volumes themselves, at every depth; other techniques are what they
    are of such surfaces. The emission of a fragment is dimmed by the transmittance in front of it
    as the technique has it, at most 1, and by nothing else: it is not normalized. In weighted
    blending ("wboit") that is the share of what a pixel covers that an opaque surface of this light
    would have by its weight, among surfaces as opaque.

    Gaussians overlap whatever they like. "sorted" and the bounds of all techniques are those of the
    Gaussians themselves, cut to 6 deviations, the picture to 1e-6 of the brightest colour or better
    by quadrature. What else is made of volumes and Gaussians is a fact of the technique: see
    `Technique.thick`. To a Gaussian the transmittance is that at its depth.

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
    back: Real | None
    emission: Real | None
    deviation: Real | None
    shape: tuple[int, int]
    depth_range: tuple[float, float]
    origin: tuple[int, int]
    frame: Frame | None

    __slots__ = {
        "__weakref__": None,
        "alpha": "(N,) opacity in [0, 1].",
        "back": "(N,) where each fragment ends, at least depth, or None.",
        "color": "(N, 3) linear radiance, not multiplied by alpha, or None.",
        "depth": "(N,) distance along the view axis.",
        "depth_range": "(near, far), what depth warps use.",
        "deviation": "(N,) the standard deviation of each fragment along depth, or None.",
        "emission": "(N, 3) linear radiance added to alpha color, or None.",
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
        back: ArrayLike | None = None,
        emission: ArrayLike | None = None,
        deviation: ArrayLike | None = None,
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
        arrays = real_arrays(depth, alpha, color, transmission, back, emission, deviation, dtype)
        if frame is not None and not isinstance(frame, Frame):
            raise FragmentsTypeError(f"frame: expected a Frame, got {type(frame).__name__}")
        held = np.require(ends, np.int64, ["C", "A"])
        self._check(held, arrays, size, depth_range, origin, frame=frame)

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
        near, far = given or (-math.inf, math.inf)
        threads = thread_count(None)
        offsets, fault, span = _core.check_fragments(offsets, *arrays, near, far, threads)
        if fault is not None and fault[0] in ("depth", "back"):
            arrays = with_far_background(arrays)
            _, fault, span = _core.check_fragments(offsets, *arrays, near, far, threads)
        if fault is not None:
            explain(*fault, offsets, dict(zip(ARRAYS, arrays, strict=True)), given, place)
        if given is None:
            given = default_range(arrays)[0] if span is None else span[:2]
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
        held = (offsets, *each_of(arrays, read_only), shape, depth_range, origin, frame)
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
        f._hold(frozen(offsets), arrays, shape, depth_range, origin, frame)
        return f

    @classmethod
    def from_pixels(
        cls,
        pixel: ArrayLike | None = None,
        depth: ArrayLike = (),
        alpha: ArrayLike = (),
        color: ArrayLike | None = None,
        *,
        x: ArrayLike | None = None,
        y: ArrayLike | None = None,
        shape: Sequence[int],
        transmission: ArrayLike | None = None,
        back: ArrayLike | None = None,
        emission: ArrayLike | None = None,
        deviation: ArrayLike | None = None,
        depth_range: Sequence[float] | None = None,
        origin: Sequence[int] = (0, 0),
        dtype: DTypeLike | None = None,
    ) -> Fragments:
        """Fragments from a list in any order, such as the dump of a G-buffer.

        pixel : (N,) integers in [0, height x width): y * width + x of each fragment. Fragments of
            one pixel keep their order.
        x, y : (N,) integers of any type, in place of `pixel`: the column in [0, width) and the row
            in [0, height) of each fragment, counted from the first pixel.
        shape : (height, width).

        The rest is as for `Fragments`; indices in messages are those of the arrays given.

        >>> f = moit.Fragments.from_pixels(
        ...     x=[1, 0], y=[0, 0], depth=[2.0, 1.0], alpha=[0.5, 0.5], shape=(1, 2))
        >>> f.depth
        array([1., 2.], dtype=float32)
        """
        size = size_of(shape)
        arrays = real_arrays(depth, alpha, color, transmission, back, emission, deviation, dtype)
        at = places_of(pixel, x, y, len(arrays[0]), size)
        grouped = _core.group_by_pixel(at, size[0] * size[1])
        if isinstance(grouped, int):
            raise FragmentsError(
                f"pixel[{grouped}]: found {at[grouped]}; needed at least 0 and below "
                f"{size[0]} x {size[1]} = {size[0] * size[1]}"
            )
        offsets, order = grouped
        f = object.__new__(cls)
        f._check(
            offsets,
            taken(arrays, order),
            size,
            depth_range,
            origin,
            place=lambda i: str(order[i]),
        )
        return f

    @classmethod
    def from_records(
        cls,
        records: ArrayLike,
        *,
        shape: Sequence[int],
        layout: DTypeLike | None = None,
        depth_range: Sequence[float] | None = None,
        origin: Sequence[int] = (0, 0),
        dtype: DTypeLike | None = None,
    ) -> Fragments:
        """Fragments from records in any order: a structured array, or what a GPU wrote.

        records : (N,) with fields x and y (or xy, or pixel as in `from_pixels`), depth (or z), and
            rgba (4,), or color (3,) and alpha, or r, g, b and alpha (or a); perhaps transmission
            (3,), back (or zback), emission (3,), deviation. Names are taken in any case; other
            fields are left alone. Colours are linear and not multiplied by alpha, in any type of
            floats. Bytes and arrays without fields are a buffer that holds such records.
        layout : a buffer's structured dtype. None: 16 bytes each, x and y as uint16, depth as
            float32, rgba as four of float16, little-endian.
        shape : (height, width).

        The rest is as for `Fragments`. Raises FragmentsError, also where fields are missing or the
        buffer is no whole number of records.

        >>> record = [("x", "u2"), ("y", "u2"), ("depth", "f4"), ("rgba", "f2", 4)]
        >>> drawn = np.array([(1, 0, 2.0, (1, 0, 0, 0.5))], record)
        >>> moit.Fragments.from_records(drawn.tobytes(), shape=(1, 2)).counts
        array([0, 1])
        """
        columns = record_columns(records, layout)
        return cls.from_pixels(
            **columns, shape=shape, depth_range=depth_range, origin=origin, dtype=dtype
        )

    @classmethod
    def from_layers(
        cls,
        depth: ArrayLike,
        alpha: ArrayLike,
        color: ArrayLike | None = None,
        *,
        transmission: ArrayLike | None = None,
        back: ArrayLike | None = None,
        emission: ArrayLike | None = None,
        deviation: ArrayLike | None = None,
        depth_range: Sequence[float] | None = None,
        origin: Sequence[int] = (0, 0),
        dtype: DTypeLike | None = None,
    ) -> Fragments:
        """Fragments from K images, one a layer; a pixel's fragments arrive in the layers' order.

        depth, alpha, back, deviation : (K, height, width). Alpha 0 marks an empty slot, where
            nothing else matters; with emission, alpha 0 where that is black.
        color, transmission, emission : (K, height, width, 3).

        The rest is as for `Fragments`; indices in messages are (layer, y, x).
        """
        arrays = real_arrays(
            depth, alpha, color, transmission, back, emission, deviation, dtype, dimensions=3
        )
        layers, height, width = arrays[0].shape
        pixels = height * width
        size = size_of((height, width))
        # Transposed, the slots of a pixel lie side by side.
        present = np.not_equal(arrays[1], 0)
        if arrays[5] is not None:
            present |= arrays[5].any(axis=-1)
        present = present.reshape(layers, pixels).T
        offsets = np.zeros(pixels + 1, np.int64)
        np.cumsum(present.sum(axis=1), out=offsets[1:])
        pixel, layer = np.nonzero(present)
        order = layer * pixels + pixel
        flat = each_of(arrays, lambda a: a.reshape(layers * pixels, *a.shape[3:]))
        f = object.__new__(cls)
        f._check(
            offsets,
            taken(flat, order),
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
        """float32 or float64: that of depth, alpha and the other arrays of numbers."""
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
            arrays = each_of(self._arrays(), lambda a: a[part])
        else:
            order = np.repeat(begins - offsets[:-1], counts)
            order += np.arange(len(order))
            arrays = taken(self._arrays(), order)
        origin = (self.origin[0] + y0, self.origin[1] + x0)
        return Fragments._of_checked(offsets, arrays, size, self.depth_range, origin, self.frame)

    def _arrays(self) -> Arrays:
        return (
            self.depth,
            self.alpha,
            self.color,
            self.transmission,
            self.back,
            self.emission,
            self.deviation,
        )

    def _with(
        self,
        depth: Real,
        alpha: Real,
        color: Real | None = None,
        transmission: Real | None = None,
        back: Real | None = None,
        emission: Real | None = None,
        deviation: Real | None = None,
        *,
        offsets: Index | None = None,
    ) -> Fragments:
        """Other fragments of the same image, which need no second look.

        offsets : None: as many in each pixel.
        """
        ends = self.offsets if offsets is None else offsets
        arrays = (depth, alpha, color, transmission, back, emission, deviation)
        return Fragments._of_checked(
            ends, arrays, self.shape, self.depth_range, self.origin, self.frame
        )

    def _reordered(self, key: Real) -> Fragments:
        order = _core.depth_order(self.offsets, key, thread_count(None))
        return self._with(*taken(self._arrays(), order))

    def sorted(self) -> Fragments:
        """The same fragments, each pixel's front to back; equal depths keep their order."""
        return self._reordered(self.depth)

    def shuffled(self, rng: Any = None, *, seed: Any = None) -> Fragments:
        """The same fragments, each pixel's in a random order.

        rng : what `numpy.random.default_rng` takes, as Scientific Python's SPEC 7 has it: the same
            integer gives the same order, None another one in each call.
        seed : the same by an older name. TypeError where both are given.
        """
        if rng is not None and seed is not None:
            raise TypeError("rng: expected one of seed and rng, got both")
        order = generator_of(seed if rng is None else rng).random(len(self))
        return self._reordered(order)

    def tidy(self) -> Fragments:
        """Fragments that let through and add the same light, each pixel's front to back, of which
        none overlap: a tidy image as OpenEXR has it.

        Volumes are cut where others begin or end. What coincides, surfaces at one depth too, is
        mixed as Kainz, Interpreting OpenEXR Deep Pixels, has it: in whatever order they arrive, no
        one of them is in front. Of opaque ones that coincide the mean is seen. A pixel of n
        fragments has at most 2 n - 1 of them then, and takes time in proportion to n log n. Where
        nothing has to change these Fragments are returned.

        >>> red_and_blue = [[1, 0, 0], [0, 0, 1]]
        >>> f = moit.Fragments([0, 2], [3.0, 3.0], [0.6, 0.6], red_and_blue).tidy()
        >>> len(f), f.alpha.round(2).tolist(), f.color.round(2).tolist()
        (1, [0.84], [[0.5, 0.0, 0.5]])
        """
        return self._split(tidy=True)[0]

    def _split(
        self, tidy: bool = False, cuts: NDArray[np.float64] = NO_CUTS
    ) -> tuple[Fragments, Index | None]:
        """Tidy fragments; or volumes in pieces, cut at increasing depths `cuts` (K,) too, as
        surfaces at their fronts. And (N,) the piece that each fragment begins with; None: there is
        one for each, in the same order."""
        if not tidy and self.back is None and self.deviation is None:
            return self, None
        made = _core.split_volumes(self, tidy, cuts, thread_count(None))
        if made is not None:
            return self._with(*made[1:7], offsets=made[0]), made[7]
        if tidy:
            return self, None
        return self._with(*self._arrays()[:4], emission=self.emission), None

    def __repr__(self) -> str:
        height, width = self.shape
        words = [f"{height}x{width}", f"{len(self):,} fragments"]
        if len(self):
            words.append(f"at most {self.counts.max():,} a pixel")
        words.append(str(self.dtype))
        words.append(f"depth {self.depth_range[0]:.4g} to {self.depth_range[1]:.4g}")
        words += [name for name in ARRAYS[2:] if getattr(self, name) is not None]
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


def _restored(
    cls: type[Fragments],
    offsets: Index,
    arrays: Arrays,
    shape: tuple[int, int],
    depth_range: tuple[float, float],
    origin: tuple[int, int],
    frame: Frame | None = None,
) -> Fragments:
    # What lies in a message of other things begins anywhere.
    held = np.require(offsets, np.int64, ["C", "A"])
    whole: Any = tuple(None if one is None else np.require(one, None, ["C", "A"]) for one in arrays)
    f = object.__new__(cls)
    f._check(held, whole, shape, depth_range, origin, frame=frame)
    return f
