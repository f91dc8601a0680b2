"""Figures of numbers over the settings of a dial."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from moit.catalog.palette import technique_colours
from moit.plot.arguments import technique_names
from moit.plot.style import checked_style, new_figure, settings, settle
from moit.plot.texts import broken, text_width
from moit.reports.figures import draw

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from moit.numerics.report import StabilityReport
else:  # what `typing.get_type_hints` reads, without loading it
    Figure = StabilityReport = Any

ACROSS = 3  # panels, but in a column of a paper


def stability(
    report: StabilityReport,
    column: str = "T_p99",
    techniques: str | Iterable[str] | None = None,
    precision: str | None = None,
    *,
    style: str | None = None,
) -> Any:
    """A column over the dial, a panel per family: an array of Axes, (rows, 3).

    column : one of numbers of the report, such as T_p99, own_p99, jump, bias_needed.
    techniques : names as in the report; None: all.
    precision : "16 bit", "float32" or "float64"; None: all, dotted, solid and dashed.
    style : as `curves`; for "paper" the array is (rows, 1).

    Settings of a dial are evenly spaced. What is as good as 0 stands in a row of its own.
    Raises ValueError for unknown names, or where nothing is left to show.

    >>> report = moit.stability("power4", rays=2, progress=False)
    >>> moit.plot.stability(report).shape[1]
    3
    """
    from moit.numerics.charts import dial_chart
    from moit.numerics.columns import NUMBERS, PRECISIONS
    from moit.numerics.report import StabilityReport

    made = checked_style(style)
    if not isinstance(report, StabilityReport):
        raise TypeError(f"report: expected a StabilityReport, got {type(report).__name__}")
    if not isinstance(column, str) or column not in NUMBERS:
        raise ValueError(f"column: expected one of {', '.join(NUMBERS)}, got {column!r:.80}")
    if precision is not None and precision not in PRECISIONS:
        raise ValueError(f"precision: expected one of {PRECISIONS} or None, got {precision!r:.80}")
    names = technique_names(techniques, list(dict.fromkeys(r["technique"] for r in report.rows)))
    rows = [
        row
        for row in report.rows
        if row["technique"] in names
        and precision in (None, row["precision"])
        and row[column] is not None
    ]
    if not rows:
        raise ValueError(f"column: no row has {column}")
    families = list(dict.fromkeys(row["family"] for row in rows))
    colours = dict(zip(names, technique_colours(names), strict=True))
    lines = dict(zip(PRECISIONS, ("dotted", "solid", "dashed"), strict=True))
    width = 13.0 if made.width is None else made.width
    across = ACROSS if width > 4 else 1
    high = math.ceil(len(families) / across)
    panel = 3.2 if made.width is None else 1.9
    with settings(made):
        figure = new_figure((width, panel * high + 0.3), made, "constrained")
        axes = figure.subplots(high, across, squeeze=False)
        for ax in axes.flat[len(families) :]:
            ax.set_axis_off()
        for ax, family in zip(axes.flat, families, strict=False):
            settle(ax)
            own = [row for row in rows if row["family"] == family]
            draw(dial_chart(own, column, colours, dict.fromkeys(names, ""), lines), ax)
            ax.set_title(_lines(family, width / across), fontsize=9)
            ax.set_xlabel(_lines(ax.get_xlabel(), width / across))
        shown = {
            label: line
            for ax in axes.flat
            for line, label in zip(*ax.get_legend_handles_labels(), strict=True)
        }
        _legend(figure, shown)
        figure.suptitle(column if precision is None else f"{column}, {precision}", fontsize=10)
    return axes


def _lines(text: str, width: float) -> str:
    """A text below or above a panel of that width."""
    return "\n".join(broken(text, 0.75 * width, 9.0))


def _legend(figure: Figure, shown: dict[str, Any]) -> None:
    """Below all panels, in as many columns as have room; the figure grows by it."""
    size = 7.0
    width = figure.get_figwidth() - 0.2
    names = ["\n".join(broken(name, width / 2 - 0.5, size)) for name in shown]
    widest = max(text_width(line, size) for name in names for line in name.split("\n")) + 0.5
    columns = max(1, min(len(names), int(width / widest)))
    figure.legend(
        shown.values(), names, loc="outside lower center", ncols=columns, frameon=False,
        fontsize=size,
    )  # fmt: skip
    lines = max(name.count("\n") + 1 for name in names)
    figure.set_figheight(
        figure.get_figheight() + math.ceil(len(names) / columns) * lines * 1.35 * size / 72 + 0.1
    )
