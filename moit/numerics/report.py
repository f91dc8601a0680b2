"""What `stability` found: rows of numbers, and their tables."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from moit.comparing.report import Row, plain, write_rows
from moit.reports.tables import aligned, number
from moit.system.files import write_text

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
    "nan",
    "jump",
    "pivot",
    "biased_pivot",
    "invalid",
    "bias",
    "bias_needed",
    "note",
)
WORDS = ("family", "technique", "precision", "note")
NUMBERS = tuple(name for name in COLUMNS if name not in (*WORDS, "dial"))
# What is worst is the least of these, the sum of that, and the greatest of the others.
LEAST = ("pivot", "biased_pivot")
HEADINGS = {
    "dial": "dial",
    "T_p99": "T 99 %",
    "T_max": "T worst",
    "own_p99": "own 99 %",
    "own_max": "own worst",
    "nan": "NaN",
    "jump": "jump",
    "pivot": "pivot",
    "biased_pivot": "biased",
    "invalid": "invalid",
    "bias": "bias",
    "bias_needed": "needed",
}


@dataclass(frozen=True)
class StabilityReport:
    """The rows of `moit.stability`; printed, the worst of each technique over all families.

    rows : one Row per family, technique, precision and setting of the family's dial, in that order,
        with the fields
        `family`, `dial`, `technique`, `precision`;
        `T_p99`, `T_max` : error of the transmittance in front of each fragment against the exact
            one: 99 % and the worst. Of fragments at one depth the earlier may hide the later;
        `own_p99`, `own_max` : the same against the technique itself in unlimited precision and
            without bias: what rounding and bias do. Fragments for which float64 cannot tell are
            left out. None where answers are random, or nothing is left;
        `nan` : how many transmittances and pixels are not finite;
        `jump` : in the families `order` and `moving`, the most that the next order or step changes
            a fragment's transmittance beyond what it changes the exact one;
        `pivot`, `biased_pivot` : the least pivot of any ray's moments, without and with bias;
        `invalid` : the share of rays whose stored moments are, without bias, not positive definite;
        `bias`, `bias_needed` : the technique's own, and the least that makes all positive definite;
        `note`. What could not be had is None.
    """

    rows: Sequence[Row]
    machine: str = ""

    @property
    def columns(self) -> tuple[str, ...]:
        return COLUMNS

    @property
    def families(self) -> list[str]:
        return list(dict.fromkeys(row["family"] for row in self.rows))

    def of_family(self, name: str) -> list[Row]:
        """The rows of one family."""
        return [row for row in self.rows if row["family"] == name]

    def worst(self) -> list[Row]:
        """A row per technique and precision with the worst over all families and dials: the least
        pivots, the sum of NaN, the greatest of the rest. `family` and `dial` are those of the
        greatest `T_max`, `note` the first."""
        groups: dict[tuple[str, str], list[Row]] = {}
        for row in self.rows:
            groups.setdefault((row["technique"], row["precision"]), []).append(row)
        return [_worst(rows) for rows in groups.values()]

    def to_csv(self, path: str | os.PathLike[str]) -> None:
        """Writes the rows under a header; None is an empty field, numbers are exact."""
        write_rows(path, COLUMNS, self.rows)

    def to_json(self, path: str | os.PathLike[str]) -> None:
        """Writes {"machine", "rows"}; infinity and NaN are strings."""
        import json

        content = {"machine": self.machine, "rows": [plain(row) for row in self.rows]}
        write_text(path, json.dumps(content, indent=1, allow_nan=False) + "\n")

    def to_html(self, path: str | os.PathLike[str], title: str = "moit stability") -> None:
        """Writes one page that needs no other file: tables, and errors over each dial."""
        from moit.numerics.page import page

        if not isinstance(title, str):
            raise TypeError(f"title: expected str, got {type(title).__name__}")
        write_text(path, page(self, title))

    def __str__(self) -> str:
        columns = _columns_shown(self.rows, ("technique", "precision", *NUMBERS, "note"))
        rows = self.worst()
        return aligned(
            [heading(column) for column in columns],
            [[shown(column, row[column]) for column in columns] for row in rows],
            [column in WORDS for column in columns],
            [0] * len(rows),
        )

    def __repr__(self) -> str:
        techniques = {row["technique"] for row in self.rows}
        return (
            f"StabilityReport({len(self.rows)} rows: {len(self.families)} families, "
            f"{len(techniques)} techniques)"
        )

    def _repr_html_(self) -> str:
        from moit.numerics.page import worst_table

        return worst_table(self)


def heading(column: str) -> str:
    return HEADINGS.get(column, column)


def shown(column: str, value: Any) -> str:
    """A field with three digits; "-" for None."""
    if value is None:
        return "-"
    if not isinstance(value, (int, float)):
        return str(value)
    if isinstance(value, int):
        return str(value)
    if column == "dial" or not math.isfinite(value) or value == 0:
        return f"{value:g}"
    return number(float(f"{value:.2e}")) if abs(value) < 1e-3 else f"{value:.3g}"


def _columns_shown(rows: Sequence[Row], columns: Sequence[str]) -> list[str]:
    return [c for c in columns if c not in ("note", "jump") or any(row[c] for row in rows)]


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
