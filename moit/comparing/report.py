"""What `compare` found, as text, CSV, JSON and a page."""

from __future__ import annotations

import json
import os
from dataclasses import replace

from moit.comparing.page import page
from moit.comparing.rows import Findings, plain, write_rows
from moit.comparing.tables import short_table
from moit.reports.tables import html_table, text_table
from moit.system.files import write_text


class Report(Findings):
    """The rows of a comparison.

    rows : one Row per scene, device and technique, in that order, with the fields `scene`,
        `device`, `technique`, `bits_per_pixel` (None: grows with the fragments), `seconds`
        (median), `seconds_iqr` (75th less 25th percentile), `fragments_per_second`, one field
        a metric, `T_mae`, `T_p99`, `T_max`, `T_alpha` (errors of the transmittance in front of
        each fragment: mean, 99 %, greatest, mean weighted by alpha) and `note`. What could not
        be had is None, and `note` says why.
    scenes, results : what the page draws.

    >>> f = moit.scenes.load("panes", (8, 6))
    >>> report = moit.compare(f, "wboit", metrics="mse", repeat=1, progress=False)
    >>> report.metrics, report.reference
    (('mse',), 'sorted')
    """

    def to_csv(self, path: str | os.PathLike[str]) -> None:
        """Writes the rows under a header; None is an empty field, numbers are exact."""
        write_rows(path, self.columns, self.rows)

    def to_json(self, path: str | os.PathLike[str]) -> None:
        """Writes {"machine", "reference", "metrics", "rows"}; infinity and NaN are strings."""
        content = {
            "machine": self.machine,
            "reference": self.reference,
            "metrics": list(self.metrics),
            "rows": [plain(row) for row in self.rows],
        }
        write_text(path, json.dumps(content, indent=1, allow_nan=False) + "\n")

    def to_html(self, path: str | os.PathLike[str], title: str = "moit report") -> None:
        """Writes one page that needs no other file: table, images, error maps, curves, plots."""
        if not isinstance(title, str):
            raise TypeError(f"title: expected str, got {type(title).__name__}")
        write_text(path, page(self, title))

    def __str__(self) -> str:
        return text_table(short_table(self))

    def __repr__(self) -> str:
        rows = self.rows
        techniques = {row["technique"] for row in rows}
        scenes = {row["scene"] for row in rows}
        return f"Report({len(rows)} rows: {len(scenes)} scenes, {len(techniques)} techniques)"

    def _repr_html_(self) -> str:
        return html_table(replace(short_table(self), groups=()))
