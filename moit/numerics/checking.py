"""check_technique: the promises that techniques make, tried on small pictures and on hard rays."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator
from html import escape
from typing import Any

import numpy as np
from numpy.typing import NDArray

from moit.catalog import Technique
from moit.catalog import technique as technique_named
from moit.checks.exceptions import told
from moit.checks.randomness import seed_of
from moit.core.questions import in_precision
from moit.fragments.fragments import Fragments
from moit.fragments.held import taken
from moit.numerics.hard_cases import FAMILIES
from moit.numerics.unlimited import stored_as
from moit.questions import composite, total_transmittance, transmittance
from moit.reports.columns import number
from moit.system.progress import Progress, steps

Array = NDArray[Any]

TOLERANCE = 1e-6  # of float64, for sums in another order
TOLERANCE_OF_WORDS = 0.05  # where 16 bits are rounded after every fragment
DEPTHS = 65  # of a curve
HEIGHT, WIDTH, LAYERS = 8, 12, 9
BACKGROUND = (0.25, 0.5, 1.0)


@dataclasses.dataclass(frozen=True)
class CheckRow:
    """One promise: whether it is kept (None: it is not made, the number is for information), the
    worst that was found, how much is allowed (None: nothing to hold it to), and what it is of."""

    name: str
    ok: bool | None
    worst: float | None
    allowed: float | None
    note: str

    @property
    def verdict(self) -> str:
        return {True: "yes", False: "NO", None: "-"}[self.ok]


@dataclasses.dataclass(frozen=True)
class TechniqueCheck:
    """What `check_technique` found. `str` is a table of it, as notebooks show it.

    technique : its name.
    rows : of each check `name`, `ok` (None where nothing is promised), `worst`, `allowed`, `note`.

    >>> moit.check_technique("sorted", progress=False).ok
    True
    """

    technique: str
    rows: tuple[CheckRow, ...]

    @property
    def ok(self) -> bool:
        """Whether all that is promised is kept."""
        return all(row.ok is not False for row in self.rows)

    def __getitem__(self, name: str) -> CheckRow:
        """The row of a check, by its name."""
        for row in self.rows:
            if row.name == name:
                return row
        raise KeyError(f"{name!r}: there are {', '.join(row.name for row in self.rows)}")

    def __str__(self) -> str:
        lines = [("check", "ok", "worst", "allowed", "of"), *map(_cells, self.rows)]
        widths = [max(len(line[i]) for line in lines) for i in range(5)]
        made = ["  ".join(c.ljust(w) for c, w in zip(line, widths, strict=True)) for line in lines]
        return "\n".join([f"{self.technique}: {self._said()}", *(one.rstrip() for one in made)])

    __repr__ = __str__

    def _repr_html_(self) -> str:
        heads = "".join(f"<th>{name}</th>" for name in ("check", "ok", "worst", "allowed", "of"))
        body = "".join(
            "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in _cells(row)) + "</tr>"
            for row in self.rows
        )
        said = f"<p><b>{escape(self.technique)}</b>: {self._said()}</p>"
        return f"{said}<table><tr>{heads}</tr>{body}</table>"

    def _said(self) -> str:
        broken = [row.name for row in self.rows if row.ok is False]
        return f"not kept: {', '.join(broken)}" if broken else "all promises are kept"


def check_technique(
    technique: Technique | str,
    *,
    tolerance: float | None = None,
    rays: int = 16,
    seed: int = 0,
    rng: Any = None,
    progress: Progress = True,
) -> TechniqueCheck:
    """Whether a technique keeps what it promises; of one's own as of those that are built in.

    technique : a technique or its name.
    tolerance : what sums in another order, and images in parts, may change; None: 1e-6, and 0.05
        for techniques of moit's that store 16 bits. One's own that rounds as `moit.storage` does
        needs about the steps of that.
    rays : of each hard case of `moit.stability`, from 1.
    seed : of what is random, from 0.
    rng : in place of seed, as Scientific Python's SPEC 7 has it: an integer is that seed, of a
        `numpy.random.Generator` or what else `numpy.random.default_rng` takes one is drawn.
    progress : True, False, or a callable (done, total, label).

    The checks, in float64 where nothing else is said:

    - order: the same picture and transmittance in other orders of arrival, no two fragments of a
      pixel at one depth; promised by `order_independent`, but where answers are random.
    - ties: the same where fragments share depths; for information.
    - range: transmittance at fragments, of curves and of pixels in [0, 1].
    - monotone: curves do not rise; where there is a curve.
    - chunks: each row and each pixel by itself as in the whole; promised by `local`.
    - empty: pictures without fragments, and pixels, show the background.
    - brightness: how far weights are from summing to the coverage that a picture's alpha says;
      promised by `normalize`.
    - finite: every number on all hard cases, in float32 and float64.
    - precision: what float32 changes; for information.
    - self-shadowing: what a fragment's own alpha changes of the transmittance in front of it; for
      information: published techniques have it, `sorted` does not.

    A check that raises an error is not passed, and its row says so. Raises TypeError and ValueError
    for bad arguments.

    >>> check = moit.check_technique("weighted-sum", progress=False)
    >>> check.ok, check["range"].ok, check["order"].ok
    (False, False, True)
    """
    one = technique_named(technique)
    seed = seed_of(seed, rng)
    for name, value, least in (("rays", rays, 1), ("seed", seed, 0)):
        if isinstance(value, bool) or not isinstance(value, int | np.integer):
            raise TypeError(f"{name}: expected an integer, got {type(value).__name__}")
        if value < least:
            raise ValueError(f"{name}: expected at least {least}, got {value}")
    if tolerance is None:
        words = stored_as(one, "16 bit") == one
        tolerance = TOLERANCE_OF_WORDS if words else TOLERANCE
    if isinstance(tolerance, bool) or not isinstance(tolerance, int | float):
        raise TypeError(f"tolerance: expected a number or None, got {type(tolerance).__name__}")
    if not 0 <= tolerance < np.inf:
        raise ValueError(f"tolerance: expected a finite number from 0, got {tolerance}")
    tried = _Tried(one, float(tolerance), int(rays), int(seed))
    rows = []
    with steps(progress, len(CHECKS), "check") as done:
        for name, check in CHECKS.items():
            try:
                rows.append(check(tried))
            except Exception as error:
                rows.append(CheckRow(name, False, None, None, told(error)))
            done(f"{one} {name}")
    return TechniqueCheck(str(one), tuple(rows))


@dataclasses.dataclass(frozen=True)
class _Tried:
    technique: Technique
    tolerance: float
    rays: int
    seed: int

    def picture(self, ties: bool = False) -> Fragments:
        """A small picture in float64 with empty pixels, and such with an opaque surface."""
        rng = np.random.default_rng(self.seed)
        counts = rng.integers(0, LAYERS + 1, HEIGHT * WIDTH)
        total = int(counts.sum())
        depth = rng.uniform(1.1, 3.9, total)
        if ties:
            depth = 1.1 + np.floor(4 * (depth - 1.1)) / 4
        alpha = rng.uniform(0.02, 0.9, total)
        alpha[rng.random(total) < 0.04] = 1
        offsets = np.concatenate([[0], np.cumsum(counts)])
        color = rng.random((total, 3))
        shape = (HEIGHT, WIDTH)
        return Fragments(offsets, depth, alpha, color, shape=shape, depth_range=(1, 4))

    def cases(self) -> Iterator[tuple[str, Fragments]]:
        """Every hard case."""
        for family in FAMILIES.values():
            for value in family.values:
                yield f"{family.name} {value:g}", family.case(value, self.rays, self.seed).f

    def order_change(self, f: Fragments) -> float:
        """The most that other orders of arrival change."""
        T, image = transmittance(f, self.technique), composite(f, self.technique)
        pixel = np.repeat(np.arange(len(f.counts)), f.counts)
        worst = 0.0
        for number_ in range(3):
            key = np.random.default_rng([self.seed, number_]).random(len(f))
            order = np.lexsort((key, pixel))
            other = f._with(*taken(f._arrays(), order))
            worst = max(
                worst,
                _apart(transmittance(other, self.technique), T[order]),
                _apart(composite(other, self.technique), image),
            )
        return worst


def _order(tried: _Tried) -> CheckRow:
    promised = tried.technique.order_independent and not tried.technique.random
    worst = max(
        tried.order_change(tried.picture()),
        *(tried.order_change(FAMILIES["order"].case(n, 16, tried.seed).f) for n in (8, 64)),
    )
    note = "transmittance and pictures in three other orders"
    return _row("order", promised, worst, tried.tolerance, note)


def _ties(tried: _Tried) -> CheckRow:
    worst = tried.order_change(tried.picture(ties=True))
    return _row("ties", False, worst, tried.tolerance, "the same where fragments share depths")


def _range(tried: _Tried) -> CheckRow:
    one, f = tried.technique, tried.picture()
    found = [transmittance(f, one), total_transmittance(f, one).ravel()]
    if one.has_curve:
        found.append(transmittance(f, one, _depths(f)).ravel())
    numbers = np.concatenate(found)
    worst = float(np.maximum(numbers - 1, -numbers).max(initial=0.0))
    return _row("range", True, max(worst, 0.0), TOLERANCE, "how far outside [0, 1]")


def _monotone(tried: _Tried) -> CheckRow:
    if not tried.technique.has_curve:
        return CheckRow("monotone", None, None, None, "there is no curve")
    f = tried.picture()
    curves = transmittance(f, tried.technique, _depths(f))
    worst = float(np.diff(curves, axis=-1).max(initial=0.0))
    return _row("monotone", True, worst, TOLERANCE, f"the largest rise between {DEPTHS} depths")


def _chunks(tried: _Tried) -> CheckRow:
    one, f = tried.technique, tried.picture()
    T, image = transmittance(f, one), composite(f, one, background=BACKGROUND)
    worst = 0.0
    for y in range(HEIGHT):
        begin, end = f.offsets[y * WIDTH], f.offsets[(y + 1) * WIDTH]
        worst = max(worst, _apart(transmittance(f[y : y + 1, :], one), T[begin:end]))
        for x in range(WIDTH):
            alone = composite(f[y, x], one, background=BACKGROUND)
            worst = max(worst, _apart(alone, image[y : y + 1, x : x + 1]))
    note = "rows and pixels by themselves"
    promised = one.local and not one.random
    return _row("chunks", promised, worst, tried.tolerance, note)


def _empty(tried: _Tried) -> CheckRow:
    one = tried.technique
    none = np.zeros(0)
    f = Fragments(np.zeros(7, int), none, none, np.zeros((0, 3)), shape=(2, 3), depth_range=(1, 4))
    shown = composite(f, one, background=BACKGROUND)
    worst = _apart(shown, np.broadcast_to([*BACKGROUND, 0], shown.shape))
    worst = max(worst, _apart(total_transmittance(f, one), np.ones(f.shape)))
    if len(transmittance(f, one)):
        raise AssertionError("transmittance of no fragments")
    if one.has_curve:
        worst = max(worst, _apart(transmittance(f, one, [1.0, 2.0]), np.ones((2, 3, 2))))
    return _row("empty", True, worst, TOLERANCE, "pixels without fragments show the background")


def _brightness(tried: _Tried) -> CheckRow:
    f = tried.picture()
    white = f._with(f.depth, np.minimum(f.alpha, 0.9), np.ones_like(f.color))
    image = composite(white, tried.technique, background=(0, 0, 0))
    seen = image[f.counts.reshape(image.shape[:2]) > 0]  # `empty` sees to the others
    worst = _apart(seen[:, :3], seen[:, 3:])
    promised = getattr(tried.technique, "normalize", False) is True
    note = "white fragments over black: colour against coverage"
    return _row("brightness", promised, worst, TOLERANCE, note)


def _finite(tried: _Tried) -> CheckRow:
    one, bad, where, cases = tried.technique, 0, "", 0
    for name, given in tried.cases():
        for f in (given, in_precision(given, np.float32)):
            cases += 1
            try:
                found = [
                    transmittance(f, one, cull_opaque=False),
                    composite(f, one, cull_opaque=False),
                    total_transmittance(f, one, cull_opaque=False),
                ]
                if one.has_curve:
                    found.append(transmittance(f, one, _depths(f)[::8], cull_opaque=False))
                lost = sum(int((~np.isfinite(numbers)).sum()) for numbers in found)
                said = f"{name} in {f.dtype}"
            except Exception as error:
                lost, said = 1, f"{name} in {f.dtype}: {told(error)}"
            bad += lost
            where = where or (said if lost else "")
    note = f"first at {where}" if where else f"{cases} hard cases"
    return _row("finite", True, bad, 0, note)


def _precision(tried: _Tried) -> CheckRow:
    f = tried.picture()
    single = transmittance(in_precision(f, np.float32), tried.technique)
    worst = _apart(single, transmittance(f, tried.technique))
    return _row("precision", False, worst, None, "float32 against float64")


def _self_shadowing(tried: _Tried) -> CheckRow:
    one, f = tried.technique, tried.picture()
    f = Fragments(
        f.offsets, f.depth, np.minimum(f.alpha, 0.9), f.color, shape=f.shape, depth_range=(1, 4)
    )
    T = transmittance(f, one)
    place = np.arange(len(f)) - np.repeat(f.offsets[:-1], f.counts)
    changed = np.zeros(len(f))
    for layer in range(LAYERS):
        here = place == layer
        other = f._with(f.depth, np.where(here, 0.0, f.alpha), f.color)
        changed[here] = np.abs(transmittance(other, one) - T)[here]
    note = f"what its own alpha changes; {number(float(changed.mean()))} on the mean"
    return _row("self-shadowing", False, float(changed.max()), None, note)


CHECKS: dict[str, Callable[[_Tried], CheckRow]] = {
    "order": _order,
    "ties": _ties,
    "range": _range,
    "monotone": _monotone,
    "chunks": _chunks,
    "empty": _empty,
    "brightness": _brightness,
    "finite": _finite,
    "precision": _precision,
    "self-shadowing": _self_shadowing,
}


def _row(name: str, promised: bool, worst: float, allowed: float | None, note: str) -> CheckRow:
    if not promised or allowed is None:
        return CheckRow(name, None, float(worst), None, note)
    return CheckRow(name, bool(worst <= allowed), float(worst), allowed, note)


def _cells(row: CheckRow) -> tuple[str, str, str, str, str]:
    worst, allowed = ("" if one is None else number(one) for one in (row.worst, row.allowed))
    return row.name, row.verdict, worst, allowed, row.note


def _depths(f: Fragments) -> NDArray[np.float64]:
    return np.linspace(*f.depth_range, DEPTHS)


def _apart(one: Array, other: Array) -> float:
    return float(np.abs(np.asarray(one, np.float64) - other).max(initial=0.0))
