"""The table of a report's page: a row a technique, nearest first, with few columns."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from moit.catalog.palette import Look
from moit.comparing.answer import from_distance, nearness, told_value
from moit.comparing.rows import Findings, Row, exact
from moit.comparing.tables import PAPER_HEADS, best_rows
from moit.reports.columns import plain_number, shown
from moit.reports.tables import Cell, Table

MOST_SCENES = 4  # with a column each


@dataclass(frozen=True)
class _Column:
    """A number of a technique's rows, in the units of `field`, which says what is best."""

    head: str
    hint: str
    field: str
    value: Callable[[Sequence[Row]], float | None]


def summary(found: Findings, palette: Mapping[str, Look]) -> Table:
    """Memory, time, and the main error: the mean over the scenes, and of each where they are few.

    A technique that has no error on some scene stands at the end; below its name the reason.
    """
    metric = found.main_metric()
    scenes = list(dict.fromkeys(row["scene"] for row in found.rows))
    devices = len({row["device"] for row in found.rows}) > 1
    columns = _columns(metric, scenes, found.gpu)
    by_one: dict[tuple[str, str], list[Row]] = {}
    for row in found.rows:
        by_one.setdefault((row["technique"], row["device"]), []).append(row)
    ordered = sorted(
        by_one.values(),
        key=lambda rows: (
            rows[0]["technique"] == found.reference,
            len(rows) < len(scenes),
            _mean_distance(rows, metric),
        ),
    )
    values = [{c.head: c.value(rows) for c in columns} for rows in ordered]
    best = {c.head: _best(ordered, values, c, found.reference) for c in columns}
    cells: list[list[str | Cell]] = []
    for i, rows in enumerate(ordered):
        name = rows[0]["technique"]
        notes = list(dict.fromkeys(row["note"] for row in rows if row["note"]))
        look = palette[name].colour
        words: list[str | Cell] = [Cell(name, name, look, "; ".join(notes))]
        words += [Cell(rows[0]["device"], rows[0]["device"])] * devices
        numbers = [
            Cell(_told(c, values[i][c.head]), exact(values[i][c.head]), best=i in best[c.head])
            for c in columns
        ]
        cells.append([*words, *numbers])
    names = ["technique", *["device"] * devices]
    heads = [*names, *(c.head for c in columns)]
    return Table(
        heads,
        cells,
        [head in names for head in heads],
        hints=[*[""] * len(names), *(c.hint for c in columns)],
    )


def _columns(metric: str, scenes: Sequence[str], gpu: str) -> list[_Column]:
    word = PAPER_HEADS.get(metric, metric)
    columns = [
        _Column("bits", "bits per pixel beyond a colour target", "bits_per_pixel", _most_bits),
        _Column(
            "ms",
            "milliseconds for one composite, median, mean of the scenes",
            "seconds",
            _time("seconds"),
        ),
    ]
    if gpu:
        hint = f"milliseconds of a frame on a {gpu}, predicted, mean of the scenes"
        columns.append(_Column("gpu ms", hint, "gpu_ms", _time("gpu_ms")))
    if len(scenes) > 1:
        columns.append(
            _Column(
                f"{word}, mean",
                "over the scenes",
                metric,
                lambda rows: _mean(rows, metric, len(scenes)),
            )
        )
    if len(scenes) <= MOST_SCENES:
        for scene in scenes:
            head = word if len(scenes) == 1 else scene
            columns.append(_Column(head, f"{word} on {scene}", metric, _on(scene, metric)))
    return columns


def _most_bits(rows: Sequence[Row]) -> float | None:
    bits = [row["bits_per_pixel"] for row in rows]
    return None if None in bits else max(bits)


def _time(field: str) -> Callable[[Sequence[Row]], float | None]:
    def value(rows: Sequence[Row]) -> float | None:
        known = [row[field] for row in rows if row.get(field) is not None]
        return sum(known) / len(known) if known else None

    return value


def _mean(rows: Sequence[Row], metric: str, scenes: int) -> float | None:
    far = _mean_distance(rows, metric)
    return from_distance(metric, far) if len(rows) == scenes and far < math.inf else None


def _mean_distance(rows: Sequence[Row], metric: str) -> float:
    return sum(nearness(row, metric) for row in rows) / len(rows)


def _on(scene: str, metric: str) -> Callable[[Sequence[Row]], float | None]:
    def value(rows: Sequence[Row]) -> float | None:
        return next((row.get(metric) for row in rows if row["scene"] == scene), None)

    return value


def _best(
    ordered: Sequence[Sequence[Row]],
    values: Sequence[Mapping[str, float | None]],
    column: _Column,
    reference: str,
) -> set[int]:
    if column.field == "bits_per_pixel":  # what is least there is rarely any good
        return set()
    rows = [
        Row({"technique": own[0]["technique"], column.field: one[column.head]})
        for own, one in zip(ordered, values, strict=True)
    ]
    return best_rows(rows, column.field, reference)


def _told(column: _Column, value: float | None) -> str:
    if value is None:
        return "grows" if column.field == "bits_per_pixel" else "-"
    if column.field == "bits_per_pixel":
        return shown(column.field, value)
    if column.field == "seconds":
        return plain_number(1e3 * value)
    return told_value(column.field, value, 3)
