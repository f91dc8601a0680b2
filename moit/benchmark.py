"""How fast the CPU core is: every technique by sizes, threads and instruction sets, and rivals.

Times of one table are taken in rounds, each of which runs everything once, so that whatever else
the machine does falls on all alike; ratios are of the best times of a table.
"""

from __future__ import annotations

import dataclasses
import os
import re
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from moit import _core, moments, rivals
from moit.catalog import Technique, technique, techniques
from moit.deep import read_deep, write_deep
from moit.environment import machine, processors
from moit.fragments import Fragments
from moit.progress import Progress, steps
from moit.questions import composite
from moit.rivals import Missing

# Fragments a pixel: the same number for all, or geometrically distributed with that mean.
EVEN = (1, 4, 16, 64)
GEOMETRIC = (4, 16)
LAYOUTS = (*(f"{n} a pixel" for n in EVEN), *(f"geometric, mean {n}" for n in GEOMETRIC))
USUAL = LAYOUTS[2]

FRAGMENTS = 4 << 20
FOR_INSTRUCTIONS = 1 << 16
RECONSTRUCTED = ("power4", "power6", "power8")
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


def _compositing(f: Fragments, one: Technique | str) -> Callable[[int], NDArray[Any]]:
    return lambda threads: composite(f, one, threads=threads)


# ---- Techniques ----------------------------------------------------------------------------------


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
    inputs = {layout: fragments_of(layout, count) for layout in LAYOUTS}
    usual = inputs[USUAL]
    cells: dict[Any, Cell] = {}
    for name in names:
        for layout, f in inputs.items():
            cells[name, layout] = Cell(_compositing(f, name), len(f), threads)
        if threads > 1:
            cells[name, 1] = Cell(_compositing(usual, name), len(usual), 1)
        for one in sets[:-1]:
            cells[name, one] = Cell(_compositing(usual, name), len(usual), threads, one)
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


def _table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    lines = [list(head), *map(list, rows)]
    widths = [max(len(line[i]) for line in lines) for i in range(len(lines[0]))]
    text = [
        "| " + " | ".join(f"{cell:<{width}}" for cell, width in zip(line, widths, strict=True))
        for line in lines
    ]
    text.insert(1, "|" + "|".join("-" * (width + 2) for width in widths))
    return "\n".join(f"{line} |" if i != 1 else f"{line}|" for i, line in enumerate(text))


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
    return _table(head, rows)


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
    return _table(head, rows)


# ---- Rivals --------------------------------------------------------------------------------------


@dataclasses.dataclass(frozen=True)
class Race:
    """One question answered by moit and by a rival, or why there is none."""

    question: str
    rival: str
    threads: int
    ours: Times | None = None
    theirs: Times | None = None
    missing: str = ""

    @property
    def ratio(self) -> float:
        assert self.ours is not None and self.theirs is not None
        return (self.ours.rate) / self.theirs.rate


Pair = tuple[str, str, int, Callable[[int], object], Callable[[int], object]]


