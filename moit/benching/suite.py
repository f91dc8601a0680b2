"""Every technique by layout, threads and instruction set."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from typing import Any

from moit.benching.timing import (
    BASE,
    FRAGMENTS,
    LAYOUTS,
    USUAL,
    Cell,
    Times,
    bytes_of,
    compositing,
    fragments_of,
    instruction_sets,
    timed,
)
from moit.catalog import Technique, technique
from moit.reports.tables import Table, markdown_table
from moit.system.environment import processors
from moit.system.progress import Progress, preparing


@dataclasses.dataclass(frozen=True)
class Suite:
    """Times of techniques: by layout on all threads, by threads, and by instruction set."""

    names: tuple[str, ...]
    threads: int
    sets: tuple[str, ...]
    layouts: dict[tuple[str, str], Times]
    one_thread: dict[str, Times]
    by_set: dict[tuple[str, str], Times]
    bytes_a_fragment: dict[str, float]


def suite(
    chosen: Iterable[Technique | str],
    count: int = FRAGMENTS,
    threads: int | None = None,
    repeat: int = 3,
    progress: Progress = True,
) -> Suite:
    """Times composites of every one of `chosen` with about `count` fragments in each layout."""
    names = tuple(str(technique(one)) for one in chosen)
    threads = threads or processors()
    sets = tuple(instruction_sets())
    with preparing(progress, "bench") as first:
        first.now("makes fragments")
        inputs = {layout: fragments_of(layout, count) for layout in LAYOUTS}
    usual = inputs[USUAL]
    cells: dict[Any, Cell] = {}
    for name in names:
        for layout, f in inputs.items():
            cells[name, layout] = Cell(compositing(f, name), len(f), threads)
        if threads > 1:
            cells[name, 1] = Cell(compositing(usual, name), len(usual), 1)
        for one in sets[:-1]:
            cells[name, one] = Cell(compositing(usual, name), len(usual), threads, one)
    found = timed(cells, repeat, progress, "techniques")
    return Suite(
        names,
        threads,
        sets,
        {(name, layout): found[name, layout] for name in names for layout in LAYOUTS},
        {name: found[name, 1 if threads > 1 else USUAL] for name in names},
        {(name, one): found[name, one] for name in names for one in sets[:-1]}
        | {(name, sets[-1]): found[name, USUAL] for name in names},
        {layout: bytes_of(f) / max(len(f), 1) for layout, f in inputs.items()},
    )


def rates_table(found: Suite) -> str:
    """Million fragments a second: best of the rounds, and the median with 16 a pixel."""
    head = ["technique", *LAYOUTS, "median", "1 thread", *found.sets[:-1]]
    rows = [
        [
            f"`{name}`",
            *(f"{found.layouts[name, layout].rate:.1f}" for layout in LAYOUTS),
            f"{found.layouts[name, USUAL].median_rate:.1f}",
            f"{found.one_thread[name].rate:.1f}",
            *(f"{found.by_set[name, one].rate:.1f}" for one in found.sets[:-1]),
        ]
        for name in found.names
    ]
    return markdown_table(Table(head, rows, [True] * len(head)), padded=True)


def ratios_table(found: Suite) -> str:
    """The same as shares: of power4, of 16 a pixel, of one thread, of the slowest set."""
    base = BASE if BASE in found.names else found.names[0]
    usual = found.layouts[base, USUAL].rate
    others = [layout for layout in LAYOUTS if layout != USUAL]
    first, *wider = found.sets
    head = [
        "technique",
        f"of {base}",
        *others,
        f"{found.threads} threads",
        *(f"{one} over {first}" for one in wider),
    ]
    rows = []
    for name in found.names:
        own = found.layouts[name, USUAL].rate
        rows.append(
            [
                f"`{name}`",
                f"{own / usual:.0%}",
                *(f"{found.layouts[name, layout].rate / own:.0%}" for layout in others),
                f"{own / found.one_thread[name].rate:.2f}x",
                *(
                    f"{found.by_set[name, one].rate / found.by_set[name, first].rate:.2f}x"
                    for one in wider
                ),
            ]
        )
    return markdown_table(Table(head, rows, [True] * len(head)), padded=True)
