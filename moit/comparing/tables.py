"""The rows of a comparison as tables: a short one for a terminal, all of them for the page."""

from __future__ import annotations

import math
from collections.abc import Sequence

from moit.catalog.palette import Look
from moit.comparing.rows import Findings, Row, as_error, exact
from moit.reports.columns import COLUMNS, WORDS, heading, shown
from moit.reports.tables import Cell, Table

# A terminal is narrower than a file: these stay in CSV, JSON and the page.
NOT_IN_TEXT = frozenset({"seconds_iqr", "mse", "mae"})
BEST_OF = ("seconds", "gpu_ms", "T_mae", "T_p99", "T_max", "T_alpha")


def short_table(found: Findings) -> Table:
    """Without columns that are empty or the same everywhere."""
    columns = [
        column
        for column in _columns(found)
        if column not in NOT_IN_TEXT
        and not (column == "note" and not any(row["note"] for row in found.rows))
    ]
    return Table(
        [heading(column, as_field=True) for column in columns],
        [[shown(column, row.get(column)) for column in columns] for row in found.rows],
        [column in WORDS for column in columns],
        [row["scene"] for row in found.rows],
    )


def full_table(found: Findings, palette: dict[str, Look]) -> Table:
    """Every number with all its digits, the best of each scene marked; notes below techniques."""
    columns = [column for column in _columns(found) if column != "note"]
    cells, scenes = [], []
    for name in dict.fromkeys(row["scene"] for row in found.rows):
        rows = [row for row in found.rows if row["scene"] == name]
        best = {c: best_rows(rows, c, found.reference) for c in (*found.metrics, *BEST_OF)}
        note = ""
        for i, row in enumerate(rows):
            cells.append(
                [
                    _cell(row, column, i in best.get(column, ()), row["note"] != note, palette)
                    for column in columns
                ]
            )
            note = row["note"]
        scenes += [name] * len(rows)
    return Table(
        [heading(column, as_field=True) for column in columns],
        cells,
        [column in WORDS for column in columns],
        scenes,
        [COLUMNS[column].unit if column in COLUMNS else "" for column in columns],
    )


# What papers call columns, with units.
PAPER_HEADS = {
    "scene": "Scene",
    "device": "Device",
    "technique": "Technique",
    "bits_per_pixel": "Memory [bit/px]",
    "seconds": "Time [ms]",
    "seconds_iqr": "± [ms]",
    "fragments_per_second": "Rate [Mfrag/s]",
    "gpu_ms": "Frame, predicted [ms]",
    "mse": "MSE",
    "rmse": "RMSE",
    "mae": "MAE",
    "psnr": "PSNR [dB]",
    "ssim": "SSIM",
    "flip": "FLIP",
    "hdr_flip": "HDR-FLIP",
    "T_mae": "T MAE",
    "T_p99": "T 99 %",
    "T_max": "T max",
    "T_alpha": "T by alpha",
    "note": "Note",
}


def paper_table(found: Findings, columns: Sequence[str] | None = None, digits: int = 3) -> Table:
    """With units, sensible digits and the best of each scene marked.

    columns : None: technique, memory, time and the errors of images, with scene and device where
        there are several; without those that are empty.

    Raises ValueError and TypeError for what is no column.
    """
    if columns is None:
        words = [name for name in ("scene", "device") if len({row[name] for row in found.rows}) > 1]
        numbers = ("bits_per_pixel", "seconds", *found.metrics)
        wanted = [*words, "technique"]
        wanted += [c for c in numbers if any(row.get(c) is not None for row in found.rows)]
    else:
        wanted = [columns] if isinstance(columns, str) else list(columns)
        for column in wanted:
            if column not in found.columns:
                known = ", ".join(found.columns)
                raise ValueError(f"columns: expected some of {known}, got {column!r:.80}")
    cells: list[list[str | Cell]] = []
    scenes: list[str] = []
    for name in dict.fromkeys(row["scene"] for row in found.rows):
        rows = [row for row in found.rows if row["scene"] == name]
        marked = (*found.metrics, *BEST_OF)
        best = {c: best_rows(rows, c, found.reference) for c in wanted if c in marked}
        for i, row in enumerate(rows):
            texts = [shown(column, row.get(column), digits) for column in wanted]
            flags = [i in best.get(column, ()) for column in wanted]
            cells.append([Cell(text, best=flag) for text, flag in zip(texts, flags, strict=True)])
        scenes += [name] * len(rows)
    heads = [PAPER_HEADS[column] for column in wanted]
    return Table(heads, cells, [column in WORDS for column in wanted], scenes)


def _columns(found: Findings) -> list[str]:
    devices = {row["device"] for row in found.rows}
    return [c for c in found.columns if not (c == "device" and devices <= {"cpu"})]


def _cell(row: Row, column: str, is_best: bool, with_note: bool, palette: dict[str, Look]) -> Cell:
    text, full = shown(column, row.get(column)), exact(row.get(column))
    if column != "technique":
        return Cell(text, full, best=is_best)
    return Cell(text, full, palette[row[column]].colour, row["note"] if with_note else "", is_best)


def best_rows(rows: list[Row], column: str, reference: str) -> set[int]:
    """Indices of the rows that are best in a column; in errors the reference does not count."""
    found = {
        i: as_error(column, row[column])
        for i, row in enumerate(rows)
        if isinstance(row.get(column), (int, float))
        and not math.isnan(row[column])
        and (column == "seconds" or row["technique"] != reference)
    }
    return {i for i, error in found.items() if error == min(found.values())}
