"""How figures are made: their sizes and texts on screens and in papers, and how they are saved."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
else:  # what `typing.get_type_hints` reads, without loading it
    Axes = Figure = Any


@dataclass(frozen=True)
class Style:
    """width : of the figure in inches; None: as each figure has it on a screen.
    rc : matplotlib's settings, those of the user where it says nothing. text : points."""

    width: float | None = None
    rc: dict[str, Any] = field(default_factory=dict)
    text: float = 9.0

    @property
    def grows(self) -> str:
        """What a figure may gain by a legend: on a screen its width, in a column its height."""
        return "width" if self.width is None else "height"

    def size(self, width: float, height: float) -> tuple[float, float]:
        """What a figure of that size on a screen measures."""
        if self.width is None:
            return width, height
        # Texts do not shrink with the column, so a narrow figure is less wide for its height.
        return self.width, self.width * max(height / width, 0.68 if self.width < 4 else 0.5)


_PAPER = {
    "font.size": 8.0,
    "axes.titlesize": 8.0,
    "axes.labelsize": 8.0,
    "xtick.labelsize": 7.0,
    "ytick.labelsize": 7.0,
    "legend.fontsize": 7.0,
    "legend.handlelength": 1.8,
    "axes.linewidth": 0.6,
    "grid.linewidth": 0.5,
    "lines.linewidth": 1.1,
    "lines.markersize": 4.0,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.major.size": 2.5,
    "ytick.major.size": 2.5,
    "axes.labelpad": 2.5,
    "axes.titlepad": 4.0,
    "savefig.dpi": 300,
}
STYLES: dict[str | None, Style] = {
    None: Style(),
    "paper": Style(3.33, _PAPER, 7.0),  # a column of two, as ACM and IEEE have them
    "paper-double": Style(7.0, _PAPER, 7.0),  # both columns
}


def checked_style(style: str | None) -> Style:
    """The style of that name; raises ValueError for others."""
    if style is not None and (not isinstance(style, str) or style not in STYLES):
        known = ", ".join(repr(one) for one in STYLES if one)
        raise ValueError(f"style: expected {known} or None, got {style!r:.80}")
    return STYLES[style]


def require_matplotlib() -> Any:
    """matplotlib.pyplot; raises ImportError that says what to install."""
    try:
        from matplotlib import pyplot
    except ImportError as error:
        raise ImportError(
            f"moit.plot needs matplotlib ({error}); install it with: pip install 'moit[plot]'"
        ) from error
    return pyplot


def new_figure(
    size: tuple[float, float], style: Style, layout: Literal["constrained", "none"]
) -> Figure:
    """A figure of pyplot's, of `size` inches, whose files hold texts as texts."""
    pyplot = require_matplotlib()
    from moit.plot.clean_figure import CleanFigure

    figure: Figure = pyplot.figure(
        figsize=size, FigureClass=CleanFigure, layout=layout, settings=style.rc
    )
    return figure


def new_axes(size: tuple[float, float], style: Style) -> Axes:
    """Axes that fill such a figure."""
    axes: Axes = new_figure(style.size(*size), style, "constrained").subplots()
    settle(axes)
    return axes


def settle(ax: Axes) -> None:
    """Gives the settings of now to all ticks, which matplotlib makes as late as when it draws."""
    from matplotlib import rcParams

    now: Any = rcParams
    for axis in ("x", "y"):
        ax.tick_params(
            "x" if axis == "x" else "y",
            labelsize=now[f"{axis}tick.labelsize"],
            length=now[f"{axis}tick.major.size"],
            width=now[f"{axis}tick.major.width"],
            grid_linewidth=now["grid.linewidth"],
        )


@contextmanager
def settings(style: Style) -> Iterator[None]:
    """A context in which matplotlib has the style's settings.

    Unlike matplotlib's own it leaves all others as they become: the first figure of a session
    chooses how figures are shown, and Jupyter would show none.
    """
    require_matplotlib()
    from matplotlib import rcParams

    now: Any = rcParams
    before = {name: now[name] for name in style.rc}
    now.update(style.rc)
    try:
        yield
    finally:
        now.update(before)
