"""Charts as SVG text, for pages and for machines without matplotlib.

A chart takes its colours from the page it stands in: text and axes are `currentColor`, each
series has a colour that is legible on light and on dark. `standalone` makes a file of one.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

import numpy as np

from moit.reports.charts import (
    Chart,
    CurveChart,
    DialChart,
    ErrorChart,
    Point,
    Series,
    axis_range,
    log_ticks,
    nice_ticks,
    on_page,
    row_label,
    short,
)
from moit.reports.pictures import Array

LETTER = 5.6  # about a letter's width at 10 px
LINE = 12.0  # between two labels
SWATCH = 22  # so long that a line's dashes are seen
INK = "#000000"  # of what is exact; see `on_page`


@dataclass(frozen=True)
class Frame:
    """Where the data go: a box in pixels and the ranges it shows."""

    left: float
    top: float
    width: float
    height: float
    x: tuple[float, float]
    y: tuple[float, float]
    before: float = 0.0  # pixels left of the box that are the data's too
    linear: bool = False  # y shows numbers, not their logarithms

    def across(self, x: float) -> float:
        return self.left + self.width * (x - self.x[0]) / (self.x[1] - self.x[0])

    @property
    def row(self) -> float:
        """Where what is too small for the axis stands."""
        return self.top + self.height + 14

    def down(self, y: float) -> float:
        return self.top + self.height * (self.y[1] - y) / (self.y[1] - self.y[0])

    def place(self, y: float) -> float:
        """Where a number of the y axis stands; infinite ones are at the top."""
        if not math.isfinite(y):
            return self.top
        return self.down(y if self.linear else math.log10(y))


def svg(chart: Chart, size: tuple[int, int], legend: bool = False, most: int | None = None) -> str:
    """A chart's element. legend : names at the right, for a chart that stands alone. most : so
    many curves are seen; a page shows the others where they are chosen."""
    if isinstance(chart, CurveChart):
        return _curves(chart, size, legend, most)
    if isinstance(chart, DialChart):
        return _dial(chart, size, legend)
    return _errors(chart, size)


def _curves(chart: CurveChart, size: tuple[int, int], legend: bool, most: int | None) -> str:
    depth = chart.depth
    low, high = float(depth[0]), float(depth[-1])
    beyond = _beyond(chart.series, legend, 10)
    if legend:
        size = _with_legend(size, 44 + beyond, len(chart.series) + (chart.exact is not None))
    width = size[0] - 44 - beyond
    frame = Frame(44, 10, width, size[1] - 46, (low, max(high, low + 1e-9)), (0.0, 1.0))
    parts = [_grid(frame, nice_ticks(low, high), nice_ticks(0, 1, 5), "depth", "transmittance")]
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
    return _svg(size, parts, "Transmittance over depth")


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
            f'stroke-width="2"{DASHES[one.line]}/>' + _text(x + SWATCH + 4, y, one.name)
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
    parts = [_value_grid(frame, row)]
    every = max(1, math.ceil(len(dial) * 34 / frame.width))
    for i, value in enumerate(dial):
        x = frame.across(i)
        parts.append(_rule(frame, x=x))
        if (len(dial) - 1 - i) % every == 0:
            parts.append(_under(frame, x, short(value), 18 if row else 0))
    for one in chart.series:
        path = _dial_path(frame, one.y, least)
        if path:
            parts.append(_line(one, path, 1.6, ' stroke-linecap="round" stroke-linejoin="round"'))
    parts.append(_titles(frame, chart.x_title, "", 16 if row else 0))
    if legend:
        parts.append(_legend(frame, chart.series))
    return _svg(size, parts, f"over {chart.x_title}")


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


Place = tuple[Point, float, float]  # and where it is drawn


def _errors(chart: ErrorChart, size: tuple[int, int]) -> str:
    shown = chart.shown
    least = chart.least
    row = row_label([p.y for p in shown if p.y < least])
    room = min(max([len(p.name) for p in shown] + [0]) * LETTER + 16, 0.3 * size[0])
    has_zero = any(p.x == 0 for p in shown)
    zero, left = 68.0, 96.0 if has_zero else 56.0
    frame = Frame(
        left,
        10,
        size[0] - left - room,
        size[1] - 10 - (66 if row else 46),
        axis_range([p.x for p in shown if p.x > 0]),
        axis_range([p.y for p in shown if p.y >= least], chart.linear),
        left - 56.0,
        chart.linear,
    )
    placed = [
        (
            p,
            frame.across(math.log10(p.x)) if p.x > 0 else zero,
            frame.place(p.y) if p.y >= least else frame.row,
        )
        for p in shown
    ]
    parts = [_log_grid(frame, chart.x_title, chart.y_title, row)]
    if has_zero:
        parts += [_rule(frame, x=zero), _under(frame, zero, "0", 20 if row else 0)]
    parts += _fronts(placed)
    labels = _spread([(y, x) for _, x, y in placed], frame.top + frame.height + 18, room + 8)
    for place, label_y in zip(placed, labels, strict=True):
        parts.append(_point(place, label_y, chart))
    return _svg(size, parts, f"{chart.y_title} over {chart.x_title}")


def _fronts(placed: Sequence[Place]) -> list[str]:
    """A stepped line through the points of each front."""
    parts = []
    for group in dict.fromkeys(p.front for p, _, _ in placed):
        line = sorted(
            ((x, y) for p, x, y in placed if p.on_front and p.front == group),
            key=lambda at: at[0],
        )
        if len(line) > 1:
            path = f"M{line[0][0]:.1f} {line[0][1]:.1f}" + "".join(
                f"H{x:.1f}V{y:.1f}" for x, y in line[1:]
            )
            parts.append(
                f'<path d="{path}" fill="none" stroke="currentColor" stroke-opacity=".45" '
                'stroke-dasharray="4 3"><title>Pareto front</title></path>'
            )
    return parts


def _point(place: Place, label_y: float, chart: ErrorChart) -> str:
    """A marker and its name. Where more stand at one place than there is room for, some are told
    by pointing only."""
    p, x, y = place
    detail = escape(f"{p.name}: {chart.x_title} {short(p.x)}, {chart.y_title} {short(p.y)}")
    colour = on_page(p.colour)
    mark = f'stroke="{colour}" stroke-width="1.5" fill="{colour}"'
    hollow = "" if p.on_front else ' fill-opacity=".25"'
    leader = ""
    if abs(label_y - y) > 3 and label_y >= 0:
        leader = (
            f'<path d="M{x:.1f} {y:.1f}L{x + 9:.1f} {label_y:.1f}" '
            'stroke="currentColor" stroke-opacity=".3" fill="none"/>'
        )
    weight = ' font-weight="600"' if p.on_front else ""
    label = _text(x + 11, label_y + 3.5, p.name, weight) if label_y >= 0 else ""
    return (
        f'<g class="point" data-key="{escape(p.key)}"><title>{detail}</title>{leader}'
        f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4" {mark}{hollow}/>{label}</g>'
    )


def standalone(svg: str) -> str:
    """A chart as a file: on white, or on near black where the reader's system is dark."""
    style = (
        "<style>svg{color:#222;background:#fff}"
        "@media(prefers-color-scheme:dark){svg{color:#ddd;background:#16181c}}</style>"
    )
    start = svg.index(">") + 1
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{svg[:start]}{style}{svg[start:]}\n'


