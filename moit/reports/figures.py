"""Charts drawn by matplotlib, onto Axes."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
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

LINES: dict[str, Any] = {"solid": "-", "dotted": ":", "dashed": (0, (4, 2)), "dashdot": "-."}


def draw(chart: Chart, ax: Axes) -> None:
    """Draws a chart; its names become labels, for a legend or beside their markers."""
    if isinstance(chart, CurveChart):
        _curves(chart, ax)
    elif isinstance(chart, DialChart):
        _dial(chart, ax)
    else:
        _errors(chart, ax)


def _curves(chart: CurveChart, ax: Axes) -> None:
    for one in chart.series:
        style = LINES[one.line]
        ax.plot(
            chart.depth, one.y, label=one.name, color=one.colour, linestyle=style, linewidth=1.4
        )
    if chart.exact is not None:
        ax.plot(chart.depth, chart.exact, label="exact", color="black", linewidth=1.8)
    ax.set(xlabel="depth", ylabel="transmittance", ylim=(-0.02, 1.02))


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
            linewidth=1.3,
            marker="o",
            markersize=2.5,
        )
    ax.set_xticks(places, [f"{value:g}" for value in chart.dial], fontsize=7)
    ax.tick_params(axis="y", labelsize=7)
    ax.set_xlabel(chart.x_title, fontsize=8)
    ax.grid(True, which="major", alpha=0.3)


def _errors(chart: ErrorChart, ax: Axes) -> None:
    from moit.reports.labels import Labels

    shown = chart.shown
    height = _value_axis(ax, [p.y for p in shown], chart.least)
    _log_scale(ax, [p.x for p in shown])
    groups = list(dict.fromkeys(p.front for p in shown))
    texts = []
    for group, marker in zip(groups, _markers(len(groups)), strict=True):
        best = []
        for p in (p for p in shown if p.front == group):
            at = (p.x, height(p.y))
            texts.append((p.name, at, p.on_front))
            best += [at] if p.on_front else []
            ax.plot(
                *at,
                marker,
                color=p.colour,
                markerfacecolor=(p.colour, 1.0 if p.on_front else 0.35),
                markersize=6,
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
    ax.add_artist(Labels(sorted(texts, key=lambda one: not one[2])))
    _cost_ticks(ax, chart.x_unit, [p.x for p in shown])
    ax.set(xlabel=chart.x_title, ylabel=chart.y_title)
    ax.grid(True, which="major", alpha=0.3)
    if len(groups) > 1:
        _group_legend(ax, groups)


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
    """Round numbers with their units, as many as there is room for."""
    from matplotlib.ticker import FixedFormatter, FixedLocator, NullLocator

    values = [cost for cost in costs if cost > 0]
    if not values or not unit:
        return
    low, high = math.log10(min(values)), math.log10(max(values))
    if unit == "bits":
        powers = range(math.floor(low / math.log10(2)), math.ceil(high / math.log10(2)) + 1)
        every = max(1, len(powers) // 8)
        ticks = [0.0, *(2.0**power for power in list(powers)[::every])]
        names = [short(tick) for tick in ticks]
    else:
        figure = ax.get_figure()
        dots = 72 / figure.dpi if figure is not None else 1.0
        decade = ax.get_window_extent().width * dots / max(high - low, 0.3)  # in points
        factors: tuple[int, ...] = (1, 2, 5) if decade > 125 else (1, 3) if decade > 80 else (1,)
        powers = range(math.floor(low) - 1, math.ceil(high) + 1)
        ticks = [k * 10.0**power for power in powers for k in factors]
        names = [_duration(tick) for tick in ticks]
    # Unlike set_xticks these leave limits alone, and margins that are chosen later have ticks, too.
    ax.xaxis.set_major_locator(FixedLocator(ticks))
    ax.xaxis.set_major_formatter(FixedFormatter(names))
    ax.xaxis.set_minor_locator(NullLocator())


def _duration(seconds: float) -> str:
    for unit, size in (("s", 1.0), ("ms", 1e-3), ("µs", 1e-6)):
        if seconds >= 0.999 * size:
            return f"{short(seconds / size)} {unit}"
    return f"{short(seconds / 1e-9)} ns"


def _group_legend(ax: Axes, names: Sequence[str]) -> None:
    from matplotlib.lines import Line2D

    handles = [
        Line2D([], [], color="0.35", linestyle="", marker=marker, label=name)
        for name, marker in zip(names, _markers(len(names)), strict=True)
    ]
    ax.legend(
        handles=handles,
        ncols=6,
        frameon=False,
        fontsize=8,
        loc="lower left",  # its corner, above the Axes
        bbox_to_anchor=(0.0, 1.0),
        borderaxespad=0.2,
    )


def _markers(count: int) -> str:
    return ("osD^vP*Xph<>" * (1 + count // 12))[:count]
