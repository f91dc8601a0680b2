"""Error over cost as SVG."""

from __future__ import annotations

import math
from collections.abc import Sequence
from html import escape

import numpy as np

from moit.reports.charts import ErrorChart, Point, axis_range, on_page, row_label, short
from moit.reports.label_places import DISTANCES, LEADER, MARKER, NEAR, place
from moit.reports.svg_parts import LETTER, Frame, element, log_grid, rule, text_at, under

Place = tuple[Point, float, float]  # and where it is drawn
HEIGHT = 11.0  # of a label
BOLD = 1.1  # how much wider strong letters are


def errors(chart: ErrorChart, size: tuple[int, int]) -> str:
    shown = chart.shown
    least = chart.least
    row = row_label([p.y for p in shown if p.y < least])
    names = [len(p.name) for p in shown if p.on_front]
    room = min(max([*names, 0]) * LETTER * BOLD + 16, 0.25 * size[0])
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
    parts = [log_grid(frame, chart.x_title, chart.y_title, row)]
    if has_zero:
        parts += [rule(frame, x=zero), under(frame, zero, "0", 20 if row else 0)]
    parts += _fronts(placed)
    placed.sort(key=lambda one: not one[0].on_front)  # these choose their places first
    corners = _corners(placed, size, frame)
    marks = [_point(one, corner, chart) for one, corner in zip(placed, corners, strict=True)]
    parts += reversed(marks)  # and are above all others
    return element(size, parts, f"{chart.y_title} over {chart.x_title}")


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


def _corners(
    placed: Sequence[Place], size: tuple[int, int], frame: Frame
) -> list[tuple[float, float] | None]:
    """The lower left corner of each name; None where there is no room near its marker."""
    if not placed:
        return []
    corners = place(
        np.array([(x, -y) for _, x, y in placed]),  # heights grow upward there
        np.array([(_width(p), HEIGHT) for p, _, _ in placed]),
        np.array([frame.left - frame.before, -frame.row - 8, size[0] - 2.0, 0.0]),
        np.array([max(DISTANCES) if p.on_front else NEAR for p, _, _ in placed]),
    )
    return [None if corner is None else (corner[0], -corner[1]) for corner in corners]


def _width(p: Point) -> float:
    return len(p.name) * LETTER * (BOLD if p.on_front else 1.0)


def _point(one: Place, corner: tuple[float, float] | None, chart: ErrorChart) -> str:
    """A marker and its name. Where there is no room for it, pointing tells it."""
    p, x, y = one
    detail = escape(f"{p.name}: {chart.x_title} {short(p.x)}, {chart.y_title} {short(p.y)}")
    colour = on_page(p.colour)
    mark = f'stroke="{colour}" stroke-width="1.5" fill="{colour}"'
    hollow = "" if p.on_front else ' fill-opacity=".25"'
    label = ""
    if corner is not None:
        left, bottom = corner
        end_x = min(max(x, left), left + _width(p))
        end_y = min(max(y, bottom - HEIGHT), bottom)
        if math.hypot(end_x - x, end_y - y) > MARKER + LEADER:
            label = (
                f'<path d="M{x:.1f} {y:.1f}L{end_x:.1f} {end_y:.1f}" '
                'stroke="currentColor" stroke-opacity=".4" fill="none"/>'
            )
        weight = ' font-weight="600"' if p.on_front else ""
        label += text_at(left, bottom - 2, p.name, weight)
    return (
        f'<g class="point" data-key="{escape(p.key)}"><title>{detail}</title>'
        f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4" {mark}{hollow}/>{label}</g>'
    )
