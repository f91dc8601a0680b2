"""A report's rows as a table: aligned text, and a small HTML table for notebooks."""

from __future__ import annotations

import math
from collections.abc import Sequence
from html import escape
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from moit.comparing.report import Report, Row

# A terminal is narrower than a file: these stay in CSV, JSON and the page.
NOT_IN_TEXT = frozenset({"seconds_iqr", "mse", "mae"})

# column: heading, factor, unit in words
UNITS = {
    "bits_per_pixel": ("bits", 1.0, "bits per pixel beyond a colour target"),
    "seconds": ("ms", 1e3, "milliseconds for one composite, median"),
    "seconds_iqr": ("± ms", 1e3, "interquartile range of the milliseconds"),
    "fragments_per_second": ("Mfrag/s", 1e-6, "million fragments per second"),
}


def heading(column: str) -> str:
    """The short name of a column."""
    return UNITS[column][0] if column in UNITS else column


def shown(column: str, value: object) -> str:
    """A field with four digits, in its column's unit; "-" for None."""
    if value is None:
        return "-"
    if not isinstance(value, (int, float)):
        return str(value)
    if column == "bits_per_pixel":
        return f"{value:g}"
    return number(value * UNITS[column][1] if column in UNITS else float(value))


def number(value: float) -> str:
    """Four significant digits; short exponents."""
    if not math.isfinite(value):
        return str(value)
    if value == 0:
        return "0"
    value = float(f"{value:.3e}")
    if 1e-3 <= abs(value) < 1e5:
        digits = max(0, 3 - math.floor(math.log10(abs(value))))
        return f"{value:.{digits}f}"
    mantissa, exponent = f"{value:.2e}".split("e")
    return f"{mantissa}e{int(exponent)}"


def columns_shown(report: Report) -> list[str]:
    """Columns of the short tables: without those that are the same or empty everywhere."""
    devices = {row["device"] for row in report.rows}
    return [
        column
        for column in report.columns
        if column not in NOT_IN_TEXT
        and not (column == "device" and devices <= {"cpu"})
        and not (column == "note" and not any(row["note"] for row in report.rows))
    ]


def _cells(report: Report, columns: list[str]) -> list[list[str]]:
    return [[shown(column, row.get(column)) for column in columns] for row in report.rows]


def _is_text(column: str) -> bool:
    return column in ("scene", "device", "technique", "note")


def text_table(report: Report) -> str:
    """Aligned lines, a blank one between scenes."""
    columns = columns_shown(report)
    cells = _cells(report, columns)
    words = [_is_text(column) for column in columns]
    groups = [row["scene"] for row in report.rows]
    return aligned([heading(column) for column in columns], cells, words, groups)


def aligned(
    heads: list[str], cells: list[list[str]], words: list[bool], groups: Sequence[object]
) -> str:
    """Lines of columns: `words` to the left, numbers to the right, a blank line between groups."""
    widths = [max(len(line[i]) for line in [heads, *cells]) for i in range(len(heads))]

    def line(texts: list[str]) -> str:
        padded = (
            f"{text:<{width}}" if is_text else f"{text:>{width}}"
            for is_text, text, width in zip(words, texts, widths, strict=True)
        )
        return "  ".join(padded).rstrip()

    lines = [line(heads), line(["-" * width for width in widths])]
    for i, texts in enumerate(cells):
        if i and groups[i] != groups[i - 1]:
            lines.append("")
        lines.append(line(texts))
    return "\n".join(lines)


def html_table(report: Report) -> str:
    """One <table>, everything escaped."""
    columns = columns_shown(report)

    def cell(tag: str, column: str, text: str) -> str:
        side = "left" if _is_text(column) else "right"
        return f'<{tag} style="text-align:{side}">{escape(text)}</{tag}>'

    head = "".join(cell("th", column, heading(column)) for column in columns)
    body = "".join(
        "<tr>" + "".join(cell("td", c, t) for c, t in zip(columns, texts, strict=True)) + "</tr>"
        for texts in _cells(report, columns)
    )
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def best_rows(rows: list[Row], column: str, reference: str) -> set[int]:
    """Indices of the rows that are best in a column; in errors the reference does not count."""
    from moit.comparing.report import as_error

    found = {
        i: as_error(column, row[column])
        for i, row in enumerate(rows)
        if isinstance(row.get(column), (int, float))
        and not math.isnan(row[column])
        and (column == "seconds" or row["technique"] != reference)
    }
    return {i for i, error in found.items() if error == min(found.values())}
