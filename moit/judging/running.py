"""moit.frontier: measures techniques on a draw, each result kept as soon as it is there."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np

from moit.catalog import Technique, listed
from moit.checks.arguments import one_of
from moit.checks.exceptions import told
from moit.checks.randomness import seed_of
from moit.comparing.results_folder import (
    answered,
    can_be_found,
    file_name,
    identities,
    is_kept,
    keep,
    numbers,
)
from moit.comparing.trials import FAILURES
from moit.judging.bootstrap import Estimate
from moit.judging.candidates import candidates
from moit.judging.draws import MOST_SEEDS, PANNED, SCENES, SETS, Draw, draw_named
from moit.judging.findings import Findings, Measured
from moit.judging.fronts import Means, best
from moit.judging.measuring import PanUnit, RayUnit, SceneUnit, Unit
from moit.judging.result import Frontier
from moit.system.environment import core_digest, machine
from moit.system.files import remove
from moit.system.progress import Progress, steps
from moit.system.version import VERSION

#: By size: rays of a set, frames of them, and sizes of pictures.
SIZES: dict[str, tuple[int, int, tuple[tuple[int, int], ...]]] = {
    "tiny": (200, 3, ((64, 36),)),
    "small": (3000, 6, ((320, 180),)),
    "full": (3000, 6, ((320, 180), (960, 540))),
}
NEAR = 1.05  # times the FLIP of the best with the same means: measured in large pictures, too
PROTOCOL = 1  # counts up when the same question gets another answer


def frontier(
    techniques: Technique | str | Iterable[Technique | str] | None = None,
    draw: str = "check",
    size: str = "small",
    *,
    seed: int = 0,
    rng: Any = None,
    progress: Progress = True,
    out: str | os.PathLike[str] | None = None,
) -> Frontier:
    """Techniques on random rays and on scenes that nobody tuned them on, and which is best for its
    bytes, passes and access.

    techniques : techniques or their names; None: those of the catalog that keep at most 72 bytes a
        pixel and no lists, as they are and with the options that make them better.
    draw : "tune", for constants, networks and choices among many; "check", for a choice among few;
        "final", for the table of a release: looked at once, and nothing is changed after it.
    size : "tiny" takes seconds for a few techniques; "small" has 3,000 rays of each set and
        pictures of 320 x 180, which takes three seconds a technique on two processors; "full" has
        pictures of 960 x 540, too, of all techniques that are given, or of those of the catalog
        that are near the front in small ones: some ten minutes.
    seed : which of the draws of that kind, up to 999,999; the final one is the version's.
    rng : in place of seed, as Scientific Python's SPEC 7 has it: an integer is that seed, of a
        `numpy.random.Generator` or what else `numpy.random.default_rng` takes one is drawn.
    progress : True, False, or a callable (done, total, label).
    out : a folder that gets each result as soon as it is there. Called again with the same folder,
        what it holds for the same question, by the same built core, is not measured again.

    Rays are of seven sets: even layers (A), one to four surfaces (B), clouds with surfaces (C),
    hair (D), sheets of much the same alpha (E), haze (F) and surfaces behind veils (G); no two
    fragments of a ray are at one depth. Scenes are all but that of coloured transmission; past
    those of triangles the camera goes a quarter of a pixel a frame, too.

    Raises ValueError and TypeError for bad arguments.

    >>> found = moit.frontier(["wboit", "power4"], size="tiny", progress=False)
    >>> found.row("power4").flip < found.row("wboit").flip
    True
    """
    one_of("size", size, tuple(SIZES))
    drawn = draw_named(draw, seed_of(seed, rng, MOST_SEEDS - 1))
    judged = candidates() if techniques is None else listed(techniques)
    units = units_of(drawn, size)
    kept = None if out is None else KeptMeasures(out)
    found: dict[Technique, dict[Unit, Measured]] = {one: {} for one in judged}
    result = Frontier(drawn, size, judged, units, found, machine())
    with steps(progress, len(units) * len(judged), "frontier") as done:
        near = judged
        for unit in units:
            if is_large(unit, size) and near is judged and techniques is None:
                near = near_front(result)
            for one, measured in measured_by(unit, near, kept, done.now):
                found[one][unit] = measured
                done(f"{one} on {unit.name}")
            for one in judged[len(near) :]:
                done(f"{one}, which is far from the front")
    return replace(result)  # without rows of what was not yet measured


def units_of(draw: Draw, size: str) -> list[Unit]:
    """What is measured on, rays first."""
    rays, frames, pictures = SIZES[size]
    return [
        *(RayUnit(draw, letter, rays, frames) for letter in SETS),
        *(
            unit(draw, scene, picture)
            for picture in pictures
            for scene in SCENES
            for unit in ((SceneUnit, PanUnit) if picture == pictures[0] else (SceneUnit,))
            if unit is SceneUnit or scene in PANNED
        ),
    ]


def is_large(unit: Unit, size: str) -> bool:
    """Whether it is a picture at another than the first size."""
    return isinstance(unit, SceneUnit) and unit.size != SIZES[size][2][0]


def near_front(found: Findings) -> list[Technique]:
    """Those whose FLIP is not much above that of any with the same means."""
    rows = replace(found).rows
    near = []
    for one, row in zip(found.techniques, rows, strict=True):
        means = Means(row["passes"] or 0, row["access"], row["bytes"] or 0)
        lead = best(rows, means)
        allowed = lead is not None and Means().allow(row) and row["flip"] is not None
        if lead is not None and allowed and row["flip"] <= NEAR * lead["flip"]:
            near.append(one)
    return near


def measured_by(
    unit: Unit, listed: Sequence[Technique], kept: KeptMeasures | None, now: Any
) -> Iterator[tuple[Technique, Measured]]:
    """What each technique is on a unit: what is kept, and then the others."""
    left = []
    for one in listed:
        if isinstance(unit, RayUnit) and one.block_side > 1:
            yield one, Measured({})  # rays have no neighbours to share a state with
            continue
        found = None if kept is None else kept.find(unit, one)
        if found is None:
            left.append(one)
        else:
            yield one, found
    if not left:
        return
    now(f"makes {unit.name}")
    prepared = unit.prepared()
    for one in left:
        now(f"{one} on {unit.name}")
        try:
            measured = Measured(prepared.measured(one))
        except FAILURES as failure:
            measured = Measured({}, told(failure))
        if kept is not None and not measured.note:
            kept.save(unit, one, measured)
        yield one, measured


class KeptMeasures:
    """What was measured, in a folder: `<draw>/<unit>/<technique>.json`, written whole."""

    def __init__(self, folder: str | os.PathLike[str]) -> None:
        self.folder = os.fspath(folder)
        os.makedirs(self.folder, exist_ok=True)

    def save(self, unit: Unit, one: Technique, measured: Measured) -> None:
        path = self._path(unit, one)
        os.makedirs(os.path.dirname(path), exist_ok=True)
        values = {
            name: numbers(np.array(estimate)) for name, estimate in measured.estimates.items()
        }
        keep(path, _question(unit, one), measured=values)

    def find(self, unit: Unit, one: Technique) -> Measured | None:
        """What is kept of an equal question."""
        if not can_be_found(one):
            return None
        with suppress(Exception):  # a damaged file may hold anything: measured again
            values = answered(self._path(unit, one), _question(unit, one))["measured"]
            estimates = {name: _estimate(*three) for name, three in values.items()}
            return Measured(estimates)
        return None

    def clear(self) -> None:
        """Removes all that is kept here, and nothing else."""
        for at, _, names in os.walk(self.folder):
            for path in (os.path.join(at, name) for name in names):
                if is_kept(path, "measured"):
                    remove(path)

    def _path(self, unit: Unit, one: Technique) -> str:
        name = f"{file_name(str(one))}.json"
        return os.path.join(self.folder, str(unit.draw), unit.name, name)


def _estimate(*three: float | None) -> Estimate:
    value, low, high = (float("nan") if number is None else float(number) for number in three)
    return Estimate(value, low, high)


def _question(unit: Unit, one: Technique) -> dict[str, Any]:
    return {
        "moit": VERSION,
        "core": core_digest(),
        "protocol": PROTOCOL,
        "draw": str(unit.draw),
        "unit": unit.name,
        "technique": str(one),
        **identities(technique=one),
    }
