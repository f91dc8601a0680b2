"""Gaussian splats, made of arrays."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from moit import _core
from moit.checks.arguments import truth
from moit.checks.arrays import as_array
from moit.checks.exceptions import SplatsError
from moit.checks.unchanging import Unchanging
from moit.geometry.attributes import Attributes
from moit.geometry.drawing import Emitted, Frame, one_after_the_other

Array = NDArray[Any]

ATTRIBUTES = Attributes(SplatsError)

# In the order of moit_splatting of csrc/moit_geometry.h.
CONVENTIONS = ("3dgs", "exact", "3dgs-all")
ARRAYS = ("means", "scales", "rotations", "opacities", "sh")
FILTERED = 4  # of antialiased ones the bit that moit_splatting has, too
DEGREES = {1: 0, 4: 1, 9: 2, 16: 3}
OF_DEGREE_0 = 0.28209479177387814  # the harmonic of degree 0, 1 / sqrt(4 pi)

# So many deviations from its middle a splat of opacity 1 has 1/255.
REACH = 3.33


class Splats(Unchanging):
    """Ellipsoids whose opacity falls off as a Gaussian does, with colours that depend on the view
    (Kerbl et al., "3D Gaussian Splatting for Real-Time Radiance Field Rendering", 2023).

    means : (N, 3) middles, in the world of `moit.Camera`; finite.
    scales : (N, 3) standard deviations along the axes, linear (not logarithms), not negative; or
        (N,) for balls.
    rotations : (N, 4) quaternions w x y z of any length but 0, from the axes to the world.
    opacities : (N,) in [0, 1], in the middle (not logits).
    colors : (N, 3) or (3,) finite, not negative: the same from all sides. None: `sh`, or grey.
    sh : (N, K, 3) coefficients of colour, less 1/2, in real spherical harmonics of degree 0 to 3:
        K is 1, 4, 9 or 16, in the order and with the signs of the reference code. What is seen
        is not below 0. Not with `colors`.
    convention : how they become fragments, in `moit.rasterize` and `moit.render`.
        "3dgs": as the reference rasteriser has it: ellipses by the projection's derivative, 0.3
        pixels added to both variances, alpha at most 0.99 and no fragment below 1/255, at the
        depth of the middle; nothing nearer than 0.2, and no fragment where those in front let less
        than 1e-4 through.
        "exact": by the most of the density along each ray, perspective-correct, at the depth where
        that is (Hahlbohm et al. 2025): neighbouring pixels see neighbouring depths. With alpha as
        above; nothing is added, nothing left out but splats whose middle the camera does not see,
        nearer than its `near` or farther than its `far`.
        "3dgs-all": as "3dgs", and of fragments that little is seen through all. Where those end is
        known of sorted ones only, so techniques that do not sort see these.
    antialiased : splats were trained to have the same opacity over their area however small they
        are on the picture, as files of Mip-Splatting (Yu et al. 2024), Brush and Postshot say. Of
        "3dgs" and "3dgs-all": alpha is as much less as the 0.3 pixels make an ellipse larger, by
        the square root of its determinant before and after, of at least 0.000025. "exact" adds
        nothing, and needs no less.
    thick : of "exact": fragments are Gaussians along their rays, as far as the splat reaches there
        (`Fragments`, deviation); so those that overlap mix.

    Colours are the numbers that are blended, as files have them; no light falls on them. Arrays are
    held as read-only float32 copies. Raises SplatsError (a ValueError) or TypeError that name the
    argument.

    >>> ball = moit.Splats([[0, 0, 0]], [0.2], [[1, 0, 0, 0]], [0.9], colors=(0.8, 0.3, 0.1))
    >>> len(ball), ball.degree
    (1, 0)
    >>> moit.rasterize(ball, moit.Camera(), (16, 12)).depth.max().item()
    3.0
    """

    __slots__ = (
        "antialiased",
        "convention",
        "means",
        "opacities",
        "rotations",
        "scales",
        "sh",
        "thick",
    )

    means: Array
    scales: Array
    rotations: Array
    opacities: Array
    sh: Array
    convention: str
    antialiased: bool
    thick: bool

    def __init__(
        self,
        means: ArrayLike,
        scales: ArrayLike,
        rotations: ArrayLike,
        opacities: ArrayLike,
        *,
        colors: ArrayLike | None = None,
        sh: ArrayLike | None = None,
        convention: str = "3dgs",
        antialiased: bool = False,
        thick: bool = False,
    ) -> None:
        middles = _numbers(means, "means", (None, 3))
        count = len(middles)
        deviations = _numbers(scales, "scales", (count, 3), (count,))
        _check(deviations >= 0, deviations, "scales", "a number that is not negative")
        if deviations.ndim == 1:
            deviations = np.repeat(deviations[:, None], 3, axis=1)
        turns = _numbers(rotations, "rotations", (count, 4))
        # by their largest number first, whose square may be none that doubles hold
        largest = np.abs(turns).max(axis=1, keepdims=True, initial=0)
        turns = np.divide(turns, largest, out=np.zeros_like(turns), where=largest > 0)
        length = np.linalg.norm(turns, axis=1, keepdims=True)
        _check(length > 0, length, "rotations", "a quaternion that is not 0")
        shares = _numbers(opacities, "opacities", (count,))
        _check((shares >= 0) & (shares <= 1), shares, "opacities", "a number in [0, 1]")
        if colors is not None and sh is not None:
            raise TypeError("colors: needed None where sh is given, which has the colours")
        held = {
            "means": middles,
            "scales": deviations,
            "rotations": turns / length,
            "opacities": shares,
            "sh": _of_colors(colors, count) if sh is None else _harmonics(sh, count),
        }
        for name, value in held.items():
            with np.errstate(over="ignore"):
                array = np.ascontiguousarray(value, np.float32)
            if not np.isfinite(array).all():
                raise SplatsError(f"{name}: found numbers beyond what float32 holds")
            array.flags.writeable = False
            object.__setattr__(self, name, array)
        ATTRIBUTES.one_of("convention", convention, CONVENTIONS)
        object.__setattr__(self, "convention", convention)
        if truth("thick", thick) and convention != "exact":
            raise SplatsError(
                f"thick: found True with convention {convention!r}, whose splats are flat; needed "
                "'exact'"
            )
        object.__setattr__(self, "thick", bool(thick))
        object.__setattr__(self, "antialiased", truth("antialiased", antialiased))

    def __setattr__(self, name: str, value: Any) -> None:
        raise AttributeError(f"Splats do not change: cannot set {name}")

    def __len__(self) -> int:
        return len(self.means)

    def __repr__(self) -> str:
        more = "".join(f", {name}" for name in ("antialiased", "thick") if getattr(self, name))
        return f"Splats({len(self)}, degree {self.degree}, convention {self.convention!r}{more})"

    def __getitem__(self, which: Any) -> Splats:
        """Some of them, by a slice, indices or a mask."""
        if isinstance(which, (int, np.integer)):
            raise TypeError("expected a slice, indices or a mask, got an integer")
        some = {name: getattr(self, name)[which] for name in ARRAYS}
        return Splats(**some, **self._kind)

    @property
    def degree(self) -> int:
        """Of the spherical harmonics: 0 to 3."""
        return DEGREES[self.sh.shape[1]]

    def seen_by(self, convention: str, *, thick: bool = False) -> Splats:
        """The same with another convention, thick along rays or not.

        >>> ball = moit.Splats([[0, 0, 0]], [0.2], [[1, 0, 0, 0]], [0.9])
        >>> ball.seen_by("exact")
        Splats(1, degree 0, convention 'exact')
        """
        return self._with(convention=convention, thick=thick)

    def _with(self, **changed: Any) -> Splats:
        """The same but for some of the arguments."""
        own = {name: getattr(self, name) for name in ARRAYS}
        return Splats(**{**own, **self._kind, **changed})

    @property
    def _kind(self) -> dict[str, Any]:
        return {name: getattr(self, name) for name in ("convention", "antialiased", "thick")}

    # As a moit.geometry.drawing.Drawable

    @property
    def points(self) -> Array:
        """(2 N, 3): corners of boxes round all that is seen."""
        reach = REACH * self.scales.max(axis=1, keepdims=True)
        return np.concatenate([self.means - reach, self.means + reach])

    @property
    def transparent_points(self) -> Array:
        """(V, 3) where fragments may lie."""
        return self.points if self.convention == "exact" else self.means

    @classmethod
    def emit(cls, several: Sequence[Splats], frame: Frame) -> Emitted:
        return cls.begin(several, frame).rows(0, frame.size[1])

    @classmethod
    def begin(cls, several: Sequence[Splats], frame: Frame) -> SplatPicture:
        """What `emit` gives, in bands of rows."""
        return SplatPicture(several, frame)


class SplatPicture:
    """Splats as one picture sees them: a `moit.geometry.drawing.InBands`."""

    def __init__(self, several: Sequence[Splats], frame: Frame) -> None:
        seen = (frame.eye, *frame.axes, frame.scale, frame.near, frame.far)
        self.threads = frame.threads
        self._thick: list[bool] = []
        self._begun = []
        self._drawn: list[list[Splats]] = []
        for (number, thick), some in itertools.groupby(several, kind_of):
            self._thick.append(thick)
            self._drawn.append(list(some))
            self._begun.append(
                _core.begin_splats(
                    joined(self._drawn[-1]), number, seen, *frame.size, frame.threads
                )
            )
        width = frame.size[0]
        ends = np.sum([offsets[::width] for _, offsets, *_ in self._begun], axis=0)
        self.samples = np.diff(ends)
        self.depths = (
            min(nearest for *_, nearest, _ in self._begun),
            max(farthest for *_, farthest in self._begun),
        )

    def rows(self, top: int, bottom: int) -> Emitted:
        emitted: list[Emitted] = []
        for (raster, *_), thick in zip(self._begun, self._thick, strict=True):
            drawn = _core.draw_splats(raster, top, bottom, thick, self.threads)
            # a Gaussian ends where it is, as surfaces do
            emitted.append((*drawn[:4], drawn[1], drawn[4]) if thick else drawn)
        return emitted[0] if len(emitted) == 1 else one_after_the_other(emitted)

    def pull_rows(
        self, top: int, bottom: int, by: tuple[Array, Array, Array], sums: Array | None
    ) -> Array:
        """Sums, of other rows or none, with what a loss changes by with splats on the screen, from
        what it changes by with depth, alpha and color of `rows`. All are of one convention."""
        raster = self._begun[0][0]
        return _core.pull_splat_fragments(raster, top, bottom, *by, sums, self.threads)

    def pull(self, sums: Array) -> tuple[Array, Array, Array, Array, Array]:
        """From these to the splats' arrays, as `joined` has them."""
        raster = self._begun[0][0]
        return _core.pull_splat_projection(raster, joined(self._drawn[0]), sums, self.threads)


