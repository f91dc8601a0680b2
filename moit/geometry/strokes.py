"""Points and lines, made of arrays: what a disc or a ball leaves that moves from node to node."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from moit import _core
from moit.checks.arguments import truth
from moit.checks.arrays import as_array, integers
from moit.checks.exceptions import PrimitiveError
from moit.checks.unchanging import Unchanging
from moit.geometry.attributes import Attributes
from moit.geometry.drawing import Emitted, Frame, one_after_the_other
from moit.geometry.foreign import foreign_cells

Array = NDArray[Any]

ATTRIBUTES = Attributes(PrimitiveError)
MOST_NODES = 2**31 - 2
FARTHEST = float(np.finfo(np.float32).max)  # squares of it are numbers
SAMPLES = 64  # MOIT_SAMPLES of csrc/moit_strokes.h
GREY = (0.7, 0.7, 0.7)


class Strokes(Unchanging):
    """What points and lines have in common: nodes, and how they are drawn.

    positions : (N, 3) float64, in the scene; first (S + 1,) int64: nodes of stroke i are those from
        first[i] to first[i + 1].
    sizes : (N,) float32: radii in units of the scene, or where in_pixels on the picture, in pixels.
    """

    __slots__ = ("alpha", "color", "first", "in_pixels", "lit", "positions", "shape", "sizes")

    SHAPES: tuple[str, str]  # flat, solid
    NODES: str  # the argument that has the positions

    positions: NDArray[np.float64]
    first: NDArray[np.int64]
    sizes: NDArray[np.float32]
    in_pixels: bool
    color: NDArray[np.float32]
    alpha: NDArray[np.float32]
    shape: str
    lit: bool

    def _hold(
        self,
        positions: Array,
        which: Array | None,
        first: Array,
        radius: ArrayLike | None,
        pixels: ArrayLike | None,
        color: ArrayLike,
        alpha: ArrayLike,
        shape: str,
        lit: bool,
        color_space: str,
    ) -> None:
        """Checks and keeps all of it; places of nodes are checked.

        which : of these, in the order of strokes; None: all.
        """
        if (radius is None) == (pixels is None):
            found = "neither" if radius is None else "both"
            raise TypeError(f"radius, pixels: needed one of the two, found {found}")
        count = len(positions)
        name, size = ("radius", radius) if radius is not None else ("pixels", pixels)
        assert size is not None
        sizes = ATTRIBUTES.each(size, name, (), count)
        ATTRIBUTES.check(sizes, name, sizes >= 0, "a number that is not negative")
        shades, own = ATTRIBUTES.shades(color, color_space, count)
        opacity = ATTRIBUTES.opacities(alpha, "alpha", count)
        ATTRIBUTES.one_of("shape", shape, self.SHAPES)
        held: dict[str, Any] = {
            "positions": positions,
            "sizes": sizes / np.float32(2) if name == "pixels" else sizes,
            "color": shades,
            "alpha": opacity if own is None else opacity * own,
        }
        if which is not None:
            held = {key: array[which] for key, array in held.items()}
        held |= {"first": first, "in_pixels": name == "pixels", "shape": shape}
        held["lit"] = truth("lit", lit)
        for key, value in held.items():
            if isinstance(value, np.ndarray):
                value.flags.writeable = False
            object.__setattr__(self, key, value)

    def __setattr__(self, name: str, value: Any) -> None:
        raise AttributeError(f"{type(self).__name__} do not change: cannot set {name}")

    def __len__(self) -> int:
        return len(self.first) - 1

    @property
    def solid(self) -> bool:
        return self.shape == self.SHAPES[1]

    # As a moit.geometry.drawing.Drawable

    @property
    def points(self) -> Array:
        """(2 N, 3) positions in the scene: corners of boxes round all nodes; where sizes are in
        pixels, the nodes."""
        return self._boxes(np.ones(len(self.positions), np.bool_))

    @property
    def transparent_points(self) -> Array:
        """Of strokes that let light through somewhere."""
        lengths = np.diff(self.first)
        stroke = np.repeat(np.arange(len(self)), lengths)
        through = np.zeros(len(self), np.bool_)
        through[stroke[self.alpha < 1]] = True
        return self._boxes(through[stroke])

    def _boxes(self, which: NDArray[np.bool_]) -> Array:
        middles = self.positions[which]
        if self.in_pixels:
            return middles
        reach = self.sizes[which, None].astype(np.float64)
        return np.concatenate([middles - reach, middles + reach])

    @classmethod
    def emit(cls, several: Sequence[Self], frame: Frame) -> Emitted:
        return cls.begin(several, frame).rows(0, frame.size[1])

    @classmethod
    def begin(cls, several: Sequence[Self], frame: Frame) -> StrokePicture:
        """What `emit` gives, in bands of rows."""
        return StrokePicture(several, frame)


class Points(Strokes):
    """Points, as discs that face the picture or as spheres.

    positions : (N, 3) in the scene, finite, held as float64; or a pyvista.PolyData, or what has
        points and verts as it has.
    radius : a number for all or (N,), not negative, in units of the scene.
    pixels : instead: how wide they are on the picture, in pixels, wherever they are.
    color : (3,) for all or (N, 3): linear, not multiplied by alpha, finite, not negative. A fourth
        number is alpha. `moit.map_scalars` makes such of numbers. Of a PolyData, N is the number of
        its points, and its own colours are taken unless others are given.
    alpha : a number for all or (N,): opacity in [0, 1], times color's.
    shape : "disc", parallel to the picture, of one depth; or "sphere", of which the side to the eye
        is seen, exactly as rays meet it. With `pixels` its depth is that of the middle.
    lit : whether light falls on spheres; colours of discs are what is seen.
    color_space : as `moit.Mesh` takes it.

    A point has one fragment in each pixel whose middle it covers, or with `antialias` in each that
    it touches. Arrays are held as read-only copies. Raises PrimitiveError (a ValueError) or
    TypeError that name the argument.

    >>> cloud = moit.Points([[0, 0, 0], [0.5, 0, 0]], radius=0.2, alpha=(0.5, 1), shape="sphere")
    >>> len(cloud)
    2
    >>> moit.render(cloud, "sorted", (16, 12), camera=moit.Camera()).shape
    (12, 16, 4)
    """

    __slots__ = ()
    SHAPES = ("disc", "sphere")
    NODES = "positions"

    def __init__(
        self,
        positions: ArrayLike | Any,
        radius: ArrayLike | None = None,
        color: ArrayLike = GREY,
        alpha: ArrayLike = 1.0,
        *,
        pixels: ArrayLike | None = None,
        shape: str = "disc",
        lit: bool = True,
        color_space: str = "linear",
    ) -> None:
        places, cells, color = _of_foreign(positions, "verts", color)
        places = _places(places, "positions")
        which = None if cells is None else cells[0]
        count = len(places) if which is None else len(which)
        first = np.arange(count + 1, dtype=np.int64)
        self._hold(places, which, first, radius, pixels, color, alpha, shape, lit, color_space)

    def __repr__(self) -> str:
        return f"Points({len(self)}, {self.shape!r})"


class Lines(Strokes):
    """Lines of straight parts, as ribbons that face the picture or as tubes.

    points : (N, 3) in the scene, finite, held as float64, the points of one line after those of the
        other; or a pyvista.PolyData, or what has points and lines as it has.
    offsets : (L + 1,) integers that do not fall: line i has the points from offsets[i] to
        offsets[i + 1]. None: all are one line. A line of one point is a dot; one whose last point
        is its first is closed.
    radius : half the width: a number for all or (N,), not negative, in units of the scene.
    pixels : instead: how wide they are on the picture, in pixels, wherever they are.
    color, alpha, lit, color_space : as `moit.Points` takes them, for all or for each point; between
        points they change linearly.
    shape : "ribbon", what a disc parallel to the picture leaves on its way; or "tube", what a ball
        leaves, of which the side to the eye is seen, exactly as rays meet it. With `pixels` a
        tube's depth is that of its middle.

    A line is one surface: where it bends, and where many parts that follow each other meet in a
    pixel, the pixel has one fragment of it. It has one more wherever the line crosses itself after
    it was in other pixels, or comes back at another depth (farther from the first than it is
    thick). Ends are round. Without `antialias` a pixel is covered where its
    middle is, so that lines narrower than a pixel have gaps. Arrays are held as read-only copies.
    Raises PrimitiveError (a ValueError) or TypeError that name the argument.

    >>> bend = moit.Lines([[-1, 0, 0], [0, 0.5, 0], [1, 0, 0]], pixels=3, alpha=0.5)
    >>> f = moit.rasterize(bend, moit.Camera(), (64, 48), antialias=True)
    >>> f.counts.max().item()
    1
    """

    __slots__ = ()
    SHAPES = ("ribbon", "tube")
    NODES = "points"

    def __init__(
        self,
        points: ArrayLike | Any,
        offsets: ArrayLike | None = None,
        radius: ArrayLike | None = None,
        color: ArrayLike = GREY,
        alpha: ArrayLike = 1.0,
        *,
        pixels: ArrayLike | None = None,
        shape: str = "ribbon",
        lit: bool = True,
        color_space: str = "linear",
    ) -> None:
        places, cells, color = _of_foreign(points, "lines", color)
        if cells is not None and offsets is not None:
            raise TypeError("offsets: needed None where points is a mesh, which has the lines")
        places = _places(places, "points")
        which, sizes = (None, None) if cells is None else cells
        own = None if sizes is None else np.cumsum([0, *sizes])
        count = len(places) if which is None else len(which)
        first = _offsets(offsets if own is None else own, count)
        self._hold(places, which, first, radius, pixels, color, alpha, shape, lit, color_space)

    def __repr__(self) -> str:
        return f"Lines({len(self)}, of {len(self.positions)} points, {self.shape!r})"


class StrokePicture:
    """Strokes as one picture sees them: a `moit.geometry.drawing.InBands`."""

    def __init__(self, several: Sequence[Strokes], frame: Frame) -> None:
        seen = (frame.eye, *frame.axes, frame.scale, frame.near, frame.far)
        self._frame = frame
        self._begun = []
        for (solid, _, lit), run in itertools.groupby(several, kind_of):
            some = list(run)
            how = how_drawn(some[0], frame.antialias)
            arrays = joined(some)
            drawn = (arrays, how, seen, *frame.size, frame.threads, frame.lights)
            self._begun.append((*_core.begin_strokes(*drawn), solid and lit))
        width = frame.size[0]
        ends = np.sum([begun[1][::width] for begun in self._begun], axis=0)
        self.samples = np.diff(ends)
        self.depths = (
            min(begun[2] for begun in self._begun),
            max(begun[3] for begun in self._begun),
        )

    def rows(self, top: int, bottom: int) -> Emitted:
        emitted = [
            self._drawn(raster, takes_light, top, bottom) for raster, *_, takes_light in self._begun
        ]
        return emitted[0] if len(emitted) == 1 else one_after_the_other(emitted)

    def _drawn(self, raster: object, takes_light: bool, top: int, bottom: int) -> Emitted:
        drawn = _core.draw_strokes(raster, top, bottom, self._frame.threads)
        shares = self._frame.shares
        if shares is None or not takes_light:
            return drawn
        # pixels of the whole picture, of which others have none
        width, height = self._frame.size
        offsets = np.pad(drawn[0], (top * width, (height - bottom) * width), mode="edge")
        reached = shares(offsets, *drawn[1:3])
        return _core.draw_strokes(raster, top, bottom, self._frame.threads, reached)


def kind_of(one: Strokes) -> tuple[bool, bool, bool]:
    """What those have in common that are drawn together: solid, in pixels, lit."""
    return one.solid, one.in_pixels, one.lit


def how_drawn(one: Strokes, antialias: bool) -> tuple[bool, bool, bool, int]:
    """moit_stroking of csrc/moit_geometry.h."""
    return (*kind_of(one), SAMPLES if antialias else 1)


def joined(several: list[Strokes]) -> tuple[Array, ...]:
    """The arrays of all, as the core takes them."""
    names = ("positions", "sizes", "color", "alpha")
    if len(several) == 1:
        return (several[0].first, *(getattr(several[0], name) for name in names))
    before = np.cumsum([0, *(len(one.positions) for one in several)])
    ends = [one.first[1:] + start for one, start in zip(several, before[:-1], strict=True)]
    arrays = (np.concatenate([getattr(one, name) for one in several]) for name in names)
    return (np.concatenate([np.zeros(1, np.int64), *ends]), *arrays)


def _of_foreign(
    value: Any, kind: str, color: ArrayLike
) -> tuple[ArrayLike, tuple[Array, Array] | None, ArrayLike]:
    """Places, cells as `foreign_cells` has them, and colour: of another library's mesh its own,
    unless one is given."""
    given = foreign_cells(value, kind)
    if given is None:
        return value, None, color
    places, which, sizes, own = given
    return places, (which, sizes), own if color is GREY and own is not None else color


def _places(value: ArrayLike, name: str) -> Array:
    places = ATTRIBUTES.numbers(value, name, np.float64)
    if places.ndim != 2 or places.shape[1] != 3 or len(places) > MOST_NODES:
        raise PrimitiveError(f"{name}: expected shape (N, 3), got {places.shape}")
    small = np.abs(places) <= FARTHEST
    ATTRIBUTES.check(places, name, small, f"a number of at most {FARTHEST:.3g}")
    return places


def _offsets(value: ArrayLike | None, count: int) -> NDArray[np.int64]:
    if value is None:
        return np.array([0, count] if count else [0], np.int64)
    found = integers(as_array(value, "offsets"), "offsets")
    if found.ndim != 1 or not len(found):
        raise PrimitiveError(f"offsets: expected shape (L + 1,), got {found.shape}")
    if found[0] != 0 or found[-1] != count:
        raise PrimitiveError(
            f"offsets: found {found[0]} to {found[-1]}; needed 0 to {count}, the number of points"
        )
    falls = np.diff(found.astype(np.int64)) < 0
    if falls.any():
        at = int(np.argmax(falls))
        raise PrimitiveError(
            f"offsets[{at + 1}]: found {found[at + 1]} after {found[at]}; needed numbers that do "
            "not fall"
        )
    return found.astype(np.int64)
