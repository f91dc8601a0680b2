"""Figures of error over cost."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from moit.catalog import Technique
from moit.catalog.palette import family_title, technique_colours, technique_family
from moit.checks.arguments import truth
from moit.comparing.charts import errors_chart
from moit.comparing.report import Report
from moit.comparing.rows import cost_field
from moit.plot.arguments import checked_axes, scene_names, technique_names
from moit.plot.legends import place_legend
from moit.plot.style import checked_style, new_axes, settings
from moit.reports.charts import ErrorChart
from moit.reports.figures import draw, marker_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
else:  # what `typing.get_type_hints` reads, without loading it
    Axes = Any

COSTS = {
    "seconds": ("time of a picture (median)", "s"),
    "bits_per_pixel": ("bits per pixel", "bits"),
    "gpu_ms": ("time of a frame, predicted", "s"),
}
FEW = 12  # names that all have room beside their markers
TONES = 3  # of a family, in the legend


def speed_error(
    report: Report,
    metric: str | None = None,
    by: str = "seconds",
    *,
    scene: str | None = None,
    ax: Axes | None = None,
    labels: str | Technique | Iterable[str | Technique] | None = None,
    legend: bool = True,
    style: str | None = None,
) -> Axes:
    """Error over cost, logarithmic, a marker per row; those that nothing beats are joined.

    metric : a metric's name or T_mae, T_p99, T_max; None: FLIP where there is one.
    by : "seconds", "bits", or "gpu": what `Report.on_gpu` predicts.
    scene : one scene's name; None: all, each with its marker.
    ax : where to draw; None: a new figure, which is the result's `.figure`.
    labels : techniques whose names stand beside their markers, besides those of the front; None:
        all, where these are twelve at most.
    legend, style : as `curves`.

    Full markers are the Pareto front, pale ones are beaten. Colours tell families, which the legend
    names. Errors below a thousandth of the greatest, such as roundings of `sorted`, stand in a row
    of their own at the bottom. Names find their places when the figure is drawn, those of the front
    first; a name without room for it is left out. Rows without the cost or the error are left out.
    Raises ValueError for unknown names.

    >>> f = moit.scenes.load("panes", (8, 6))
    >>> report = moit.compare(f, ["wboit", "power4"], metrics="mse", repeat=1, progress=False)
    >>> ax = moit.plot.speed_error(report, "mse", by="bits")
    >>> bool(ax.get_xlabel())
    True
    """
    made = checked_style(style)
    has_legend = truth("legend", legend)
    checked_axes(ax)
    names = scene_names(report, scene, "scene")
    metric = report.main_metric() if metric is None else metric
    techniques = list(dict.fromkeys(row["technique"] for row in report.rows))
    palette = dict(zip(techniques, technique_colours(techniques), strict=True))
    rows = [row for row in report.rows if row["scene"] in names]
    title, unit = COSTS[cost_field(by)]
    factor = 1e-3 if by == "gpu" else 1.0  # charts have times in seconds
    chart = errors_chart(report, rows, metric, by, palette, {}, factor, title, unit)
    named = None
    if labels is not None or len({p.name for p in chart.shown}) > FEW:
        asked = [] if labels is None else technique_names(labels, techniques, "labels")
        named = {p.name for p in chart.shown for one in asked if p.technique == one}
    with settings(made):
        grows = made.grows if ax is None else None
        ax = new_axes((8.0, 4.6), made) if ax is None else ax
        draw(chart, ax, named)
        if has_legend:
            _legend(chart, ax, grows)
    return ax


def _legend(chart: ErrorChart, ax: Axes, grows: str | None) -> None:
    """The fronts' markers where there are several, and the tones of families."""
    from matplotlib.legend_handler import HandlerTuple
    from matplotlib.lines import Line2D

    def mark(colour: str, marker: str) -> Line2D:
        return Line2D([], [], color=colour, linestyle="", marker=marker, markersize=4.5)

    fronts = list(dict.fromkeys(p.front for p in chart.shown))
    handles: list[Any] = []
    names = []
    if len(fronts) > 1:
        handles += [(mark("0.35", marker_of(i)),) for i in range(len(fronts))]
        names += fronts
    tones: dict[str, list[str]] = {}
    for p in sorted(chart.shown, key=lambda p: technique_family(p.technique)):
        found = tones.setdefault(family_title(p.technique), [])
        if p.colour not in found:
            found.append(p.colour)
    if sum(map(len, tones.values())) > 1:
        for title, colours in tones.items():
            every = max(len(colours) // TONES, 1)
            handles.append(tuple(mark(one, "o") for one in colours[::every][:TONES]))
            names.append(title)
    most = max((len(one) for one in handles), default=1)
    apart = {tuple: HandlerTuple(ndivide=most, pad=0.0)}
    place_legend(ax, handles, names, grows, handler_map=apart, handlelength=0.73 * most)
