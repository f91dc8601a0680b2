"""Columns of a stability report, and what is worst in each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from moit.comparing.rows import Row, exact
from moit.reports.columns import WORDS, heading, shown
from moit.reports.tables import Cell, Table

PRECISIONS = ("16 bit", "float32", "float64")
COLUMNS = (
    "family",
    "dial",
    "technique",
    "precision",
    "T_p99",
    "T_max",
    "own_p99",
    "own_max",
    "brightness",
    "nan",
    "jump",
    "pivot",
    "biased_pivot",
    "invalid",
    "bias",
    "bias_needed",
    "note",
)
NUMBERS = tuple(name for name in COLUMNS if name not in (*WORDS, "dial"))
# What is worst is the least of these, the sum of that, and the greatest of the others.
LEAST = ("pivot", "biased_pivot")


def table(
    rows: Sequence[Row],
    names: Sequence[str],
    palette: Mapping[str, str] | None = None,
    keys: Mapping[str, str] | None = None,
) -> Table:
    """Those columns of the rows; with a palette, for a page that sorts them and shows all digits,
    and with keys of techniques for its script."""

    def cell(row: Row, column: str) -> str | Cell:
        text = shown(column, row[column], 3)
        if palette is None:
            return text
        if column != "technique":
            return Cell(text, exact(row[column]))
        return Cell(text, exact(row[column]), palette[row[column]], row["note"])

    return Table(
        [heading(column) for column in names],
        [[cell(row, column) for column in names] for row in rows],
        [column in WORDS for column in names],
        keys=[] if keys is None else [keys[row["technique"]] for row in rows],
    )


def worst(rows: Sequence[Row]) -> list[Row]:
    """What `StabilityReport.worst` says."""
    groups: dict[tuple[str, str], list[Row]] = {}
    for row in rows:
        groups.setdefault((row["technique"], row["precision"]), []).append(row)
    return [_worst(group) for group in groups.values()]


def _worst(rows: list[Row]) -> Row:
    found = Row(rows[0])
    for column in NUMBERS:
        values = [row[column] for row in rows if row[column] is not None]
        if not values:
            found[column] = None
        elif column == "nan":
            found[column] = sum(values)
        else:
            found[column] = min(values) if column in LEAST else max(values)
    known = [row for row in rows if row["T_max"] is not None]
    if known:
        top = max(known, key=lambda row: float(row["T_max"]))
        found.update(family=top["family"], dial=top["dial"])
    found["note"] = next((row["note"] for row in rows if row["note"]), "")
    return found