def races(
    count: int = FRAGMENTS,
    threads: int | None = None,
    repeat: int = 5,
    progress: Progress = True,
) -> list[Race]:
    """moit against its rivals: both of each pair in every round, on one thread and on all."""
    threads = threads or processors()
    counts = sorted({1, threads})
    pairs: list[Pair] = []
    lost: list[Race] = []
    f = fragments_of(USUAL, count)

    def enter(
        question: str,
        rival: str,
        make: Callable[[], Callable[[int], object]],
        ours: Callable[[int], object],
        n: int,
    ) -> None:
        try:
            theirs = make()
            pairs.append((question, rival, n, ours, theirs))
        except Missing as error:
            lost.append(Race(question, rival, 0, missing=str(error)))

    def scalar() -> Callable[[int], object]:
        rivals.power4_scalar(f[:1, :1], 1)
        return lambda threads: rivals.power4_scalar(f, threads)

    published = f'{BASE}(bias="published")'
    question = f"composite, {BASE}"
    enter(question, "scalar C with libm", scalar, _compositing(f, published), len(f))
    enter(
        question,
        "NumPy",
        lambda: lambda threads: rivals.power4_numpy(f),
        _compositing(f, published),
        len(f),
    )

    deep = _deep(count)
    enter(
        "composite, sorted",
        "OpenImageIO's flatten",
        lambda: rivals.DeepImage(deep).flatten,
        _compositing(deep, "sorted"),
        len(deep),
    )
    for name in RECONSTRUCTED:
        b0, b, z = _bare(name, count // 4)
        enter(
            f"bare reconstruction, {name}",
            "diffmoments",
            lambda b0=b0, b=b, z=z: _ignoring_threads(  # type: ignore[misc]
                rivals.diffmoments_transmittance(b0, b, z)
            ),
            lambda threads, name=name, b0=b0, b=b, z=z: moments.transmittance(  # type: ignore[misc]
                name, b0, b, z, threads=threads
            ),
            z.size,
        )

    cells = {}
    for question, rival, n, ours, theirs in pairs:
        for used in counts:
            cells[question, rival, used, "moit"] = Cell(ours, n, used)
            cells[question, rival, used, rival] = Cell(theirs, n, used)
    found = timed(cells, repeat, progress, "rivals")
    held = [
        Race(
            question,
            rival,
            used,
            found[question, rival, used, "moit"],
            found[question, rival, used, rival],
        )
        for question, rival, _, _, _ in pairs
        for used in counts
    ]
    return held + lost


def _ignoring_threads(call: Callable[[], object]) -> Callable[[int], object]:
    return lambda threads: call()


def _deep(count: int) -> Fragments:
    """A dense image of 20 samples a pixel, front to back as deep images are kept."""
    width = 1024
    height = max(1, count // 20 // width)
    f = fragments_of("4 a pixel", 4 * 5 * width * height)
    offsets = np.arange(width * height + 1) * 20
    return Fragments(offsets, f.depth, f.alpha, f.color, shape=(height, width)).sorted()


def _bare(name: str, count: int) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
    """Moments of pixels of 16 fragments, and the 16 depths to ask at."""
    f = fragments_of(USUAL, max(count, 16))
    b0, b = moments.gather(f, name)
    rng = np.random.default_rng(1)
    return b0, b, rng.uniform(-1, 1, (len(b0), 16)).astype(np.float32)


def races_table(found: Iterable[Race], rates: bool) -> str:
    """A row a race; `rates` in millions a second, too."""
    head = ["question", "rival", "threads", *(["moit", "rival's"] if rates else []), "moit is"]
    rows = []
    for one in found:
        if one.missing:
            rows.append([one.question, one.rival, "-", *(["-"] * (2 * rates)), one.missing])
            continue
        assert one.ours is not None and one.theirs is not None
        both = [f"{one.ours.rate:.1f}", f"{one.theirs.rate:.1f}"] if rates else []
        rows.append(
            [one.question, one.rival, str(one.threads), *both, f"{one.ratio:.2f} times as fast"]
        )
    return _table(head, rows)


# ---- Bounds --------------------------------------------------------------------------------------


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
    cells |= {name: Cell(_compositing(f, name), len(f), 1, used) for name in names}
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
from moit.benchmark import USUAL, fragments_of
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
        root = str(Path(__file__).resolve().parents[1])
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
    return _table(head, rows)


# ---- Besides -------------------------------------------------------------------------------------


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
    f = _deep(count)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "dense.exr"
        cells: dict[Any, Cell] = {
            "written": Cell(lambda threads: write_deep(path, f), len(f), 1),
            "read": Cell(lambda threads: read_deep(path), len(f), 1),
        }
        found = timed(cells, repeat)
    return Besides(min(map(float, fresh)), found["written"], found["read"])


# ---- Report --------------------------------------------------------------------------------------


@dataclasses.dataclass(frozen=True)
class Report:
    """All that `moit bench` measures."""

    suite: Suite
    races: list[Race]
    work: list[Work] | str
    besides: Besides
    count: int
    repeat: int

    def rates(self) -> str:
        """What a terminal shows: this machine's rates."""
        return self._text(
            f"Million fragments a second on {self.suite.threads} threads with "
            f"{self.suite.sets[-1]}; best of {self.repeat} rounds.",
            rates_table(self.suite),
            races_table(self.races, rates=True),
        ) + (
            f"\nimport moit: {self.besides.imported:.3f} s; million samples a second of deep "
            f"OpenEXR written: {self.besides.written.rate:.2f}, "
            f"read: {self.besides.read.rate:.2f}\n"
        )

    def ratios(self) -> str:
        """What a document may say: ratios within this run."""
        return self._text(
            f"Rates with 16 fragments a pixel as shares of {BASE}'s; the other columns as shares "
            "of the technique's own with 16 a pixel, and what threads and wider instructions give.",
            ratios_table(self.suite),
            races_table(self.races, rates=False),
        )

    def _text(self, said: str, techniques_: str, races_: str) -> str:
        about = (
            f"{machine()}. Whole composites in float32 of about {self.count:,} fragments, random "
            f"in depth and opacity; ratios of the best of {self.repeat} rounds."
        )
        bytes_ = self.suite.bytes_a_fragment[USUAL]
        parts = [
            about,
            "### Against others",
            races_,
            "### Techniques",
            said,
            techniques_,
            "### Bounds",
        ]
        if isinstance(self.work, str):
            parts.append(self.work)
        elif self.work:
            parts += [
                f"One thread, {self.work[0].instruction_set}, 16 a pixel, {bytes_:.1f} bytes a "
                "fragment; a fragment's instructions as callgrind counts them in moit_composite, "
                "and its cycles of a clock that a chain of additions measures.",
                work_table(self.work),
            ]
        return "\n\n".join(parts) + "\n"


WORKED = ("unsorted", "sorted", "wboit", "power4", "power6", "power8", "trig2", "trig3", "trig4")


def report(
    chosen: Iterable[Technique | str] | None = None,
    count: int = FRAGMENTS,
    threads: int | None = None,
    repeat: int = 3,
    counted: bool = False,
    progress: Progress = True,
) -> Report:
    """Measures everything.

    chosen : techniques; None: every one.
    count : fragments, about.
    threads : None: as many as this process has processors.
    counted : count instructions, too.

    Raises ValueError where there is nothing to time.
    """
    if repeat < 1 or count < 1 or (threads is not None and threads < 1):
        raise ValueError("repeat, fragments and threads: expected at least 1")
    names = [str(technique(one)) for one in (techniques() if chosen is None else chosen)]
    if not names:
        raise ValueError("techniques: expected at least one")
    found = suite(names, count, threads, repeat, progress)
    against = races(count, threads, repeat + 2, progress)
    spent: list[Work] | str
    try:
        spent = work([n for n in names if n in WORKED] or names, count, repeat + 2, counted)
    except Missing as error:
        spent = f"Not measured: {error}."
    return Report(found, against, spent, besides(count, repeat), count, repeat)


BEGIN, END = "<!-- moit bench -->", "<!-- end of moit bench -->"


def into_document(text: str, document: str | None) -> str:
    """A document with `text` for what stood between its two marks, or one of `text` alone."""
    marked = f"{BEGIN}\n{text}{END}\n"
    if document is None or BEGIN not in document or END not in document:
        return f"# Speed\n\n{marked}"
    before, _, rest = document.partition(BEGIN)
    _, _, after = rest.partition(END)
    return before + marked + after.removeprefix("\n")
