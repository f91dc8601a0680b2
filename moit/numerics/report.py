"""What `stability` found: rows of numbers, and their tables."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from dataclasses import dataclass

from moit.comparing.rows import Row, plain, write_rows
from moit.numerics.columns import COLUMNS, NUMBERS, table, worst
from moit.numerics.page import OF_WORST, page
from moit.reports.tables import html_table, text_table
from moit.system.files import write_text


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
        `brightness` : the most that a pixel's weights sum to beyond or short of what is covered, 1
            for all of a pixel: so much too bright or too dark are pictures;
        `nan` : how many transmittances and pixels are not finite;
        `jump` : in the families `order` and `moving`, the most that the next order or step changes
            a fragment's transmittance beyond what it changes the exact one;
        `pivot`, `biased_pivot` : the least pivot of any ray's moments, without and with bias;
        `invalid` : the share of rays whose stored moments are, without bias, not positive definite;
        `bias`, `bias_needed` : the technique's own, and the least that makes all positive definite;
        `note`. What could not be had is None.

    >>> report = moit.stability("power4", rays=2, progress=False)
    >>> "T_p99" in report.rows[0]
    True
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
        return worst(self.rows)

    def to_csv(self, path: str | os.PathLike[str]) -> None:
        """Writes the rows under a header; None is an empty field, numbers are exact."""
        write_rows(path, COLUMNS, self.rows)

    def to_json(self, path: str | os.PathLike[str]) -> None:
        """Writes {"machine", "rows"}; infinity and NaN are strings."""
        content = {"machine": self.machine, "rows": [plain(row) for row in self.rows]}
        write_text(path, json.dumps(content, indent=1, allow_nan=False) + "\n")

    def to_html(self, path: str | os.PathLike[str], title: str = "moit stability") -> None:
        """Writes one page that needs no other file: tables, and errors over each dial."""
        if not isinstance(title, str):
            raise TypeError(f"title: expected str, got {type(title).__name__}")
        write_text(path, page(self.rows, self.machine, title))

    def __str__(self) -> str:
        columns = [
            column
            for column in ("technique", "precision", *NUMBERS, "note")
            if column not in ("note", "jump") or any(row[column] for row in self.rows)
        ]
        return text_table(table(self.worst(), columns))

    def __repr__(self) -> str:
        techniques = {row["technique"] for row in self.rows}
        return (
            f"StabilityReport({len(self.rows)} rows: {len(self.families)} families, "
            f"{len(techniques)} techniques)"
        )

    def _repr_html_(self) -> str:
        return html_table(table(self.worst(), OF_WORST))