def _svg(size: tuple[int, int], parts: list[str], label: str) -> str:
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {size[0]} {size[1]}" '
        f'width="{size[0]}" height="{size[1]}" role="img" aria-label="{escape(label)}" '
        'font-family="system-ui,sans-serif" font-size="10">' + "".join(parts) + "</svg>"
    )


def _text(x: float, y: float, text: str, more: str = "") -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" fill="currentColor"{more}>{escape(text)}</text>'


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


def _grid(
    frame: Frame, xs: Sequence[float], ys: Sequence[float], x_title: str, y_title: str
) -> str:
    parts = []
    for x in xs:
        parts += [_rule(frame, x=frame.across(x)), _under(frame, frame.across(x), short(x))]
    for y in ys:
        parts += [_rule(frame, y=frame.down(y)), _beside(frame, frame.down(y), short(y))]
    return "".join(parts) + _titles(frame, x_title, y_title, 0)


def _log_grid(frame: Frame, x_title: str, y_title: str, row: str) -> str:
    parts = [_value_grid(frame, row)]
    for value in log_ticks(frame.x):
        x = frame.across(math.log10(value))
        parts += [_rule(frame, x=x), _under(frame, x, short(value), 20 if row else 0)]
    return "".join(parts) + _titles(frame, x_title, y_title, 20 if row else 0)


def _value_grid(frame: Frame, row: str) -> str:
    """Lines of a y axis, and of the row below it."""
    parts = []
    for value in nice_ticks(*frame.y, 5) if frame.linear else log_ticks(frame.y):
        y = frame.place(value)
        parts += [_rule(frame, y=y), _beside(frame, y, short(value))]
    if row:
        parts += [_rule(frame, y=frame.row), _beside(frame, frame.row, row)]
    return "".join(parts)


def _rule(frame: Frame, x: float | None = None, y: float | None = None) -> str:
    if x is not None:
        path = f"M{x:.1f} {frame.top:.1f}v{frame.height:.1f}"
    else:
        path = f"M{frame.left - frame.before:.1f} {y:.1f}h{frame.width + frame.before:.1f}"
    return f'<path d="{path}" stroke="currentColor" stroke-opacity=".15"/>'


def _under(frame: Frame, x: float, text: str, further: float = 0) -> str:
    return _text(x, frame.row + further, text, ' text-anchor="middle" opacity=".8"')


def _beside(frame: Frame, y: float, text: str) -> str:
    return _text(frame.left - frame.before - 5, y + 3.5, text, ' text-anchor="end" opacity=".8"')


def _titles(frame: Frame, x_title: str, y_title: str, further: float) -> str:
    middle = frame.top + frame.height / 2
    turned = f' text-anchor="middle" transform="rotate(-90 11 {middle:.1f})"'
    return _text(
        frame.left + frame.width / 2,
        frame.top + frame.height + 30 + further,
        x_title,
        ' text-anchor="middle"',
    ) + _text(11, middle, y_title, turned)


def _spread(places: Sequence[tuple[float, float]], bottom: float, width: float) -> list[float]:
    """Heights for labels of that width at (y, x), moved apart where they would overlap."""
    order = sorted(range(len(places)), key=lambda i: places[i])
    heights = [y for y, _ in places]

    def near(i: int, j: int) -> bool:
        return abs(places[i][1] - places[j][1]) < width

    for k, i in enumerate(order):
        for j in order[:k]:
            if near(i, j) and heights[i] < heights[j] + LINE:
                heights[i] = heights[j] + LINE
    # What was pushed out at the bottom pushes the others back up.
    limit: dict[int, float] = {}
    for k in range(len(order) - 1, -1, -1):
        i = order[k]
        limit[i] = min([bottom] + [heights[j] - LINE for j in order[k + 1 :] if near(i, j)])
        heights[i] = min(heights[i], limit[i])
    return heights
