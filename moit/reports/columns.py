"""Columns of reports, in one place: what they are called, their units, and how many digits."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Column:
    """heading : what stands above it. factor : from the field to what is shown.
    unit : in words, where the heading is one."""

    heading: str
    factor: float = 1
    unit: str = ""


COLUMNS = {
    "bits_per_pixel": Column("bits", unit="bits per pixel beyond a colour target"),
    "bits_per_texel": Column("bits"),
    "seconds": Column("ms", 1e3, "milliseconds for one composite, median"),
    "seconds_iqr": Column("± ms", 1e3, "interquartile range of the milliseconds"),
    "fragments_per_second": Column("Mfrag/s", 1e-6, "million fragments per second"),
    "gpu_ms": Column("gpu ms", unit="milliseconds of a frame on a GPU, predicted by a model"),
    "T_mae": Column("T mae"),
    "T_p99": Column("T 99 %"),
    "T_max": Column("T max"),
    "T_rmse": Column("T rmse"),
    "own_p99": Column("own 99 %"),
    "own_max": Column("own max"),
    "curve_mean": Column("curve, mean"),
    "curve_max": Column("curve, max"),
    "light": Column("signed"),
    "first_ms": Column("pass 1 ms"),
    "second_ms": Column("pass 2 ms"),
    "diff_ms": Column("diff ms"),
    "nan": Column("NaN"),
    "biased_pivot": Column("biased"),
    "bias_needed": Column("needed"),
}
WORDS = frozenset(
    "scene device technique family precision note claim where verdict numbers".split()
)
ALL_DIGITS = frozenset(("bits_per_pixel", "bits_per_texel", "bytes", "dial", "setting"))


def heading(column: str, as_field: bool = False) -> str:
    """The short name of a column; `as_field`: its own, by which a row is asked for it, but for
    those that have a unit."""
    found = COLUMNS.get(column)
    return column if found is None or (as_field and not found.unit) else found.heading


def shown(column: str, value: object, digits: int = 4) -> str:
    """A field in its column's unit; "-" for None."""
    if value is None:
        return "-"
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return str(value)
    if column in COLUMNS:
        value = value * COLUMNS[column].factor
    if column.removeprefix("paper_") in ALL_DIGITS:
        return f"{value:g}"
    return str(value) if isinstance(value, int) else number(value, digits)


def plain_number(value: float, digits: int = 3) -> str:
    """That many significant digits, with zeros at their end and without exponent; of what is
    below a ten-thousandth only that."""
    if not math.isfinite(value) or value == 0:
        return "0" if value == 0 else str(value)
    rounded = float(f"{value:.{digits - 1}e}")
    if abs(rounded) < 1e-4:
        return "<0.0001" if value > 0 else ">-0.0001"
    return f"{rounded:.{max(0, digits - 1 - math.floor(math.log10(abs(rounded))))}f}"


def number(value: float, digits: int = 4) -> str:
    """That many significant digits (of three, zeros at the end are left out); short exponents."""
    if not math.isfinite(value):
        return str(value)
    if value == 0:
        return "0"
    if digits < 4 and abs(value) >= 1e-3:
        return f"{value:.{digits}g}"
    rounded = float(f"{value:.{digits - 1}e}")
    if 1e-3 <= abs(rounded) < 1e5:
        return f"{rounded:.{max(0, 3 - math.floor(math.log10(abs(rounded))))}f}"
    mantissa, exponent = f"{value:.2e}".split("e")
    return f"{mantissa}e{int(exponent)}"
