"""What `compare` found, as text, CSV, JSON and a page."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from moit.checks.arguments import one_of
from moit.comparing.page import page
from moit.comparing.rows import Findings, plain, write_rows
from moit.comparing.tables import paper_table, short_table
from moit.reports.columns import WORDS
from moit.reports.tables import Table, html_table, latex_table, markdown_table, text_table
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
        """Writes one page that needs no other file and no script: which technique is nearest within
        which memory, images with error maps, curves, error over cost, and all numbers."""
        if not isinstance(title, str):
            raise TypeError(f"title: expected str, got {type(title).__name__}")
        write_text(path, page(self, title))

    def to_markdown(
        self,
        path: str | os.PathLike[str] | None = None,
        *,
        columns: Sequence[str] | None = None,
        digits: int = 3,
    ) -> str:
        """A Markdown table: units, the best of each scene bold. Returned, and written where there
        is a path.

        columns : as of a row; None: technique, memory, time and errors of images. digits :
            significant ones, from 1 to 4.

        >>> f = moit.scenes.load("panes", (16, 12))
        >>> report = moit.compare(f, "wboit", metrics="mse", repeat=1, progress=False)
        >>> print(report.to_markdown(columns=["technique", "bits_per_pixel"]))
        | Technique | Memory [bit/px] |
        | :-- | --: |
        | wboit | 8 |
        """
        return self._paper(markdown_table, path, columns, digits)

    def to_latex(
        self,
        path: str | os.PathLike[str] | None = None,
        *,
        columns: Sequence[str] | None = None,
        digits: int = 3,
    ) -> str:
        r"""A LaTeX tabular with the rules of the package booktabs: units, the best of each scene
        bold, a rule between scenes. Arguments as `to_markdown`.

        >>> f = moit.scenes.load("panes", (16, 12))
        >>> report = moit.compare(f, "wboit", metrics="mse", repeat=1, progress=False)
        >>> print(report.to_latex(columns=["technique", "bits_per_pixel"]).splitlines()[2])
        Technique & Memory [bit/px] \\
        """
        return self._paper(latex_table, path, columns, digits)

    def _paper(
        self,
        write: Callable[[Table], str],
        path: str | os.PathLike[str] | None,
        columns: Sequence[str] | None,
        digits: int,
    ) -> str:
        one_of("digits", digits, (1, 2, 3, 4))
        text = write(paper_table(self, columns, digits))
        if path is not None:
            write_text(path, text if text.endswith("\n") else f"{text}\n")
        return text

    def to_pandas(self) -> Any:
        """The rows as a pandas.DataFrame, a column a field; numbers that are missing are NaN.

        Raises ImportError where pandas is missing.
        """
        try:
            import pandas
        except ImportError as error:
            raise _missing("pandas", error) from error
        frame = pandas.DataFrame(list(map(dict, self.rows)), columns=list(self.columns))
        numbers = [column for column in self.columns if column not in WORDS]
        return frame.astype(dict.fromkeys(numbers, float))

    def to_xarray(self) -> Any:
        """The rows as an xarray.Dataset over scene, device and technique, a variable a field;
        numbers that are missing are NaN, as is what was not compared.

        Raises ImportError where xarray is missing.
        """
        try:
            import xarray
        except ImportError as error:
            raise _missing("xarray", error) from error
        axes = ("scene", "device", "technique")
        along = {axis: list(dict.fromkeys(row[axis] for row in self.rows)) for axis in axes}
        shape = tuple(len(along[axis]) for axis in axes)
        fields: dict[str, Any] = {}
        for column in self.columns:
            if column in axes:
                continue
            is_word = column in WORDS
            values = np.full(shape, "" if is_word else np.nan, object if is_word else float)
            for row in self.rows:
                at = tuple(along[axis].index(row[axis]) for axis in axes)
                if row.get(column) is not None:
                    values[at] = row[column]
            fields[column] = (axes, values)
        about = {"machine": self.machine, "reference": self.reference}
        return xarray.Dataset(fields, along, about)

    def __str__(self) -> str:
        return text_table(short_table(self))

    def __repr__(self) -> str:
        rows = self.rows
        techniques = {row["technique"] for row in rows}
        scenes = {row["scene"] for row in rows}
        return f"Report({len(rows)} rows: {len(scenes)} scenes, {len(techniques)} techniques)"

    def _repr_html_(self) -> str:
        return html_table(replace(short_table(self), groups=()))


def _missing(package: str, error: ImportError) -> ImportError:
    return ImportError(
        f"this needs {package} ({error}); install it with: pip install 'moit[tables]'"
    )
