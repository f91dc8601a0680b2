"""What `compare` measured: rows of numbers, and the pictures and curves they were taken from."""

from __future__ import annotations

import csv
import io
import math
import os
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import Any, Self

from numpy.typing import NDArray

from moit.catalog import technique
from moit.gpu_costs.predicting import OnGpu, on_gpu
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
#: Errors of images, 0 where these are equal.
LESS_IS_BETTER = ("flip", "hdr_flip", "mse", "rmse", "mae")
AFTER_METRICS = ("T_mae", "T_p99", "T_max", "T_alpha", "note")
COSTS = {"seconds": "seconds", "bits": "bits_per_pixel", "gpu": "gpu_ms"}


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
class Findings:
    """Rows, and what they were taken from: what a report tells, and a page draws.

    gpu : what the rows' `gpu_ms` is predicted for; "" where they have none.
    """

    results: Sequence[Result]
    scenes: dict[str, Scene] = field(default_factory=dict)
    metrics: tuple[str, ...] = NAMES
    reference: str = "sorted"
    machine: str = ""
    gpu: str = ""

    @property
    def rows(self) -> list[Row]:
        return [result.row for result in self.results]

    @property
    def columns(self) -> tuple[str, ...]:
        predicted = ("gpu_ms",) if self.gpu else ()
        return (*BEFORE_METRICS, *predicted, *self.metrics, *AFTER_METRICS)

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
        by : "seconds", "bits", or "gpu": milliseconds predicted by `on_gpu`.

        A row without the cost or the error takes no part. Cheapest first in each scene.
        Raises ValueError for an unknown metric or cost, and for "gpu" where nothing is predicted.
        """
        cost = self._cost_field(by)
        metric = self.main_metric() if metric is None else metric
        self.check_metric(metric)
        front = []
        for group in self._groups():
            rows = [r for r in group if _is_number(r.get(cost)) and _is_number(r[metric])]
            rows.sort(key=lambda row: (row[cost], as_error(metric, row[metric])))
            best = math.inf
            for i, row in enumerate(rows):
                error = as_error(metric, row[metric])
                if i == 0 or error < best:
                    front.append(row)
                    best = error
        return front

    def _cost_field(self, by: str) -> str:
        field = cost_field(by)
        if by == "gpu" and not self.gpu:
            raise ValueError("by: 'gpu' needs a GPU: compare(gpu=...), or report.on_gpu(...)")
        return field

    def on_gpu(self, gpu: str | None = None, resolution: tuple[int, int] | None = None) -> Self:
        """The same, with `gpu_ms` in each row: milliseconds that the technique is predicted to
        take of a frame on a GPU, by moit's model (docs/gpu_costs.md), never measured.

        gpu : a name, such as "rx6800", "rx7900xtx" or "gtx1080ti"; None: "rx6800".
        resolution : (width, height) in pixels, at which each pixel has as many fragments as the
            scene's have; None: 1920 x 1080.

        None stands in rows of techniques that keep lists of fragments, or that nothing is known
        of. Raises ValueError where the GPU is not known.

        >>> f = moit.scenes.load("panes", (8, 6))
        >>> report = moit.compare(f, "power4", metrics="mse", repeat=1, progress=False)
        >>> report.on_gpu("rx6800").rows[0].gpu_ms < 10
        True
        """
        where = on_gpu(gpu, resolution)
        results = [self._with_gpu(result, where) for result in self.results]
        return replace(self, results=results, gpu=str(where))

    def _with_gpu(self, result: Result, where: OnGpu) -> Result:
        scene = self.scenes.get(result.row["scene"])
        spent = None
        if scene is not None:
            with suppress(ValueError):  # a name of one's own, which no catalogue has
                one = technique(result.row["technique"])
                spent = where.milliseconds(one, scene.fragments, math.prod(scene.shape))
        return replace(result, row=Row({**result.row, "gpu_ms": spent}))

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


def cost_field(by: str) -> str:
    """The column of a cost that users call "seconds", "bits" or "gpu"."""
    if not isinstance(by, str) or by not in COSTS:
        raise ValueError(f"by: expected 'seconds', 'bits' or 'gpu', got {by!r:.80}")
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
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    for row in rows:
        writer.writerow([exact(row.get(column)) for column in columns])
    write_text(path, text.getvalue())