def kind_of(one: Splats) -> tuple[int, bool]:
    """What those have in common that are drawn together: the core's number, and thick."""
    filtered = FILTERED if one.antialiased and one.convention != "exact" else 0
    return CONVENTIONS.index(one.convention) | filtered, one.thick


def joined(several: list[Splats]) -> tuple[Array, ...]:
    """The arrays of all, as the core takes them."""
    most = max(one.sh.shape[1] for one in several)
    padded = [np.pad(one.sh, ((0, 0), (0, most - one.sh.shape[1]), (0, 0))) for one in several]
    names = ("means", "scales", "rotations", "opacities")
    parts = [[getattr(one, name) for one in several] for name in names]
    return tuple(some[0] if len(some) == 1 else np.concatenate(some) for some in [*parts, padded])


def _numbers(value: ArrayLike, name: str, *shapes: tuple[int | None, ...]) -> Array:
    array = as_array(value, name)
    if array.dtype.kind not in "fiu":
        raise TypeError(f"{name}: expected real numbers, got {array.dtype}")
    for shape in shapes:
        same = len(shape) == array.ndim and all(
            want in (None, got) for want, got in zip(shape, array.shape, strict=True)
        )
        if same:
            return ATTRIBUTES.finite(array, name, np.float64)
    needed = " or ".join(str(shape).replace("None", "N") for shape in shapes)
    raise SplatsError(f"{name}: expected shape {needed}, got {array.shape}")


def _check(fits: Array, array: Array, name: str, needed: str) -> None:
    if fits.all():
        return
    at = np.unravel_index(int(np.argmin(fits)), fits.shape)
    place = ", ".join(str(int(i)) for i in at)
    raise SplatsError(f"{name}[{place}]: found {array[at]:g}; needed {needed}")


def _of_colors(colors: ArrayLike | None, count: int) -> Array:
    if colors is not None and as_array(colors, "colors").dtype.kind == "u":
        raise TypeError(
            "colors: found unsigned integers; needed real numbers, of which 1 is full. Divide "
            "those of 8 bits by 255"
        )
    shades = _numbers(0.5 * np.ones(3) if colors is None else colors, "colors", (count, 3), (3,))
    _check(shades >= 0, shades, "colors", "a number that is not negative")
    return np.broadcast_to((shades - 0.5) / OF_DEGREE_0, (count, 3))[:, None]


def _harmonics(sh: ArrayLike, count: int) -> Array:
    return _numbers(sh, "sh", *((count, coefficients, 3) for coefficients in DEGREES))
