"""stability: every technique on families of rays that are hard on it, in every precision."""

from __future__ import annotations

import os
from collections.abc import Iterable
from contextlib import suppress
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from moit import moments
from moit.catalog import MomentTechnique, Technique, listed
from moit.checks.arguments import nearest, whole
from moit.checks.exceptions import told
from moit.checks.randomness import seed_of
from moit.comparing.measurement import strictly_nearer
from moit.comparing.results_folder import (
    answered,
    can_be_found,
    file_name,
    identities,
    is_kept,
    keep,
)
from moit.comparing.rows import Row, from_plain, plain
from moit.core.questions import in_precision
from moit.fragments.fragments import Fragments
from moit.numerics.bias import moment_state
from moit.numerics.columns import COLUMNS, PRECISIONS
from moit.numerics.hard_cases import COLOR, FAMILIES, Case, Family
from moit.numerics.report import StabilityReport
from moit.numerics.unlimited import stored_as, unlimited, unlimited_transmittance
from moit.questions import composite, transmittance
from moit.system.environment import machine
from moit.system.files import remove
from moit.system.progress import Progress, steps

Array = NDArray[Any]

TEXTS = ("family", "technique", "precision", "note")


def stability(
    techniques: Technique | str | Iterable[Technique | str] | None = None,
    *,
    families: str | Iterable[str] | None = None,
    precisions: str | Iterable[str] = PRECISIONS,
    rays: int = 256,
    seed: int = 0,
    rng: Any = None,
    progress: Progress = True,
    out: str | os.PathLike[str] | None = None,
) -> StabilityReport:
    """Errors, NaN and moments of techniques on families of hard rays, each with one dial.

    techniques : techniques or their names; None: `moit.techniques()`.
    families : names out of `distance`, `opaque`, `clear`, `layers`, `range`, `one-depth`,
        `symmetric`, `ends`, `order`, `moving`, `thin`, `adjacent`, `overflow`, `screen`, `tilted`;
        None: all.
    precisions : "float32" and "float64", the fragments' dtype, and "16 bit", words or half floats
        of float32 fragments. A technique is measured in the forms that it has: `power4` is
        `power4-16` in 16 bit and the other way round. Depths and alphas are the same float32
        numbers in all.
    rays : how many at each setting of a dial, from 1; of many layers there are fewer.
    seed : of what is random in the rays, from 0.
    rng : in place of seed, as Scientific Python's SPEC 7 has it: an integer is that seed, of a
        `numpy.random.Generator` or what else `numpy.random.default_rng` takes one is drawn.
    progress : True, False, or a callable (done, total, label).
    out : a folder that gets each technique's rows as soon as they are there. Called again with the
        same folder, what it holds for the same question is not measured again.

    Rays are the pixels of one row, but of a picture in `order`, `screen` and `tilted`: what shares
    moments among blocks of pixels mixes neighbours, and has no jump. What the columns mean:
    `StabilityReport`. A technique that fails has its rows all the same, with the error as their
    note. Raises ValueError and TypeError for bad arguments.

    >>> report = moit.stability("power4", rays=2, progress=False)
    >>> sorted({row.technique for row in report.rows})
    ['power4', 'power4-16']
    """
    chosen = listed(techniques)
    named = _names("families", families, list(FAMILIES))
    forms = _names("precisions", precisions, list(PRECISIONS))
    count = whole("rays", rays, 1)
    start = whole("seed", seed_of(seed, rng), 0)
    pairs = _pairs(chosen, forms)
    if not pairs:
        names = ", ".join(map(str, chosen))
        raise ValueError(f"precisions: {names} has no form in {', '.join(forms)}")
    if out is not None:
        os.makedirs(out, exist_ok=True)

    rows: list[Row] = []
    with steps(progress, len(named) * len(pairs), "stability") as done:
        for name in named:
            settings = _Settings(FAMILIES[name], count, start)
            for one, precision in pairs:
                done.now(f"{name} {one} {precision}")
                rows += _kept_or_measured(settings, one, precision, out)
                done(f"{name} {one} {precision}")
    return StabilityReport(rows, machine())


class _Settings:
    """A family's cases with what is true of them, made when first asked for."""

    def __init__(self, family: Family, rays: int, seed: int) -> None:
        self.family, self.rays, self.seed = family, rays, seed

    @cached_property
    def cases(self) -> list[_Truth]:
        made = (self.family.case(value, self.rays, self.seed) for value in self.family.values)
        return [_Truth(case) for case in made]


class _Truth:
    """A case, the exact transmittance, and each technique's own in unlimited precision."""

    def __init__(self, case: Case) -> None:
        self.case = case
        self.single = in_precision(case.f, np.float32)
        self.least = transmittance(case.f, "sorted", cull_opaque=False)
        self.most = strictly_nearer(case.f, self.least)
        self.image = composite(case.f, "sorted", cull_opaque=False)
        self._own: dict[Technique | None, Array | None] = {}

    def fragments(self, precision: str) -> Fragments:
        return self.case.f if precision == "float64" else self.single

    def own(self, one: Technique) -> Array | None:
        key = unlimited(one)
        if key not in self._own:
            self._own[key] = unlimited_transmittance(self.case.f, one)
        return self._own[key]


