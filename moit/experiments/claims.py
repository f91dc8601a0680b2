"""What a paper says, as questions to measured numbers: each claim is judged by its checks."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

from moit.comparing.rows import Row
from moit.reports.columns import number

MOST = 4  # checks that are told where there is little room
HOLDS, PARTLY, FAILS, UNKNOWN = "holds", "holds partly", "does not hold", "not measured"


@dataclass(frozen=True)
class Of:
    """A number of a result: of which column, of which technique's row.

    scene, setting : of which of the rows; None: the first.
    """

    column: str
    technique: str
    scene: str | None = None
    setting: float | None = None

    @property
    def place(self) -> str:
        """Where it was measured, in words."""
        words = [] if self.scene is None else [self.scene]
        return ", ".join([*words, *([] if self.setting is None else [f"at {self.setting:g}"])])


class Numbers:
    """The rows of a result, to look numbers up in."""

    def __init__(self, rows: Sequence[Row]) -> None:
        self.rows = rows

    def get(self, of: Of | float) -> float | None:
        """The number; None where it was not measured, or is not finite."""
        if not isinstance(of, Of):
            return float(of)
        for row in self.rows:
            if (
                of.column in row
                and row.get("technique") == of.technique
                and of.scene in (None, row.get("scene"))
                and of.setting in (None, row.get("setting"))
            ):
                value: Any = row[of.column]
                known = isinstance(value, (int, float)) and math.isfinite(value)
                return float(value) if known else None
        return None


@dataclass(frozen=True)
class Check:
    """What a test found. holds : None where a number is missing."""

    holds: bool | None
    words: str


Test = Callable[[Numbers], Check]


@dataclass(frozen=True)
class Less:
    """Whether `small` is below `factor` times `great`."""

    small: Of | float
    great: Of | float
    factor: float = 1.0

    def __call__(self, numbers: Numbers) -> Check:
        small, great = numbers.get(self.small), numbers.get(self.great)
        about, left, right = _words(self.small, self.great)
        known = small is not None and great is not None
        holds = small < self.factor * great if small is not None and great is not None else None
        sign = "<" if holds is not False else ">="
        times = "" if self.factor == 1 else f"{self.factor:g} x "
        right_text = right if isinstance(self.great, Of) else ""
        shown = f"{left} {_shown(small)} {sign} {times}{right_text} {_shown(great)}"
        return Check(holds if known else None, f"{about}{' '.join(shown.split())}")


@dataclass(frozen=True)
class Rising:
    """Whether numbers come in this order, the least first. Each step is a check of its own."""

    numbers: tuple[Of, ...]

    def steps(self) -> tuple[Less, ...]:
        pairs = zip(self.numbers, self.numbers[1:], strict=False)
        return tuple(Less(a, b) for a, b in pairs)


@dataclass(frozen=True)
class Near:
    """Whether two numbers differ by at most `within`."""

    one: Of | float
    other: Of | float
    within: float

    def __call__(self, numbers: Numbers) -> Check:
        one, other = numbers.get(self.one), numbers.get(self.other)
        about, left, right = _words(self.one, self.other)
        words = f"{about}{left} {_shown(one)}, {right} {_shown(other)}"
        if one is None or other is None:
            return Check(None, words)
        return Check(abs(one - other) <= self.within, f"{words} (within {self.within:g})")


def _words(one: Of | float, other: Of | float) -> tuple[str, str, str]:
    """What two numbers have in common, and what each is called beside it."""
    names = []
    for of in (one, other):
        names.append(of.technique if isinstance(of, Of) else "")
    if isinstance(one, Of) and isinstance(other, Of):
        if (one.column, one.place) == (other.column, other.place):
            return _about(one), names[0], names[1]
        if one.column == other.column:
            left, right = (f"{of.technique} ({of.place})" for of in (one, other))
            return f"{one.column}: ", left, right
        if one.technique == other.technique and one.place == other.place:
            return f"{one.technique}{_at(one)}: ", one.column, other.column
        left, right = (f"{of.column} of {of.technique}{_at(of)}" for of in (one, other))
        return "", left, right
    known = one if isinstance(one, Of) else other
    return (_about(known) if isinstance(known, Of) else ""), names[0], names[1] or "number"


def _at(of: Of) -> str:
    return f" ({of.place})" if of.place else ""


def _about(of: Of) -> str:
    return f"{of.column}{f', {of.place}' if of.place else ''}: "


def _shown(value: float | None) -> str:
    return "?" if value is None else number(value)


@dataclass(frozen=True)
class Claim:
    """A paper's statement.

    text : in our words. where : section, figure or table.
    tests : what must be so; a Rising stands for each of its steps.
    """

    text: str
    where: str
    tests: Sequence[Test | Rising]

    @property
    def of_times(self) -> bool:
        """Whether it is about times, which hang on the machine."""
        asked: list[Any] = []
        for test in self.tests:
            if isinstance(test, Rising):
                asked += test.numbers
            elif isinstance(test, Less):
                asked += [test.small, test.great]
        return any(isinstance(one, Of) and one.column.endswith("ms") for one in asked)

    def judged(self, numbers: Numbers) -> Judged:
        flat: list[Test] = []
        for test in self.tests:
            flat += test.steps() if isinstance(test, Rising) else [test]
        return Judged(self, tuple(test(numbers) for test in flat))


@dataclass(frozen=True)
class Judged:
    """A claim and what its checks found."""

    claim: Claim
    checks: tuple[Check, ...] = field(default=())

    @property
    def verdict(self) -> str:
        """ "holds", "holds partly", "does not hold" or "not measured"."""
        known = [check.holds for check in self.checks if check.holds is not None]
        if not known:
            return UNKNOWN
        return HOLDS if all(known) else PARTLY if any(known) else FAILS

    @property
    def short(self) -> str:
        """`numbers` of a few: first what fails."""
        ordered = sorted(self.checks, key=lambda check: check.holds is not False)
        told = Judged(self.claim, tuple(ordered[:MOST])).numbers
        left = len(ordered) - MOST
        return told if left <= 0 else f"{told}; and {left} more"

    @property
    def numbers(self) -> str:
        """What the checks found, those that fail marked by a leading "not"."""
        return "; ".join(
            check.words if check.holds is not False else f"not so: {check.words}"
            for check in self.checks
        )
