"""moit against its rivals: both of a pair in every round."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from moit import moments
from moit.benching import rivals
from moit.benching.rivals import Missing
from moit.benching.timing import (
    BASE,
    FRAGMENTS,
    USUAL,
    Cell,
    Times,
    compositing,
    dense_image,
    fragments_of,
    timed,
)
from moit.reports.tables import Table, markdown_table
from moit.system.environment import processors
from moit.system.progress import Progress, preparing

Array = NDArray[Any]

RECONSTRUCTED = ("power4", "power6", "power8")


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
    with preparing(progress, "bench") as first:
        first.now("builds rivals")
        pairs, lost = _pairs(count)
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


def _pairs(count: int) -> tuple[list[Pair], list[Race]]:
    """Those that can be raced here, and of the others what is missing."""
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
    enter(question, "scalar C with libm", scalar, compositing(f, published), len(f))
    enter(
        question,
        "NumPy",
        lambda: lambda threads: rivals.power4_numpy(f),
        compositing(f, published),
        len(f),
    )

    deep = dense_image(count)
    enter(
        "composite, sorted",
        "OpenImageIO's flatten",
        lambda: rivals.DeepImage(deep).flatten,
        compositing(deep, "sorted"),
        len(deep),
    )
    for name in RECONSTRUCTED:
        b0, b, z = _bare(name, count // 4)
        enter(
            f"bare reconstruction, {name}",
            "diffmoments",
            partial(_by_diffmoments, b0, b, z),
            partial(_reconstructed, name, b0, b, z),
            z.size,
        )
    return pairs, lost


def _reconstructed(name: str, b0: Array, b: Array, z: Array, threads: int) -> Array:
    return moments.transmittance(name, b0, b, z, threads=threads)


def _by_diffmoments(b0: Array, b: Array, z: Array) -> Callable[[int], object]:
    return _ignoring_threads(rivals.diffmoments_transmittance(b0, b, z))


def _ignoring_threads(call: Callable[[], object]) -> Callable[[int], object]:
    return lambda threads: call()


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
    return markdown_table(Table(head, rows, [True] * len(head)), padded=True)
