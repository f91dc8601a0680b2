"""Times taken in rounds, each of which runs everything once, so that whatever else the machine does
falls on all alike; ratios are of the best times of a table. And what is timed.
"""

from __future__ import annotations

import dataclasses
import re
import statistics
import time
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from moit import _core
from moit.catalog import Technique
from moit.fragments.fragments import Fragments
from moit.questions import composite
from moit.system.progress import Progress, steps

# Fragments a pixel: the same number for all, or geometrically distributed with that mean.
EVEN = (1, 4, 16, 64)
GEOMETRIC = (4, 16)
LAYOUTS = (*(f"{n} a pixel" for n in EVEN), *(f"geometric, mean {n}" for n in GEOMETRIC))
USUAL = LAYOUTS[2]

FRAGMENTS = 4 << 20
BASE = "power4"  # that others are compared with


@dataclasses.dataclass(frozen=True)
class Times:
    """Seconds of repeated calls that deal with `count` fragments, samples or bytes."""

    count: int
    seconds: tuple[float, ...]

    @property
    def best(self) -> float:
        return min(self.seconds)

    @property
    def rate(self) -> float:
        """Of the best, in millions a second."""
        return self.count / self.best / 1e6

    @property
    def median_rate(self) -> float:
        return self.count / statistics.median(self.seconds) / 1e6


@dataclasses.dataclass(frozen=True)
class Cell:
    """A call to time, of `count` things, on so many threads with that instruction set."""

    call: Callable[[int], object]
    count: int
    threads: int
    instruction_set: str | None = None


def fragments_of(layout: str, count: int, seed: int = 0) -> Fragments:
    """About `count` random fragments in float32, as many a pixel as one of `LAYOUTS` says.

    Random in depth and opacity, which is the worst case for sorting.
    """
    if layout not in LAYOUTS:
        raise ValueError(f"layout: expected one of {', '.join(LAYOUTS)}, got {layout!r}")
    rng = np.random.default_rng(seed)
    mean = int(re.findall(r"\d+", layout)[0])
    pixels = max(1, count // mean)
    each = rng.geometric(1 / (mean + 1), pixels) - 1 if "mean" in layout else np.full(pixels, mean)
    offsets = np.concatenate([[0], np.cumsum(each)])
    n = int(offsets[-1])
    return Fragments(
        offsets,
        rng.uniform(1, 100, n).astype(np.float32),
        rng.uniform(0, 0.9, n).astype(np.float32),
        rng.random((n, 3), np.float32),
        depth_range=(1, 100),
    )


def dense_image(count: int) -> Fragments:
    """A dense image of 20 samples a pixel, front to back as deep images are kept."""
    width = 1024
    height = max(1, count // 20 // width)
    f = fragments_of("4 a pixel", 4 * 5 * width * height)
    offsets = np.arange(width * height + 1) * 20
    return Fragments(offsets, f.depth, f.alpha, f.color, shape=(height, width)).sorted()


def bytes_of(f: Fragments) -> int:
    """What a composite reads and writes at least: the fragments, the offsets, and the image."""
    arrays = (f.offsets, f.depth, f.alpha, f.color)
    return sum(one.nbytes for one in arrays if one is not None) + 4 * f.depth.itemsize * (
        len(f.offsets) - 1
    )


def timed(
    cells: Mapping[Any, Cell], repeat: int, progress: Progress = False, title: str = "rounds"
) -> dict[Any, Times]:
    """Times of every cell, in `repeat` rounds over all of them."""
    seconds: dict[Any, list[float]] = {key: [] for key in cells}
    before = _core.build_info()["instruction set in use"]
    try:
        with steps(progress, repeat * len(cells), title) as done:
            for _ in range(repeat):
                for key, cell in cells.items():
                    _core.use_instruction_set(cell.instruction_set or before)
                    start = time.perf_counter()
                    cell.call(cell.threads)
                    seconds[key].append(time.perf_counter() - start)
                    done(str(key))
    finally:
        _core.use_instruction_set(before)
    return {key: Times(cells[key].count, tuple(seconds[key])) for key in cells}


def instruction_sets() -> list[str]:
    """Those that this processor has, from the slowest on."""
    return [one.strip() for one in _core.build_info()["instruction sets"].split(",")]


def compositing(f: Fragments, one: Technique | str) -> Callable[[int], NDArray[Any]]:
    return lambda threads: composite(f, one, threads=threads)


def table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """Markdown, aligned."""
    lines = [list(head), *map(list, rows)]
    widths = [max(len(line[i]) for line in lines) for i in range(len(lines[0]))]
    text = [
        "| " + " | ".join(f"{cell:<{width}}" for cell, width in zip(line, widths, strict=True))
        for line in lines
    ]
    text.insert(1, "|" + "|".join("-" * (width + 2) for width in widths))
    return "\n".join(f"{line} |" if i != 1 else f"{line}|" for i, line in enumerate(text))
