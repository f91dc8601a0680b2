"""What charts show, whatever draws them: moit.reports.svg or moit.reports.figures."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from moit.reports.pictures import Array


@dataclass(frozen=True)
class Series:
    """A named curve. `key` marks it for the page's script. line : "solid", "dashed",
    "dotted" or "dashdot"."""

    name: str
    y: Array
    colour: str
    key: str
    line: str = "solid"


@dataclass(frozen=True)
class Point:
    """A named point; y may be 0, which a logarithmic axis shows in a row of its own.

    front : of which front it is part, such as a device's.
    technique : whose it is, where the name says more than that.
    """

    name: str
    x: float
    y: float
    colour: str
    key: str
    on_front: bool
    front: str = ""
    technique: str = ""


@dataclass(frozen=True)
class CurveChart:
    """Transmittance in [0, 1] over depth: each series, and the exact curve above them.

    depth : (K,) increasing.
    """

    depth: Array
    series: Sequence[Series]
    exact: Array | None = None


@dataclass(frozen=True)
class DialChart:
    """Numbers over the settings of a dial, which are evenly spaced; logarithmic.

    series : each with a number per setting, NaN where there is none; infinite ones are at the top.
    scale : numbers that set the scale; None: those of the series.
    least : numbers below it, such as 0, stand in a row of their own below the axis.
    linear : y as it is, without such a row.
    """

    dial: Sequence[float]
    series: Sequence[Series]
    x_title: str
    scale: Sequence[float] | None = None
    least: float = 1e-17
    linear: bool = False


@dataclass(frozen=True)
class ErrorChart:
    """Error over cost, both logarithmic; those that nothing beats are joined by a line.

    A y far below the others, such as 0, stands in a row of its own below the axis. A cost of
    0 has a column of its own. Infinite numbers are not shown.

    x_unit : "s" (times are written with their units), "bits" (powers of two) or "".
    linear : y as it is, without such a row.
    groups : the fronts that there may be, so that each has its marker in every chart of a figure;
        (): those of the points.
    """

    points: Sequence[Point]
    x_title: str
    y_title: str
    x_unit: str = ""
    linear: bool = False
    groups: Sequence[str] = ()

    @property
    def shown(self) -> list[Point]:
        return [p for p in self.points if p.x >= 0 and math.isfinite(p.x) and math.isfinite(p.y)]

    @property
    def least(self) -> float:
        """Numbers below it stand in the row below the axis."""
        return -math.inf if self.linear else _floor_of([p.y for p in self.shown])


Chart = CurveChart | DialChart | ErrorChart


def on_page(colour: str) -> str:
    """The same in CSS, but black: that is the ink of a page, which is light where it is dark."""
    return "currentColor" if colour == "#000000" else colour


def nice_ticks(low: float, high: float, most: int = 6) -> list[float]:
    """Round numbers (1, 2, 5 times a power of ten) within [low, high]."""
    if not high > low:
        return [low]
    rough = (high - low) / most
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(k * power for k in (1, 2, 5, 10) if k * power >= rough * 0.999)
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return [k * step for k in range(first, last + 1)]


def axis_range(values: Sequence[float], linear: bool = False) -> tuple[float, float]:
    """Exponents, or numbers, that hold all values with some room; half a decade at least."""
    if not values:
        return (0.0, 1.0) if linear else (-1.0, 0.0)
    low, high = min(values), max(values)
    if linear:
        spare = 0.05 * (high - low) or max(0.05 * abs(high), 0.05)
        return (low - spare, high + spare)
    low, high = math.log10(low), math.log10(high)
    spare = max(0.05 * (high - low), (0.5 - (high - low)) / 2, 0.03)
    return (low - spare, high + spare)


def log_ticks(exponents: tuple[float, float]) -> list[float]:
    """Powers of ten, with 2 and 5 times them where these are few; else any round numbers."""
    low, high = exponents
    if high - low < 0.9:
        return nice_ticks(10**low, 10**high, 5)
    factors: tuple[float, ...] = (1,) if high - low > 2.5 else (1, 2, 5)
    every = max(1, round((high - low) / 8))
    powers = range(math.floor(low) - 1, math.ceil(high) + 1)
    ticks = [k * 10.0**p for p in powers if p % every == 0 for k in factors]
    return [tick for tick in ticks if low <= math.log10(tick) <= high]


def short(value: float) -> str:
    """A tick's label."""
    text = f"{value:.4g}"
    if "e" in text:
        mantissa, exponent = text.split("e")
        text = f"{mantissa}e{int(exponent)}"
    return text


def _floor_of(errors: Sequence[float]) -> float:
    """The power of ten below which an error is as good as none beside the greatest."""
    greatest = max(errors, default=0.0)
    return 10.0 ** (math.floor(math.log10(greatest)) - 3) if greatest > 0 else 1.0


def row_label(low: Sequence[float]) -> str:
    """What the row below the axis is called, where these lie in it; "" for none."""
    greatest = max(low, default=-math.inf)
    if greatest > 0:
        return f"<{short(10.0 ** (math.floor(math.log10(greatest)) + 1))}"
    return "0" if low else ""
