"""Legends beside what they explain: never over it, and never beyond the figure."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from moit.plot.texts import broken

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.legend import Legend

LONGEST = 2.1  # inches of a name in one line
BESIDE = 0.34  # share of the Axes' width that a legend at their right may take,
OF_FIGURE = 0.26  # and of the width of a whole figure


def place_legend(
    ax: Axes, handles: Sequence[Any], names: Sequence[str], grows: str | None, **options: Any
) -> None:
    """A legend right of the Axes where these are wide enough, else below them; in a figure without
    a layout of its own, where nothing would make room, within them.

    grows : "width" or "height": how a figure of ours makes room; None: it is somebody's.
    """
    if not handles:
        return
    from matplotlib import rcParams
    from matplotlib.font_manager import FontProperties
    from matplotlib.layout_engine import ConstrainedLayoutEngine, TightLayoutEngine

    figure = ax.get_figure(root=True)
    assert figure is not None
    size = FontProperties(size=rcParams["legend.fontsize"]).get_size_in_points()
    texts = ["\n".join(broken(name, LONGEST, size)) for name in names]
    common: dict[str, Any] = {"frameon": False, **options}
    if not isinstance(figure.get_layout_engine(), (ConstrainedLayoutEngine, TightLayoutEngine)):
        ax.legend(handles, texts, loc="best", **common)
        return
    wide, high = figure.get_size_inches()
    room = wide if grows else ax.get_window_extent().width / figure.dpi
    legend = ax.legend(
        handles, texts, loc="upper left", bbox_to_anchor=(1.0, 1.0), borderaxespad=0.3, **common
    )
    beside, tall = _inches(legend)
    if grows == "width" and tall < high - 0.3:
        figure.set_figwidth(wide + beside)
        return
    if beside <= (OF_FIGURE if grows else BESIDE) * room:
        return

    def below(columns: int, texts: Sequence[str] = texts) -> Legend:
        return ax.legend(
            handles, texts, loc="upper center", bbox_to_anchor=(0.5, 0.0), ncols=columns,
            bbox_transform=_under(ax), borderaxespad=0.0, columnspacing=1.2, **common,
        )  # fmt: skip

    widest = 0.9 * wide if grows else room
    legend = _widest_that_fits(below, len(texts), widest)
    if _inches(legend)[0] > widest:
        left = max(widest - 4 * size / 72, 4 * size / 72)
        legend = below(1, ["\n".join(broken(name, left, size)) for name in names])
    if grows:
        figure.set_figheight(high + _inches(legend)[1])


def _widest_that_fits(make: Callable[[int], Legend], count: int, width: float) -> Legend:
    """With as many columns as have room, and no more than its rows need."""
    for columns in range(min(count, 8), 0, -1):
        rows = -(-count // columns)
        if -(-count // rows) < columns:
            continue  # its last columns would be empty
        legend = make(columns)
        if _inches(legend)[0] <= width:
            break
    return legend


def _inches(legend: Legend) -> tuple[float, float]:
    box = legend.get_window_extent()
    figure = legend.get_figure(root=True)
    assert figure is not None
    return box.width / figure.dpi, box.height / figure.dpi


def _under(ax: Axes) -> Any:
    """Axes' coordinates, moved down below the ticks and the title of the x axis."""
    from matplotlib.transforms import ScaledTranslation

    figure = ax.get_figure(root=True)
    assert figure is not None
    box = ax.xaxis.get_tightbbox()
    deep = 0.4 if box is None else (ax.get_window_extent().y0 - box.y0) / figure.dpi + 0.08
    return ax.transAxes + ScaledTranslation(0, -deep, figure.dpi_scale_trans)
