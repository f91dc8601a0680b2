"""Pieces of charts as SVG: the frame, rules, texts beside axes, the element."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

from moit.reports.charts import log_ticks, nice_ticks, short

LETTER = 6.0  # about a letter's width at 10 px


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


def element(size: tuple[int, int], parts: list[str], label: str) -> str:
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {size[0]} {size[1]}" '
        f'width="{size[0]}" height="{size[1]}" role="img" aria-label="{escape(label)}" '
        'font-family="system-ui,sans-serif" font-size="10">' + "".join(parts) + "</svg>"
    )


def text_at(x: float, y: float, text: str, more: str = "") -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" fill="currentColor"{more}>{escape(text)}</text>'


def grid(frame: Frame, xs: Sequence[float], ys: Sequence[float], x_title: str, y_title: str) -> str:
    parts = []
    for x in xs:
        parts += [rule(frame, x=frame.across(x)), under(frame, frame.across(x), short(x))]
    for y in ys:
        parts += [rule(frame, y=frame.down(y)), beside(frame, frame.down(y), short(y))]
    return "".join(parts) + titles(frame, x_title, y_title, 0)


def log_grid(frame: Frame, x_title: str, y_title: str, row: str) -> str:
    parts = [value_grid(frame, row)]
    for value in log_ticks(frame.x):
        x = frame.across(math.log10(value))
        parts += [rule(frame, x=x), under(frame, x, short(value), 20 if row else 0)]
    return "".join(parts) + titles(frame, x_title, y_title, 20 if row else 0)


def value_grid(frame: Frame, row: str) -> str:
    """Lines of a y axis, and of the row below it."""
    parts = []
    for value in nice_ticks(*frame.y, 5) if frame.linear else log_ticks(frame.y):
        y = frame.place(value)
        parts += [rule(frame, y=y), beside(frame, y, short(value))]
    if row:
        parts += [rule(frame, y=frame.row), beside(frame, frame.row, row)]
    return "".join(parts)


def rule(frame: Frame, x: float | None = None, y: float | None = None) -> str:
    if x is not None:
        path = f"M{x:.1f} {frame.top:.1f}v{frame.height:.1f}"
    else:
        path = f"M{frame.left - frame.before:.1f} {y:.1f}h{frame.width + frame.before:.1f}"
    return f'<path d="{path}" stroke="currentColor" stroke-opacity=".15"/>'


def under(frame: Frame, x: float, text: str, further: float = 0) -> str:
    return text_at(x, frame.row + further, text, ' text-anchor="middle" opacity=".8"')


def beside(frame: Frame, y: float, text: str) -> str:
    return text_at(frame.left - frame.before - 5, y + 3.5, text, ' text-anchor="end" opacity=".8"')


def titles(frame: Frame, x_title: str, y_title: str, further: float) -> str:
    middle = frame.top + frame.height / 2
    turned = f' text-anchor="middle" transform="rotate(-90 11 {middle:.1f})"'
    return text_at(
        frame.left + frame.width / 2,
        frame.top + frame.height + 30 + further,
        x_title,
        ' text-anchor="middle"',
    ) + text_at(11, middle, y_title, turned)