def _kept_or_measured(
    settings: _Settings, one: Technique, precision: str, out: str | os.PathLike[str] | None
) -> list[Row]:
    family = settings.family
    if out is None or not can_be_found(one):
        return [_row(settings, i, one, precision) for i in range(len(family.values))]
    path = os.path.join(out, family.name, file_name(f"{one}-{precision}") + ".json")
    question = _question(settings, one, precision)
    with suppress(LookupError, ValueError, TypeError, AttributeError):  # damaged: measured again
        kept = [from_plain(fields, TEXTS) for fields in answered(path, question)["rows"]]
        if all(set(row) == set(COLUMNS) and row["T_max"] is not None for row in kept):
            return kept
    rows = [_row(settings, i, one, precision) for i in range(len(family.values))]
    os.makedirs(os.path.dirname(path), exist_ok=True)
    keep(path, question, rows=[plain(row) for row in rows])
    return rows


def _question(settings: _Settings, one: Technique, precision: str) -> dict[str, Any]:
    from moit.system.version import VERSION

    family = settings.family
    return {
        "moit": VERSION,
        "family": family.name,
        "values": list(family.values),
        "rays": settings.rays,
        "seed": settings.seed,
        "technique": str(one),
        "precision": precision,
        **identities(technique=one),
    }


def clear(folder: str | os.PathLike[str]) -> None:
    """Removes the rows that `stability` has kept in a folder, and nothing else."""
    for name in FAMILIES:
        path = os.path.join(folder, name)
        for entry in os.scandir(path) if os.path.isdir(path) else ():
            if is_kept(entry.path, "rows"):
                remove(entry.path)


def _row(settings: _Settings, index: int, one: Technique, precision: str) -> Row:
    family = settings.family
    row = Row(dict.fromkeys(COLUMNS))
    row.update(family=family.name, dial=float(family.values[index]), technique=str(one))
    row.update(precision=precision, note="")
    try:
        truth = settings.cases[index]
        f = truth.fragments(precision)
        T = transmittance(f, one, cull_opaque=False)
        image = composite(f, one, cull_opaque=False)
        row["nan"] = int((~np.isfinite(T)).sum() + (~np.isfinite(image)).any(axis=-1).sum())
        T = np.asarray(T, np.float64)
        off = np.maximum(np.maximum(T - truth.most, truth.least - T), 0)
        row["T_p99"], row["T_max"] = _spread(off)
        # all colours are alike, so that only the sum of weights can be off
        row["brightness"] = float(np.abs(image - truth.image)[..., :3].max(initial=0.0) / COLOR)
        own = truth.own(one)
        if own is not None:
            off = np.abs(T - own)[~np.isnan(own)]
            if len(off):
                row["own_p99"], row["own_max"] = _spread(off)
        if truth.case.place is not None and one.block_side == 1:
            row["jump"] = _jump(truth.case, T, truth.most)
        if isinstance(one, MomentTechnique):
            state = moment_state(one, *moments.gather(f, one, cull_opaque=False))
            row.update(
                pivot=state.pivot,
                biased_pivot=state.biased_pivot,
                invalid=state.invalid,
                bias=one.bias_for(f.dtype),
                bias_needed=state.needed,
            )
    except Exception as error:
        row["note"] = told(error)
    return row


def _spread(off: Array) -> tuple[float, float]:
    return float(np.percentile(off, 99)), float(off.max())


def _jump(case: Case, T: Array, exact_T: Array) -> float:
    """The most that a step changes a fragment's transmittance beyond what the exact one changes."""
    assert case.place is not None
    at = np.argsort(case.runs(case.place), axis=2)

    def changes(values: Array) -> Array:
        return np.abs(np.diff(np.take_along_axis(case.runs(values), at, axis=2), axis=1))

    return float((changes(T) - changes(exact_T)).max(initial=0.0))


def _pairs(chosen: list[Technique], precisions: list[str]) -> list[tuple[Technique, str]]:
    """Each form of each technique once, in the order of the techniques."""
    found: dict[tuple[Technique, str], None] = {}
    for one in chosen:
        for precision in precisions:
            form = stored_as(one, precision)
            if form is not None:
                found.setdefault((form, precision))
    return list(found)


def _names(argument: str, given: str | Iterable[str] | None, known: list[str]) -> list[str]:
    if given is None:
        return known
    if not isinstance(given, Iterable):
        raise TypeError(f"{argument}: expected names as str, got {type(given).__name__}")
    found = [given] if isinstance(given, str) else list(given)
    for name in found:
        if not isinstance(name, str):
            raise TypeError(f"{argument}: expected names as str, got {type(name).__name__}")
        if name not in known:
            raise ValueError(f"{argument}: unknown {name!r:.80}{nearest(name, known)}")
    if not found:
        raise ValueError(f"{argument}: expected at least one, got none")
    return list(dict.fromkeys(found))
