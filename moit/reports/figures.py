"""Charts drawn by matplotlib, onto Axes."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from moit.reports.charts import (
    Chart,
    CurveChart,
    DialChart,
    ErrorChart,
    axis_range,
    log_ticks,
    row_label,
    short,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LINES: dict[str, Any] = {
    "solid": "-",
    "dotted": (0, (1, 1.3)),
    "dashed": (0, (4, 1.6)),
    "dashdot": (0, (6, 1.6, 1, 1.6)),
}
MARKERS = "osD^vP*Xph<>"  # of fronts


def draw(chart: Chart, ax: Axes, named: Collection[str] | None = None) -> None:
    """Draws a chart; its names become labels, for a legend or beside their markers.

    named : those of an ErrorChart that stand beside their markers, besides the fronts'; None: all.
    """
    if isinstance(chart, CurveChart):
        _curves(chart, ax)
    elif isinstance(chart, DialChart):
        _dial(chart, ax)
    else:
        _errors(chart, ax, named)


def _curves(chart: CurveChart, ax: Axes) -> None:
    for one in chart.series:
        style = LINES[one.line]
        ax.plot(
            chart.depth,
            one.y,
            label=one.name,
            color=one.colour,
            linestyle=style,
            linewidth=_lines(0.93),
        )
    if chart.exact is not None:
        ax.plot(chart.depth, chart.exact, label="exact", color="black", linewidth=_lines(1.2))
    ax.set(xlabel="depth", ylabel="transmittance", ylim=(-0.02, 1.02))


def _lines(factor: float, what: str = "linewidth") -> float:
    """That much of matplotlib's setting for lines, which styles change."""
    from matplotlib import rcParams

    setting: Any = f"lines.{what}"
    return factor * float(rcParams[setting])


def _dial(chart: DialChart, ax: Axes) -> None:
    given = [float(y) for one in chart.series for y in one.y]
    known = given if chart.scale is None else list(chart.scale)
    height = _value_axis(ax, known, -math.inf if chart.linear else chart.least)
    places = np.arange(len(chart.dial))
    for one in chart.series:
        there = ~np.isnan(one.y)
        ax.plot(
            places[there],
            [height(y) for y in map(float, one.y[there])],
            label=one.name,
            color=one.colour,
            linestyle=LINES[one.line],
            linewidth=_lines(0.87),
            marker="o",
            markersize=2.5,
        )
    names = [short(value) for value in chart.dial]
    figure = ax.get_figure(root=True)
    points = ax.get_window_extent().width * 72 / (figure.dpi if figure is not None else 72)
    every = max(1, math.ceil(len(names) * (max(map(len, names)) * 4.6 + 3) / points))
    shown = [name if (len(names) - 1 - i) % every == 0 else "" for i, name in enumerate(names)]
    ax.set_xticks(places, shown, fontsize=7)
    ax.tick_params(axis="y", labelsize=7)
    ax.set_xlabel(chart.x_title, fontsize=8)
    ax.grid(True, which="major", alpha=0.3)


def _errors(chart: ErrorChart, ax: Axes, named: Collection[str] | None) -> None:
    from moit.reports.labels import Label, Labels

    shown = chart.shown
    height = _value_axis(ax, [p.y for p in shown], chart.least)
    _log_scale(ax, [p.x for p in shown])
    groups = list(dict.fromkeys([*chart.groups, *(p.front for p in shown)]))
    first: list[Label] = []  # these choose their places before the others
    others: list[Label] = []
    unnamed = []
    for i, group in enumerate(groups):
        best = []
        for p in (p for p in shown if p.front == group):
            at = (p.x, height(p.y))
            # What is asked for by its name is as strong as what is on the front.
            strong = p.on_front or (named is not None and p.name in named)
            if p.name and (strong or named is None):
                (first if p.on_front else others).append((p.name, at, strong))
            else:
                unnamed.append(at)
            best += [at] if p.on_front else []
            ax.plot(
                *at,
                marker_of(i),
                color=p.colour,
                markerfacecolor=(p.colour, 1.0 if p.on_front else 0.35),
                markersize=_lines(1.0, "markersize"),
                zorder=3 if p.on_front else 2,
            )
        best.sort()
        ax.plot(
            [x for x, _ in best],
            [y for _, y in best],
            linestyle=(0, (4, 3)),
            color="0.5",
            linewidth=1,
            drawstyle="steps-post",
            label=group,
            zorder=1,
        )
    ax.add_artist(Labels(first + others, unnamed))
    _cost_ticks(ax, chart.x_unit, [p.x for p in shown])
    ax.set(xlabel=chart.x_title, ylabel=chart.y_title)
    ax.grid(True, which="major", alpha=0.3)


