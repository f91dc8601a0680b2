"""Charts as SVG text, for pages and for machines without matplotlib.

A chart takes its colours from the page it stands in: text and axes are `currentColor`, each
series has a colour that is legible on light and on dark. `standalone` makes a file of one.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from html import escape

import numpy as np

from moit.reports.charts import (
    Chart,
    CurveChart,
    DialChart,
    Series,
    axis_range,
    nice_ticks,
    on_page,
    row_label,
    short,
)
from moit.reports.pictures import Array
from moit.reports.svg_errors import errors
from moit.reports.svg_parts import (
    Frame,
    element,
    grid,
    rule,
    text_at,
    titles,
    under,
    value_grid,
)

LINE = 12.0  # between two labels
SWATCH = 22  # so long that a line's dashes are seen
INK = "#000000"  # of what is exact; see `on_page`


def svg(chart: Chart, size: tuple[int, int], legend: bool = False, most: int | None = None) -> str:
    """A chart's element. legend : names at the right, for a chart that stands alone. most : so
    many curves are seen; a page shows the others where they are chosen."""
    if isinstance(chart, CurveChart):
        return _curves(chart, size, legend, most)
    if isinstance(chart, DialChart):
        return _dial(chart, size, legend)
    return errors(chart, size)


def _curves(chart: CurveChart, size: tuple[int, int], legend: bool, most: int | None) -> str:
    depth = chart.depth
    low, high = float(depth[0]), float(depth[-1])
    beyond = _beyond(chart.series, legend, 10)
    if legend:
        size = _with_legend(size, 44 + beyond, len(chart.series) + (chart.exact is not None))
    width = size[0] - 44 - beyond
    frame = Frame(44, 10, width, size[1] - 46, (low, max(high, low + 1e-9)), (0.0, 1.0))
    parts = [grid(frame, nice_ticks(low, high), nice_ticks(0, 1, 5), "depth", "transmittance")]
    for i, one in enumerate(chart.series):
        kind = "series" if most is None or i < most else "series more"
        path = _path(frame, depth, np.clip(one.y, -0.02, 1.02))
        parts.append(_line(one, path, 1.6, kind=kind))
    if chart.exact is not None:
        parts.append(
            f'<path class="exact" d="{_path(frame, depth, chart.exact)}" fill="none" '
            'stroke="currentColor" stroke-width="2"><title>exact</title></path>'
        )
    if legend:
        exact = [Series("exact", depth, INK, "")] if chart.exact is not None else []
        parts.append(_legend(frame, [*exact, *chart.series]))
    return element(size, parts, "Transmittance over depth")


def _beyond(series: Sequence[Series], legend: bool, without: int) -> float:
    """Room right of the frame."""
    if not legend:
        return without
    return SWATCH + 20 + max(map(_text_width, ["exact", *(one.name for one in series)]))


def _with_legend(size: tuple[int, int], without: float, names: int) -> tuple[int, int]:
    """A size in which a legend is whole, and its frame at least half as wide as was asked for."""
    width, height = size
    return max(width, math.ceil(without + width / 2)), max(height, math.ceil(14 + names * LINE))


def _text_width(text: str) -> float:
    """Pixels of a text of 10 px in DejaVu Sans, which is wider than others that pages have."""
    narrow = sum(text.count(one) for one in "ijlft.,:;|!'()-_ ")
    wide = sum(text.count(one) for one in "mwMW")
    return 6.3 * (len(text) - narrow - wide) + 4.2 * narrow + 9.8 * wide


DASHES = {
    "solid": "",
    "dashed": ' stroke-dasharray="6 3"',
    "dotted": ' stroke-dasharray="1.5 2.5"',
    "dashdot": ' stroke-dasharray="7 2.5 1.5 2.5"',
}


def _line(one: Series, path: str, width: float, more: str = "", kind: str = "series") -> str:
    return (
        f'<path class="{kind}" data-key="{escape(one.key)}" d="{path}" fill="none" '
        f'stroke="{on_page(one.colour)}" stroke-width="{width}"{DASHES[one.line]}{more}>'
        f"<title>{escape(one.name)}</title></path>"
    )


def _legend(frame: Frame, series: Sequence[Series]) -> str:
    """Names and their lines, right of the frame."""
    parts = []
    for i, one in enumerate(series):
        x, y = frame.left + frame.width + 8, frame.top + 8 + i * LINE
        parts.append(
            f'<path d="M{x:.1f} {y - 3.5:.1f}h{SWATCH}" stroke="{on_page(one.colour)}" '
            f'stroke-width="2"{DASHES[one.line]}/>' + text_at(x + SWATCH + 4, y, one.name)
        )
    return "".join(parts)


def _dial(chart: DialChart, size: tuple[int, int], legend: bool) -> str:
    dial, least = chart.dial, chart.least
    beyond = _beyond(chart.series, legend, 14)
    if legend:
        size = _with_legend(size, 52 + beyond, len(chart.series))
    given = [float(y) for one in chart.series for y in one.y]
    known = [y for y in (given if chart.scale is None else chart.scale) if math.isfinite(y)]
    if chart.linear:
        least = -math.inf
    row = row_label([y for y in known if y < least])
    frame = Frame(
        52,
        10,
        size[0] - 52 - beyond,
        size[1] - 10 - (62 if row else 44),
        (0.0, float(max(len(dial) - 1, 1))),
        axis_range([y for y in known if y >= least], chart.linear),
        linear=chart.linear,
    )
    parts = [value_grid(frame, row)]
    every = max(1, math.ceil(len(dial) * 34 / frame.width))
    for i, value in enumerate(dial):
        x = frame.across(i)
        parts.append(rule(frame, x=x))
        if (len(dial) - 1 - i) % every == 0:
            parts.append(under(frame, x, short(value), 18 if row else 0))
    for one in chart.series:
        path = _dial_path(frame, one.y, least)
        if path:
            parts.append(_line(one, path, 1.6, ' stroke-linecap="round" stroke-linejoin="round"'))
    parts.append(titles(frame, chart.x_title, "", 16 if row else 0))
    if legend:
        parts.append(_legend(frame, chart.series))
    return element(size, parts, f"over {chart.x_title}")


def _dial_path(frame: Frame, ys: Array, least: float) -> str:
    path, gap = "", True
    for i, y in enumerate(map(float, ys)):
        if math.isnan(y):
            gap = True
            continue
        down = frame.row
        if y >= least:
            down = frame.place(y)
        path += f"{'M' if gap else 'L'}{frame.across(i):.1f} {down:.1f}"
        path += "h0" if gap else ""  # one setting alone is a dot
        gap = False
    return path


def _path(frame: Frame, x: Array, y: Array) -> str:
    """Through the points; those that lie on a level line between their neighbours are left out."""
    points = [
        (f"{frame.across(float(a)):.1f}", f"{frame.down(float(b)):.1f}")
        for a, b in zip(x, y, strict=True)
        if math.isfinite(b)
    ]
    points = list(dict.fromkeys(points))
    kept = [
        point
        for i, point in enumerate(points)
        if i in (0, len(points) - 1) or {points[i - 1][1], points[i + 1][1]} != {point[1]}
    ]
    return "M" + "L".join(map(" ".join, kept)) if kept else "M0 0"


def standalone(svg: str) -> str:
    """A chart as a file: on white, or on near black where the reader's system is dark."""
    style = (
        "<style>svg{color:#222;background:#fff}"
        "@media(prefers-color-scheme:dark){svg{color:#ddd;background:#16181c}}</style>"
    )
    start = svg.index(">") + 1
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{svg[:start]}{style}{svg[start:]}\n'
