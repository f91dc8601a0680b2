"""What `compare` found: rows of numbers, and the pictures and curves they were taken from."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from numpy.typing import NDArray

from moit.metrics import NAMES
from moit.system.files import write_text

Array = NDArray[Any]

HIGHER_IS_BETTER = frozenset({"psnr", "ssim"})
BEFORE_METRICS = (
    "scene",
    "device",
    "technique",
    "bits_per_pixel",
    "seconds",
    "seconds_iqr",
    "fragments_per_second",
)
AFTER_METRICS = ("T_mae", "T_p99", "T_max", "T_alpha", "note")
COSTS = {"seconds": "seconds", "bits": "bits_per_pixel"}


class Row(dict[str, Any]):
    """One technique on one scene and device: a dict whose fields also read as attributes."""

    def __getattr__(self, name: str) -> Any:
        try:
            return self[name]
        except KeyError:
            raise AttributeError(f"a row has {', '.join(self)}; not {name!r}") from None


@dataclass(frozen=True)
class Scene:
    """What the techniques were held against on one input."""

    name: str
    shape: tuple[int, int]
    fragments: int
    most_layers: int
    reference: Array | None = None  # (H, W, 4), linear
    pixels: tuple[tuple[int, int], ...] = ()  # (y, x) in the array, of each curve
    depths: tuple[Array, ...] = ()  # (K,) a pixel
    curves: tuple[Array, ...] = ()  # (K,) a pixel: the exact transmittance there


@dataclass(frozen=True)
class Result:
    """One technique's row, image and curves; None where there are none."""

    row: Row
    image: Array | None = None  # (H, W, 4), linear
    curves: tuple[Array, ...] | None = None  # (K,) for each of the scene's pixels


@dataclass(frozen=True)
class Report:
    """The rows of a comparison.

    rows : one Row per scene, device and technique, in that order, with the fields `scene`,
        `device`, `technique`, `bits_per_pixel` (None: grows with the fragments), `seconds`
        (median), `seconds_iqr` (75th less 25th percentile), `fragments_per_second`, one field
        a metric, `T_mae`, `T_p99`, `T_max`, `T_alpha` (errors of the transmittance in front of
        each fragment: mean, 99 %, greatest, mean weighted by alpha) and `note`. What could not
        be had is None, and `note` says why.
    scenes, results : what the page draws.
    """

    results: Sequence[Result]
    scenes: dict[str, Scene] = field(default_factory=dict)
    metrics: tuple[str, ...] = NAMES
    reference: str = "sorted"
    machine: str = ""

    @property
    def rows(self) -> list[Row]:
        return [result.row for result in self.results]

    @property
    def columns(self) -> tuple[str, ...]:
        return (*BEFORE_METRICS, *self.metrics, *AFTER_METRICS)

    def of_scene(self, name: str) -> list[Result]:
        """The results on one scene."""
        return [result for result in self.results if result.row["scene"] == name]

    def main_metric(self) -> str:
        """The error that plots show: FLIP where any row has it, else the first metric."""
        for metric in ("flip", *self.metrics, "T_mae"):
            if any(row.get(metric) is not None for row in self.rows):
                return metric
        return self.metrics[0] if self.metrics else "T_mae"

    def pareto(self, metric: str | None = None, by: str = "seconds") -> list[Row]:
        """The rows that no other row of the same scene and device beats in both cost and error.

        metric : a metric's name or T_mae, T_p99, T_max, T_alpha; None: FLIP where there is one.
            PSNR and SSIM count upward.
        by : "seconds" or "bits".

        A row without the cost or the error takes no part. Cheapest first in each scene.
        Raises ValueError for an unknown metric or cost.
        """
        cost = cost_field(by)
        metric = self.main_metric() if metric is None else metric
        self.check_metric(metric)
        front = []
        for group in self._groups():
            rows = [r for r in group if _is_number(r[cost]) and _is_number(r[metric])]
            rows.sort(key=lambda row: (row[cost], as_error(metric, row[metric])))
            best = math.inf
            for i, row in enumerate(rows):
                error = as_error(metric, row[metric])
                if i == 0 or error < best:
                    front.append(row)
                    best = error
        return front

    def check_metric(self, metric: str) -> None:
        """Raises ValueError where no column has this error."""
        known = (*self.metrics, *AFTER_METRICS[:-1])
        if not isinstance(metric, str) or metric not in known:
            raise ValueError(f"metric: expected one of {', '.join(known)}, got {metric!r:.80}")

    def _groups(self) -> list[list[Row]]:
        groups: dict[tuple[str, str], list[Row]] = {}
        for row in self.rows:
            groups.setdefault((row["scene"], row["device"]), []).append(row)
        return list(groups.values())

    def to_csv(self, path: str | os.PathLike[str]) -> None:
        """Writes the rows under a header; None is an empty field, numbers are exact."""
        write_rows(path, self.columns, self.rows)

    def to_json(self, path: str | os.PathLike[str]) -> None:
        """Writes {"machine", "reference", "metrics", "rows"}; infinity and NaN are strings."""
        import json

        content = {
            "machine": self.machine,
            "reference": self.reference,
            "metrics": list(self.metrics),
            "rows": [plain(row) for row in self.rows],
        }
        write_text(path, json.dumps(content, indent=1, allow_nan=False) + "\n")

    def to_html(self, path: str | os.PathLike[str], title: str = "moit report") -> None:
        """Writes one page that needs no other file: table, images, error maps, curves, plots."""
        from moit.comparing.page import page

        if not isinstance(title, str):
            raise TypeError(f"title: expected str, got {type(title).__name__}")
        write_text(path, page(self, title))

    def __str__(self) -> str:
        from moit.reports.tables import text_table

        return text_table(self)

    def __repr__(self) -> str:
        rows = self.rows
        techniques = {row["technique"] for row in rows}
        scenes = {row["scene"] for row in rows}
        return f"Report({len(rows)} rows: {len(scenes)} scenes, {len(techniques)} techniques)"

    def _repr_html_(self) -> str:
        from moit.reports.tables import html_table

        return html_table(self)


def cost_field(by: str) -> str:
    """The column of a cost that users call "seconds" or "bits"."""
    if not isinstance(by, str) or by not in COSTS:
        raise ValueError(f"by: expected 'seconds' or 'bits', got {by!r:.80}")
    return COSTS[by]


def as_error(metric: str, value: float) -> float:
    """A metric's value such that less is better."""
    return -value if metric in HIGHER_IS_BETTER else value


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float)) and not math.isnan(value)


def exact(value: object) -> str:
    """A field as text that reads back to the same value; None is empty."""
    if value is None:
        return ""
    return repr(value) if isinstance(value, float) else str(value)


def plain(row: Row) -> dict[str, Any]:
    """A row for JSON, which has no infinity and no NaN: they become what float() reads."""
    return {
        name: str(value) if isinstance(value, float) and not math.isfinite(value) else value
        for name, value in row.items()
    }


def from_plain(
    fields: dict[str, Any], texts: tuple[str, ...] = ("scene", "device", "technique", "note")
) -> Row:
    """The row that `plain` wrote; `texts` are the fields that are no numbers."""
    return Row(
        (name, float(value) if isinstance(value, str) and name not in texts else value)
        for name, value in fields.items()
    )


def write_rows(path: str | os.PathLike[str], columns: Sequence[str], rows: Sequence[Row]) -> None:
    """Writes rows as CSV under a header; None is an empty field, numbers are exact."""
    import csv
    import io

    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    for row in rows:
        writer.writerow([exact(row.get(column)) for column in columns])
    write_text(path, text.getvalue())
