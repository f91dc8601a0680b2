"""Volumes on regular grids, made of arrays."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from moit import _core
from moit.checks.exceptions import PrimitiveError
from moit.checks.unchanging import Unchanging
from moit.geometry.attributes import Attributes
from moit.geometry.drawing import Emitted, Frame, one_after_the_other
from moit.geometry.foreign import foreign_grid

Array = NDArray[Any]

ATTRIBUTES = Attributes(PrimitiveError)
MOST_SLABS = 65536  # fragments that a pixel may have of one volume
ROWS = 256  # of the table that a function is asked for


class Volume(Unchanging):
    """What absorbs light and gives it, at the points of a regular grid, linear between them:
    clouds, flames, fields of numbers.

    grid : (X, Y, Z) numbers, of which `transfer` says the meaning, or (X, Y, Z, 4): red, green,
        blue, and absorbance of a unit of length, in nepers. At least two points along each axis.
        Or a pyvista.ImageData, or what has its attributes: the active scalars of its points.
    spacing : how far apart points are, in units of the scene: a number or (3,), positive. None: 1,
        or an ImageData's own.
    transfer : of numbers of the grid (R, 4) at equal distances from limits[0] to limits[1], between
        which it is linear: red, green, blue, linear and not multiplied by anything, and absorbance
        of a unit of length, none negative; or a function of numbers (R,) that gives that. None: the
        numbers are absorbances, of white.
    origin : (3,) where grid[0, 0, 0] is. None: (0, 0, 0), or an ImageData's own.
    limits : of transfer: (lower, upper) numbers, the first below the second; what is beyond counts
        as these. None: the least and the greatest of the grid.
    step : how thick fragments are, along the view; positive, and not so thin that the grid would
        have more than 65,536. None: twice the widest spacing.

    A ray through the middle of each pixel is marched cell by cell. What it meets between depths
    that are whole multiples of `step` is one fragment, from its front (`depth`) to its `back`, that
    absorbs just what is there: the integral is exact where absorbance is linear between points of
    the grid, and alpha is 1 - exp of minus that. Where `transfer` bends in a cell it is Simpson's
    rule, which may miss a peak narrower than what the cell changes by: a finer grid does not. Its
    colour is what is seen of it from the front.
    So techniques get thick fragments, as deep images have them; a smaller step tells more precisely
    where in a cloud something is.

    Arrays are held as read-only float32 copies. Raises PrimitiveError (a ValueError) or TypeError
    that name the argument.

    >>> fog = moit.Volume(np.full((2, 2, 2), 0.7), origin=(-0.5, -0.5, -0.5), step=10)
    >>> f = moit.rasterize(fog, moit.Camera(), (3, 3))
    >>> f.depth[0].item(), f.back[0].item(), round(f.alpha[0].item(), 3)  # 1 - exp(-0.7)
    (2.5, 3.5, 0.503)
    """

    __slots__ = ("grid", "limits", "origin", "spacing", "step", "table")

    grid: NDArray[np.float32]
    table: NDArray[np.float32]
    limits: tuple[float, float]
    origin: tuple[float, float, float]
    spacing: tuple[float, float, float]
    step: float

    def __init__(
        self,
        grid: ArrayLike | Any,
        spacing: ArrayLike | None = None,
        transfer: ArrayLike | Callable[[Array], Any] | None = None,
        *,
        origin: ArrayLike | None = None,
        limits: tuple[float, float] | None = None,
        step: float | None = None,
    ) -> None:
        numbers, apart_there, start = foreign_grid(grid) or (grid, 1.0, (0.0, 0.0, 0.0))
        spacing = apart_there if spacing is None else spacing
        origin = start if origin is None else origin
        values = ATTRIBUTES.numbers(numbers, "grid")
        if values.ndim == 3:
            values = values[..., None]
        if values.ndim != 4 or values.shape[3] not in (1, 4) or min(values.shape[:3]) < 2:
            shape = values.shape[:3] if values.shape[-1:] == (1,) else values.shape
            raise PrimitiveError(
                f"grid: expected (X, Y, Z) or (X, Y, Z, 4), at least 2 along each axis, got {shape}"
            )
        apart = ATTRIBUTES.each(spacing, "spacing", (), 3, np.float64)
        ATTRIBUTES.check(apart, "spacing", apart > 0, "a positive number")
        if values.shape[3] == 4 and not (transfer is None and limits is None):
            raise TypeError("transfer, limits: needed None where grid has colours and absorbances")
        if transfer is None:
            if limits is not None:
                raise TypeError("limits: needed None where transfer is None, which has no limits")
            ATTRIBUTES.check(values, "grid", values >= 0, "an absorbance that is not negative")
        corner = ATTRIBUTES.numbers(origin, "origin", np.float64)
        if corner.shape != (3,):
            raise PrimitiveError(f"origin: expected shape (3,), got {corner.shape}")
        most = ATTRIBUTES.numbers(
            2 * float(apart.max()) if step is None else step, "step", np.float64
        )
        if most.shape != () or not most > 0:
            raise PrimitiveError(f"step: expected a positive number, got {step!r:.80}")
        across = float(np.linalg.norm(apart * np.subtract(values.shape[:3], 1)))
        if most * MOST_SLABS < across:
            raise PrimitiveError(
                f"step: found {float(most):g}; needed at least {across / MOST_SLABS:.3g}, of which "
                f"{MOST_SLABS} go through the grid"
            )
        found, table = _table(transfer, limits, values)
        held = {
            "grid": values,
            "table": table,
            "limits": found,
            "origin": tuple(corner.tolist()),
            "spacing": tuple(apart.tolist()),
            "step": float(most),
        }
        for name, value in held.items():
            if isinstance(value, np.ndarray):
                value.flags.writeable = False
            object.__setattr__(self, name, value)

    def __setattr__(self, name: str, value: Any) -> None:
        raise AttributeError(f"a Volume does not change: cannot set {name}")

    def __repr__(self) -> str:
        size = "x".join(map(str, self.grid.shape[:3]))
        return f"Volume({size}, step {self.step:g})"

    # As a moit.geometry.drawing.Drawable

    @property
    def points(self) -> Array:
        """(8, 3) the corners of its box."""
        size = np.multiply(self.spacing, np.subtract(self.grid.shape[:3], 1))
        corners = np.array(np.meshgrid(*[(0.0, 1.0)] * 3)).reshape(3, -1).T
        return np.asarray(np.array(self.origin) + corners * size)

    @property
    def transparent_points(self) -> Array:
        return self.points

    @classmethod
    def emit(cls, several: Sequence[Volume], frame: Frame) -> Emitted:
        """Thick fragments: their backs are the last of five arrays."""
        emitted = [_emitted(*_marched(one, frame, 0, frame.size[1])) for one in several]
        return emitted[0] if len(emitted) == 1 else one_after_the_other(emitted)

    @classmethod
    def begin(cls, several: Sequence[Volume], frame: Frame) -> VolumePicture:
        """What `emit` gives, in bands of rows."""
        return VolumePicture(several, frame)


class VolumePicture:
    """Volumes as one picture sees them: a `moit.geometry.drawing.InBands`.

    What is found while counting is kept as long as it is few; else rows are marched again.
    """

    def __init__(self, several: Sequence[Volume], frame: Frame) -> None:
        self._several, self._frame = several, frame
        self.samples = np.zeros(frame.size[1], np.int64)
        self.depths = (np.inf, -np.inf)
        self._kept: list[Emitted] | None = []
        for one in several:
            self._count(one)

    def _count(self, one: Volume) -> None:
        width, height = self._frame.size
        bands = []
        for top in range(0, height, COUNTED_ROWS):
            bottom = min(top + COUNTED_ROWS, height)
            offsets, rows = _marched(one, self._frame, top, bottom)
            self.samples[top:bottom] += np.diff(offsets[::width])
            self.depths = (  # within those of the box, which all of it is warped by
                min(self.depths[0], float(rows[:, 0].min(initial=np.inf))),
                max(self.depths[1], float(rows[:, 1].max(initial=-np.inf))),
            )
            if self.samples.sum() > MOST_KEPT:
                self._kept = None
            if self._kept is not None:
                bands.append((offsets, rows))
        if self._kept is not None:
            self._kept.append(_emitted(*_under_each_other(bands)))

    def rows(self, top: int, bottom: int) -> Emitted:
        emitted: list[Emitted]
        if self._kept is None:
            emitted = [_emitted(*_marched(one, self._frame, top, bottom)) for one in self._several]
        else:
            emitted = [_rows_of(one, self._frame.size[0], top, bottom) for one in self._kept]
        return emitted[0] if len(emitted) == 1 else one_after_the_other(emitted)


COUNTED_ROWS = 32  # that are marched at once while counting
MOST_KEPT = 1 << 22  # fragments: 100 MB of them


def _marched(one: Volume, frame: Frame, top: int, bottom: int) -> tuple[Array, Array]:
    """(offsets, numbers) of rows [top, bottom), as the core has them."""
    seen = (frame.eye, *frame.axes, frame.scale, frame.near, frame.far)
    grid = (one.grid, one.origin, one.spacing, one.table, *one.limits)
    return _core.march_grid(*grid, seen, one.step, *frame.size, top, bottom, frame.threads)


def _emitted(offsets: Array, rows: Array) -> Emitted:
    columns = np.ascontiguousarray(rows[:, :3].T)
    color = np.ascontiguousarray(rows[:, 3:])
    return offsets, columns[0], columns[2], color, columns[1]


def _under_each_other(bands: Sequence[tuple[Array, Array]]) -> tuple[Array, Array]:
    before = np.cumsum([0, *(len(rows) for _, rows in bands)])
    ends = [offsets[1:] + start for (offsets, _), start in zip(bands, before[:-1], strict=True)]
    return np.concatenate([[0], *ends]), np.concatenate([rows for _, rows in bands])


def _rows_of(whole: Emitted, width: int, top: int, bottom: int) -> Emitted:
    offsets, *arrays = whole
    own = offsets[top * width : bottom * width + 1]
    return own - own[0], *(array[own[0] : own[-1]] for array in arrays)


def _table(
    transfer: Any, limits: tuple[float, float] | None, values: Array
) -> tuple[tuple[float, float], Array]:
    """The limits and what is between."""
    if transfer is None:
        most = float(values.max()) or 1.0
        return (0.0, most), np.array([(1, 1, 1, 0), (1, 1, 1, most)], np.float32)
    if limits is None:
        low, high = float(values.min()), float(values.max())
        high = high if low < high else low + 1.0
    else:
        pair = ATTRIBUTES.numbers(limits, "limits", np.float64)
        if pair.shape != (2,) or not pair[0] < pair[1]:
            raise PrimitiveError(
                f"limits: expected (lower, upper), the first below the second, got {limits!r:.80}"
            )
        low, high = pair.tolist()
    given = transfer(np.linspace(low, high, ROWS)) if callable(transfer) else transfer
    table = ATTRIBUTES.numbers(given, "transfer")
    rows = ROWS if callable(transfer) else max(len(table), 1) if table.ndim else 1
    if table.shape != (rows, 4):
        needed = f"({ROWS if callable(transfer) else 'R'}, 4)"
        raise PrimitiveError(f"transfer: expected shape {needed}, got {table.shape}")
    ATTRIBUTES.check(table, "transfer", table >= 0, "a number that is not negative")
    return (low, high), table