def _value_axis(ax: Axes, values: Sequence[float], least: float) -> Callable[[float], float]:
    """Scales the y axis, logarithmic with a row of its own for what is below `least`, linear where
    that is -inf; returns the height at which a number is shown."""
    known = [y for y in values if math.isfinite(y)]
    if least == -math.inf or not known:
        return lambda y: y
    low = [y for y in known if y < least]
    exponents = axis_range([y for y in known if y >= least])
    bottom, top = (10.0**exponent for exponent in exponents)
    span = top / bottom
    ticks = log_ticks(exponents)
    names = [short(tick) for tick in ticks]
    ax.set_yscale("log")
    row = bottom
    if low:
        row = bottom / span**0.08
        bottom = row / span**0.06
        ticks.insert(0, row)
        names.insert(0, row_label(low))
        ax.axhspan(row / span**0.015, row * span**0.015, color="0.85", zorder=0)
    ax.set_yticks(ticks, names)
    ax.set_yticks([], minor=True)
    ax.set_ylim(bottom, top)
    return lambda y: row if y < least else min(y, top)


def _log_scale(ax: Axes, values: Sequence[float]) -> None:
    """Logarithmic where that shows all there is: zeros lie on a linear piece next to 0."""
    positive = [value for value in values if value > 0]
    if positive and len(positive) < len(values):
        ax.set_xscale("symlog", linthresh=min(positive), linscale=0.4)
    elif positive:
        ax.set_xscale("log")


def _cost_ticks(ax: Axes, unit: str, costs: Sequence[float]) -> None:
    """Round numbers with their units, as many as there is room for when it is drawn."""
    from matplotlib.ticker import FixedFormatter, FixedLocator, FuncFormatter, NullLocator

    from moit.reports.cost_ticks import TimeLocator

    values = [cost for cost in costs if cost > 0]
    if not values or not unit:
        return
    # Unlike set_xticks these leave limits alone, and margins that are chosen later have ticks, too.
    if unit == "bits":
        low, high = (math.log2(edge) for edge in (min(values), max(values)))
        powers = range(math.floor(low), math.ceil(high) + 1)
        every = max(1, len(powers) // 8)
        ticks = [0.0, *(2.0**power for power in list(powers)[::every])]
        ax.xaxis.set_major_locator(FixedLocator(ticks))
        ax.xaxis.set_major_formatter(FixedFormatter([short(tick) for tick in ticks]))
    else:
        ax.xaxis.set_major_locator(TimeLocator(min(values), max(values)))
        ax.xaxis.set_major_formatter(FuncFormatter(lambda tick, _: _duration(tick)))
    ax.xaxis.set_minor_locator(NullLocator())


def _duration(seconds: float) -> str:
    for unit, size in (("s", 1.0), ("ms", 1e-3), ("µs", 1e-6)):
        if seconds >= 0.999 * size:
            return f"{short(seconds / size)} {unit}"
    return f"{short(seconds / 1e-9)} ns"


def marker_of(front: int) -> str:
    """The marker of that front of a chart."""
    return MARKERS[front % len(MARKERS)]
