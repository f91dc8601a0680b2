"""What scenes are made of: anything that emits the fragments of a picture's pixels.

Triangles (`moit.geometry.meshes.Mesh`) are the first. Another kind is one class here, and one in
`moit.gpu.primitives` with a file of GLSL where GPUs are to draw it, too.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any, Protocol, Self, runtime_checkable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]
Emitted = tuple[Array, ...]  # offsets, depth, alpha, color; of what is thick also back, deviation
Shares = Callable[[Array, Array, Array], NDArray[np.float64]]


@dataclasses.dataclass(frozen=True, eq=False)
class Frame:
    """A picture that is to be taken, all of it checked.

    eye : (3,), and axes (3, 3): right, up and forward, of length 1.
    scale : factors of x / z and y / z for which the picture spans [-1, 1].
    near, far : depths, along the view, between which things are seen.
    lights : (n, 6), as `moit.geometry.light.light_numbers`; none: the light there is without any.
    shares : of fragments' offsets, depth and alpha: (N, n), what of each light comes there. None:
        all of it.
    lists_opaque : opaque surfaces are emitted as others are, and hide nothing.
    antialias : alpha counts by the share of the pixel that is covered; else a pixel is covered
        where its middle is.
    """

    eye: tuple[float, float, float]
    axes: NDArray[np.float64]
    scale: tuple[float, float]
    near: float
    far: float
    size: tuple[int, int]
    lights: NDArray[np.float64]
    threads: int
    shares: Shares | None = None
    lists_opaque: bool = False
    antialias: bool = False


@runtime_checkable
class Drawable(Protocol):
    """A part of a scene. The class draws several of its kind that follow one another.

    Drawn in the given order, fragments of a pixel stand in that order. Those of alpha 1 are opaque,
    and may be left out where others hide them, unless the frame lists what is opaque.
    """

    @property
    def points(self) -> Array:
        """(V, 3): their box holds it; cameras are fitted to them, and `order` sorts by them."""

    @property
    def transparent_points(self) -> Array:
        """(V, 3): their bounding sphere has the range of depth of what lets light through."""

    @classmethod
    def emit(cls, several: Sequence[Self], frame: Frame) -> Emitted:
        """(offsets, depth, alpha, color): int64 (pixels + 1,), float32 (N,), (N,) and (N, 3); of
        what is thick also back, (N,), or back and deviation, (N,) each."""


class InBands(Protocol):
    """What has been counted and is yet to be drawn, a band of rows at a time. A kind of Drawable of
    which a picture may have more fragments than memory holds has it from
    `begin(several, frame)`, with `emit`'s arguments.

    samples : (height,) how many fragments each row has.
    depths : of the nearest and the farthest; infinity and less than it where there is none.
    """

    samples: Array
    depths: tuple[float, float]

    def rows(self, top: int, bottom: int) -> Emitted:
        """Of rows [top, bottom) what `emit` gives of the whole."""


Scene = Drawable | Sequence[Drawable]


def bounding_sphere(points: Sequence[Array]) -> tuple[NDArray[np.float64], float]:
    """Middle and radius of a sphere round all points: that of their bounding box's middle."""
    points = [one for one in points if len(one)]
    if not points:
        return np.zeros(3), 0.0
    least = np.min([one.min(axis=0) for one in points], axis=0).astype(np.float64)
    most = np.max([one.max(axis=0) for one in points], axis=0).astype(np.float64)
    middle = (least + most) / 2
    radius = max(float(np.linalg.norm(one - middle, axis=1).max()) for one in points)
    return middle, radius


def one_after_the_other(emitted: Sequence[Emitted]) -> Emitted:
    """Fragments of each pixel in the order of parts."""
    counts = [np.diff(offsets) for offsets, *_ in emitted]
    offsets = np.concatenate([[0], np.cumsum(np.sum(counts, axis=0))])
    pixels = np.concatenate([np.repeat(np.arange(len(c)), c) for c in counts])
    order = np.argsort(pixels, kind="stable")
    most = max(map(len, emitted))
    alike = [_of_so_many(one, most) for one in emitted]
    arrays = (np.concatenate(some)[order] for some in [*zip(*alike, strict=True)][1:])
    return offsets, *arrays


def _of_so_many(arrays: Emitted, most: int) -> Emitted:
    """With back, which is where surfaces are, and deviation too, as others have them."""
    absent = (arrays[1], np.zeros_like(arrays[1]))
    return (*arrays, *absent[len(arrays) - 4 :])[:most]
