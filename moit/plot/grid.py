"""Pictures side by side as in a paper: a scene a row, a technique a column.

Every place is computed in inches before anything is drawn: pictures keep their shape, texts get
the room that they need, and the figure is as high as all of it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from moit.plot.crops import FRAMES, Crop
from moit.plot.style import Style, new_figure
from moit.plot.texts import fitted
from moit.reports.pictures import error_palette

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
else:  # what `typing.get_type_hints` reads, without loading it
    Axes = Figure = Any

Array = NDArray[Any]

GAP = 0.05  # inches between pictures
TALLEST = 1.5  # height of a picture, in widths of its column
LINE = 1.22  # height of a line of text, in its size
BAR = 0.06  # inches that the bar of colours is high


@dataclass(frozen=True)
class Cell:
    """A technique's picture: its heading, and what stands below it.

    pixels : (H, W, 3) sRGB bytes; None: there are none.
    errors : (H, W) map of errors.
    """

    name: str
    heading: str
    note: str
    pixels: Array | None = None
    errors: Array | None = None


@dataclass(frozen=True)
class Row:
    """A scene: the exact picture, which begins each line of others, and these."""

    name: str
    exact: Cell
    cells: Sequence[Cell]
    crops: Sequence[Crop] = ()

    @property
    def shape(self) -> tuple[int, int]:
        assert self.exact.pixels is not None
        height, width = self.exact.pixels.shape[:2]
        return height, width


@dataclass
class Grid:
    """What is drawn on, and where."""

    style: Style
    wide: int  # techniques side by side, beside the exact picture
    scale: float  # the error at the end of the colours
    metric: str  # what maps show
    has_maps: bool
    figure: Figure = field(init=False)
    size: tuple[float, float] = (0.0, 0.0)  # inches
    left: float = 0.0  # where pictures begin
    column: float = 0.0  # how wide they are
    maps: dict[tuple[str, str], Axes] = field(default_factory=dict)  # by scene and technique

    @property
    def text(self) -> float:
        return self.style.text

    def lines(self, count: float) -> float:
        """Inches of that many lines of text."""
        return count * LINE * self.text / 72

    def x(self, place: int) -> float:
        return self.left + place * (self.column + GAP)

    def axes(self, x: float, y: float, width: float, height: float, label: str) -> Axes:
        """Empty Axes at (x, y) from the upper left; `label` names them in SVG and for readers."""
        w, h = self.size
        ax: Axes = self.figure.add_axes(
            (x / w, 1 - (y + height) / h, width / w, height / h), label=label, xticks=[], yticks=[]
        )
        ax.spines[:].set_visible(False)
        return ax

    def empty(self) -> Axes:
        """Axes that show nothing, in a place where there is no technique."""
        ax = self.axes(0.0, 0.0, 0.01, 0.01, "nothing")
        ax.set_axis_off()
        return ax

    def write(self, x: float, y: float, text: str, size: float, **options: Any) -> None:
        w, h = self.size
        how: dict[str, Any] = {"ha": "center", "va": "top", "linespacing": LINE * 0.94, **options}
        self.figure.text(x / w, 1 - y / h, text, fontsize=size, parse_math=False, **how)


def draw_grid(
    rows: Sequence[Row], style: Style, columns: int, scale: float, metric: str, has_maps: bool
) -> Grid:
    """The figure of these rows, each in as many lines as `columns` techniques a line need."""
    most = max((len(row.cells) for row in rows), default=0)
    lines = max(math.ceil(most / columns), 1)
    grid = Grid(style, max(math.ceil(most / lines), 1), scale, metric, has_maps)
    width = 0.45 + (grid.wide + 1) * 1.9 if style.width is None else style.width
    grid.left = grid.lines(2) + 0.06  # the scene's name, turned
    grid.column = (width - grid.left - 0.02 - grid.wide * GAP) / (grid.wide + 1)
    bands = [band for row in rows for band in _bands(row, grid, row is rows[0])]
    y = 0.03
    for band in bands:
        band.top = y
        y = band.bottom + grid.lines(0.35)
    grid.size = (width, y)
    dots = max(row.shape[1] for row in rows) / grid.column
    rc = {**style.rc, "savefig.dpi": min(max(dots, 100.0, style.rc.get("savefig.dpi", 0)), 300.0)}
    grid.figure = new_figure(grid.size, Style(style.width, rc, style.text), "none")
    for band in bands:
        band.draw()
    for row in rows:
        own = [band for band in bands if band.row is row]
        top, bottom = own[0].picture, own[-1].bottom
        name, size = fitted(row.name, bottom - top, grid.text, 2, ends=True)
        at = (grid.left - 0.05, (top + bottom) / 2)
        grid.write(*at, name, size, rotation=90, ha="right", va="center", multialignment="center")
    return grid


@dataclass
class Band:
    """A line of pictures: headings, pictures, their crops, their maps, and what is below."""

    row: Row
    cells: Sequence[Cell]
    grid: Grid
    headings: Sequence[tuple[str, float]]
    notes: Sequence[tuple[str, float]]
    is_first: bool
    top: float = 0.0

    @property
    def picture(self) -> float:
        """Where pictures begin."""
        lines = max((text.count("\n") + 1 for text, _ in self.headings if text), default=0)
        return self.top + self.grid.lines(lines + 0.25 if lines else 0)

    @property
    def picture_size(self) -> tuple[float, float]:
        """Width and height; less wide than its column where it is tall."""
        height, width = self.row.shape
        high = min(self.grid.column * height / width, TALLEST * self.grid.column)
        return high * width / height, high

    @property
    def strip(self) -> float:
        """Where crops begin."""
        return self.picture + self.picture_size[1] + (0.6 * GAP if self.row.crops else 0)

    @property
    def crops_height(self) -> float:
        """All crops are as high, and together as wide as the picture or less."""
        if not self.row.crops:
            return 0.0
        width, height = self.picture_size
        shapes = sum(wide / high for _, _, high, wide in self.row.crops)
        return min((width - GAP * (len(self.row.crops) - 1)) / shapes, height)

    @property
    def map(self) -> float:
        """Where maps begin."""
        return self.strip + self.crops_height + (0.6 * GAP if self.grid.has_maps else 0)

    @property
    def map_height(self) -> float:
        return self.picture_size[1] if self.grid.has_maps else 0.0

    @property
    def bottom(self) -> float:
        lines = max(text.count("\n") + 1 for text, _ in self.notes)
        return self.map + self.map_height + self.grid.lines(lines + 0.2)

    def draw(self) -> None:
        for place, cell in enumerate(self.cells):
            self._draw(place, cell)

    def _draw(self, place: int, cell: Cell) -> None:
        grid, row = self.grid, self.row
        width, height = self.picture_size
        x = grid.x(place) + (grid.column - width) / 2
        middle = grid.x(place) + grid.column / 2
        heading, size = self.headings[place]
        if heading:
            grid.write(middle, self.picture - grid.lines(0.2), heading, size, va="bottom")
        where = f"{row.name}: {cell.name}"
        is_exact = cell is row.exact
        note, size = self.notes[place]
        below = self.strip + self.crops_height if is_exact else self.map + self.map_height
        ax = grid.axes(x, self.picture, width, height, where)
        if cell.pixels is None:
            ax.set_facecolor("0.93")
            words, small = fitted("no picture", width, grid.text, 2)
            ax.text(0.5, 0.5, words, fontsize=small, color="0.4", ha="center", va="center")
        else:
            ax.imshow(cell.pixels, aspect="auto")
            self._crops(ax, cell.pixels, x, where)
        if grid.has_maps and is_exact and self.is_first:
            _bar(grid, x, self.map + grid.lines(1.4), width)
        if grid.has_maps and not is_exact:
            ax = grid.axes(x, self.map, width, height, f"{where}, {grid.metric}")
            grid.maps[row.name, cell.name] = ax
            ax.set_facecolor("0.93")
            if cell.errors is not None:
                ax.imshow(
                    cell.errors, cmap=_error_colours(), vmin=0, vmax=grid.scale, aspect="auto"
                )
        grid.write(middle, below + grid.lines(0.15), note, size)

    def _crops(self, ax: Axes, pixels: Array, x: float, where: str) -> None:
        from matplotlib.patches import Rectangle

        crops, high = self.row.crops, self.crops_height
        widths = [high * wide / tall for _, _, tall, wide in crops]
        x += (self.picture_size[0] - sum(widths) - GAP * (len(crops) - 1)) / 2
        for i, ((top, left, tall, wide), width, colour) in enumerate(
            zip(crops, widths, FRAMES, strict=False)
        ):
            ax.add_patch(
                Rectangle((left - 0.5, top - 0.5), wide, tall, fill=False, color=colour, lw=1.0)
            )
            inset = self.grid.axes(x, self.strip, width, high, f"{where}, crop {i + 1}")
            # Pixels as they are, in files of vectors too.
            inset.imshow(
                pixels[top : top + tall, left : left + wide], aspect="auto", interpolation="none"
            )
            inset.spines[:].set(visible=True, color=colour, linewidth=1.4)
            x += width + GAP


def _bands(row: Row, grid: Grid, is_first: bool) -> list[Band]:
    """Headings stand above each line, but once where every scene has one line of the same."""
    found = []
    several = len(row.cells) > grid.wide
    for start in range(0, max(len(row.cells), 1), grid.wide):
        cells = [row.exact, *row.cells[start : start + grid.wide]]
        shown = is_first or several
        headings = [
            _heading(cell.heading, cell.name, grid) if shown else ("", 0.0) for cell in cells
        ]
        notes = [fitted(cell.note, grid.column, grid.text, 1) for cell in cells]
        found.append(Band(row, cells, grid, headings, notes, is_first and not start))
    return found


def _heading(heading: str, name: str, grid: Grid) -> tuple[str, float]:
    """In one line where that has room, else what follows the name in a line of its own."""
    text, size = fitted(heading, grid.column, grid.text, 1)
    if size >= grid.text - 1:
        return text, size
    text, size = fitted(name, grid.column, grid.text, 2)
    more = heading[len(name) :].lstrip(", ")
    return (f"{text}\n{more}" if more else text), size


def _error_colours() -> Any:
    from matplotlib.colors import ListedColormap

    return ListedColormap(error_palette() / 255.0, name="moit-error")


def _bar(grid: Grid, x: float, y: float, width: float) -> None:
    """What the colours of maps mean, where the exact picture has no map."""
    ax = grid.axes(x, y, width, BAR, f"colours of {grid.metric}")
    ax.imshow(np.arange(256)[None], cmap=_error_colours(), aspect="auto", interpolation="none")
    under = y + BAR + 0.02
    words = (("left", "0"), ("center", grid.metric), ("right", f"{grid.scale:.2g}"))
    _, size = fitted("   ".join(word for _, word in words), width, grid.text, 1)
    for (side, word), at in zip(words, (x, x + width / 2, x + width), strict=True):
        grid.write(at, under, word, size, ha=side)
