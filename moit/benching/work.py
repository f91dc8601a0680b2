"""What a fragment costs in cycles, instructions and memory, and what else one waits for."""

from __future__ import annotations

import dataclasses
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from moit.benching import rivals
from moit.benching.timing import (
    FRAGMENTS,
    USUAL,
    Cell,
    Times,
    bytes_of,
    compositing,
    dense_image,
    fragments_of,
    instruction_sets,
    timed,
)
from moit.catalog import Technique, technique
from moit.formats.deep import read_deep, write_deep
from moit.reports.tables import Table, markdown_table

FOR_INSTRUCTIONS = 1 << 16


@dataclasses.dataclass(frozen=True)
class Work:
    """What a fragment costs on one thread.

    instructions : counted by callgrind; None where that is not there.
    cycles : of the clock, by the measured time and the clock's measured rate.
    bandwidth : its share of the rate at which one thread reads memory.
    """

    technique: str
    instruction_set: str
    instructions: float | None
    cycles: float
    bandwidth: float


def work(
    chosen: Iterable[Technique | str], count: int = FRAGMENTS, repeat: int = 5, counted: bool = True
) -> list[Work]:
    """Cycles and instructions a fragment, and share of memory bandwidth, with 16 a pixel.

    counted : run each technique under valgrind's callgrind, which takes half a minute each.

    With AVX2 where there is that, as valgrind knows nothing wider. Raises Missing without a
    compiler.
    """
    f = fragments_of(USUAL, count)
    names = [str(technique(one)) for one in chosen]
    used = "avx2" if "avx2" in instruction_sets() else instruction_sets()[0]
    read, spin = rivals.bytes_read(), rivals.clock_cycles()
    cells: dict[Any, Cell] = {
        "bytes": Cell(lambda threads: read(), read(), 1),
        "cycles": Cell(lambda threads: spin(), spin(), 1),
    }
    cells |= {name: Cell(compositing(f, name), len(f), 1, used) for name in names}
    found = timed(cells, repeat)
    return [
        Work(
            name,
            used,
            instructions(name, used) if counted else None,
            found["cycles"].rate / found[name].rate,
            found[name].rate * bytes_of(f) / len(f) / found["bytes"].rate,
        )
        for name in names
    ]


_COUNTED = """
import sys
from moit.benching.timing import USUAL, fragments_of
from moit.questions import composite
f = fragments_of(USUAL, int(sys.argv[2]))
composite(f, sys.argv[1], threads=1)
"""


def instructions(name: str, used: str, count: int = FOR_INSTRUCTIONS) -> float | None:
    """Instructions a fragment of one composite, or None where callgrind does not count them."""
    if not shutil.which("valgrind"):
        return None
    with tempfile.TemporaryDirectory() as folder:
        command = [
            "valgrind",
            "--tool=callgrind",
            f"--callgrind-out-file={Path(folder) / 'counted'}",
            "--toggle-collect=moit_composite",
            sys.executable,
            *("-c", _COUNTED, name, str(count)),
        ]
        root = str(Path(__file__).resolve().parents[2])
        path = os.pathsep.join(filter(None, [root, os.environ.get("PYTHONPATH")]))
        environment = os.environ | {"MOIT_ISA": used, "PYTHONPATH": path}
        done = subprocess.run(command, capture_output=True, text=True, env=environment)
    collected = re.search(r"Collected : (\d+)", done.stderr)
    if done.returncode or not collected or int(collected[1]) == 0:
        return None
    return int(collected[1]) / count


def work_table(found: Iterable[Work]) -> str:
    head = ["technique", "instructions", "cycles", "a cycle", "of memory's rate"]
    rows = []
    for one in found:
        counted = one.instructions
        rows.append(
            [
                f"`{one.technique}`",
                "-" if counted is None else f"{counted:.1f}",
                f"{one.cycles:.1f}",
                "-" if counted is None else f"{counted / one.cycles:.2f}",
                f"{one.bandwidth:.0%}",
            ]
        )
    return markdown_table(Table(head, rows, [True] * len(head)), padded=True)


@dataclasses.dataclass(frozen=True)
class Besides:
    """What else one waits for.

    imported : seconds of `import moit` in a fresh interpreter, NumPy included; the best.
    written, read : of `write_deep` and `read_deep` of a dense image of five channels.
    """

    imported: float
    written: Times
    read: Times


def besides(count: int = FRAGMENTS, repeat: int = 3) -> Besides:
    """Times the import, and deep OpenEXR files of about `count` samples."""
    command = "import time; t = time.perf_counter(); import moit; print(time.perf_counter() - t)"
    fresh = [subprocess.check_output([sys.executable, "-c", command]) for _ in range(repeat)]
    f = dense_image(count)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "dense.exr"
        cells: dict[Any, Cell] = {
            "written": Cell(lambda threads: write_deep(path, f), len(f), 1),
            "read": Cell(lambda threads: read_deep(path), len(f), 1),
        }
        found = timed(cells, repeat)
    return Besides(min(map(float, fresh)), found["written"], found["read"])
